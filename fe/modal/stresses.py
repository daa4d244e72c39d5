"""Stresses in the plane that hold the states of a plate however its edges give there.

A stress in balance with itself is work of the edges alone: where an edge gives by c, it moves by
-c t under its traction t. A basis of such stresses, learned from the stretching of many deflections
between rigid and giving edges, turns the plane into as many numbers.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import product

import numpy as np
import scipy.linalg

from fe.arrays import F64
from fe.elements.mesh import Mesh
from fe.linear.membrane import Membrane, Stretched
from fe.modal.parameters import SIDES
from fe.modal.transverse import Transverse, moments
from fe.plate.edges import Edge, Edges, Springs, edge_of
from fe.reduced.basis import balanced, leading, spread_out

SOFT = 0.3
"""How far edges give of which stresses are learned, in parts of what the whole plate does."""

_STRONG = 10.0
_FURTHER = 40  # stresses for each edge that may give, and for all, where strain is read


@dataclass(frozen=True, eq=False)
class Stresses:
    """Stresses in the plane and how edges move under them.

    Attributes
    ----------
    stress : (3, gx, gy, M) float64, N/mm
        In balance with themselves, orthonormal in their energy; then zeros, for the splits of what
        acts in corners.
    giving : (8, M, M) float64
        Energy of the edges, ∮ t t or ∮ s t t, by a unit of compliance of each and of its slope.
    drifts : (2, 2 nx + 2, 2 ny + 2, U) float64
        Displacements u, v in the plane, orthonormal over the area.
    reading : (3, gx, gy, U) float64, N/mm
        Stresses of the rigidly held plate under forces that spread like the drifts.
    slipping : (8, U, M) float64
        Amplitude of each drift by a unit of each stress and of each compliance.
    """

    stress: F64
    giving: F64
    drifts: F64
    reading: F64
    slipping: F64


def stresses(functions: Transverse, states: Stretched, count: int, drifting: int) -> Stresses:
    """Find the `count` stresses and `drifting` displacements that hold most of some states."""
    rigid = Membrane(functions.held, functions.mesh)
    basis = _stress_basis(rigid, states.stress, count)
    drifts = _drift_basis(functions.mesh, states.values, drifting)
    forces = np.stack([spread_out(functions.mesh, component) for component in drifts])
    reading = _stress_under(rigid, forces)
    return _with_edges(rigid, basis, drifts, reading, forces)


def stretching_read(functions: Transverse, plane: Stresses, forces: F64) -> Stresses:
    """Return the same stresses with other displacements: what is read of u and v, exactly.

    Parameters
    ----------
    functions : Transverse
    plane : Stresses
    forces : (2, 2 nx + 2, 2 ny + 2, R) float64
        Readings by the unknowns of u and v; the drifts become what balances these as forces.
    """
    rigid = Membrane(functions.held, functions.mesh)
    reading = _stress_under(rigid, forces)
    stress = np.concatenate([plane.stress, _giving_way(rigid, forces, reading, plane.stress)], 3)
    return _with_edges(rigid, stress, rigid.solve(forces), reading, forces)


def _with_edges(rigid: Membrane, stress: F64, drifts: F64, reading: F64, forces: F64) -> Stresses:
    """Compute how edges move under stresses, and under splits of what acts in corners."""
    splits = _splits(rigid)
    own = _tractions(rigid, reactions(rigid, stress))
    own = [np.concatenate(pair, axis=2) for pair in zip(own, splits, strict=True)]
    acting = _tractions(rigid, reactions(rigid, reading) - forces)
    none = np.zeros((*stress.shape[:3], splits[0].shape[2]))
    return Stresses(
        stress=np.concatenate([stress, none], axis=3),
        giving=_edge_work(rigid, own, own),
        drifts=drifts,
        reading=reading,
        slipping=_edge_work(rigid, acting, own),
    )


def _giving_way(rigid: Membrane, forces: F64, reading: F64, known: F64) -> F64:
    """Stresses by which a reading changes where an edge gives, that are not among those known.

    An adjoint state between edges that give is that between rigid ones and a stress in balance with
    itself. With these among the stresses, what is read is right to second order.
    """
    plate = rigid.plate
    soft = SOFT * np.sqrt(plate.area) / (plate.young * plate.thickness)
    held = np.array([_holds(getattr(plate.sides, side)) for side in SIDES])
    found = known[..., :0]
    for giving in np.concatenate([np.diag(held)[held], held[None]]):  # one alone, then all
        change = _stress_under(softened(rigid, soft * giving), forces) - reading
        basis = np.concatenate([known, found], axis=3)
        change -= basis @ rigid.work(basis, _strain_of(rigid, change))
        energy = rigid.work(change, _strain_of(rigid, change))
        found = np.concatenate([found, change @ leading(0.5 * (energy + energy.T), _FURTHER)], 3)
    return found


def softened(rigid: Membrane, giving: F64) -> Membrane:
    """Let edges give by `giving` (4,) mm²/N where they hold."""
    plate = rigid.plate
    sides = {side: getattr(plate.sides, side) for side in SIDES}
    for (side, edge), compliance in zip(sides.items(), giving.tolist(), strict=True):
        if compliance > 0 and _holds(edge):
            deflection, rotation, _ = edge.springs
            sides[side] = edge_of(Springs(deflection, rotation, 1.0 / compliance))
    return Membrane(replace(plate, edges=Edges(**sides)), rigid.mesh)


def _stress_under(rigid: Membrane, forces: F64) -> F64:
    return rigid.stress(rigid.strain(rigid.solve(forces)))


def _stress_basis(rigid: Membrane, stress: F64, count: int) -> F64:
    """Combine stresses into few that are orthonormal in energy, each of the same weight."""
    strain = _strain_of(rigid, stress)
    energy = rigid.work(stress, strain)
    return stress @ balanced(0.5 * (energy + energy.T), count)


def _strain_of(rigid: Membrane, stress: F64) -> F64:
    """Strain C⁻¹ N of stresses."""
    nu, c = rigid.plate.poisson, rigid.stiffness[:, :, None] * (1.0 - rigid.plate.poisson**2)
    xx, yy, xy = stress
    return np.stack([(xx - nu * yy) / c, (yy - nu * xx) / c, (1.0 + nu) * xy / c])


def grading(rigid: Membrane, stress: F64, weight: F64) -> F64:
    """Complementary energy ∫ f N : C⁻¹ N dA of stresses by a weight f (gx, gy): (M, M)."""
    return rigid.work(weight[..., None] * stress, _strain_of(rigid, stress))


def _drift_basis(mesh: Mesh, plane: F64, count: int) -> F64:
    forces = np.stack([spread_out(mesh, component) for component in plane])
    gram = np.tensordot(plane, forces, ((0, 1, 2), (0, 1, 2)))
    return plane @ balanced(gram, count)


def reactions(rigid: Membrane, stress: F64) -> F64:
    """Generalised forces ∫ N : ε(ψ) dA of stresses on u and v, (2, 2 nx + 2, 2 ny + 2, C) N."""
    xx, yy, xy = stress
    return np.stack([rigid.gauss.loads(xx, xy), rigid.gauss.loads(xy, yy)])


def _tractions(rigid: Membrane, forces: F64) -> list[F64]:
    """Tractions with these reactions, on each edge that holds: (2, n, C) by functions along it.

    What acts in a corner is split evenly between the edges that hold it; see `_splits`.
    """
    found: list[F64] = []
    for edge in range(4):
        axis, last = divmod(edge, 2)
        acting = np.moveaxis(forces, axis + 1, 1)[:, -2 if last else 0].copy()
        for end, beside in zip((0, -2), rigid.plate.sides.along(1 - axis), strict=True):
            acting[:, end] /= 1 + _holds(beside)
        held = _holds(rigid.plate.sides.along(axis)[last])
        spread = scipy.linalg.inv(moments(rigid.mesh.lines[1 - axis], 0))
        found.append(spread @ acting if held else np.zeros(acting.shape))
    return found


def _splits(rigid: Membrane) -> list[F64]:
    """Tractions by which two edges may split otherwise what acts in their corner, (2, n, S).

    No stress goes with them: the edge that gives less takes more. Each is so strong that edges
    which give as those of learning have ten times its energy as a stress; stronger ones would turn
    unstable between edges that give by a little less than nothing, as an estimate may have it.
    """
    sides, lines, plate = rigid.plate.sides, rigid.mesh.lines, rigid.plate
    corners = [
        (west, south)
        for west, south in product((0, 1), (0, 1))
        if _holds(sides.along(0)[west]) and _holds(sides.along(1)[south])
    ]
    found = [np.zeros((2, lines[1 - edge // 2].unknowns, 2 * len(corners))) for edge in range(4)]
    for number, (west, south) in enumerate(corners):
        for edge, end, sign in ((west, south, 1.0), (2 + south, west, -1.0)):
            line = lines[1 - edge // 2]
            acting = np.zeros(line.unknowns)
            acting[-2 if end else 0] = sign
            traction = scipy.linalg.solve(moments(line, 0), acting)
            for component in (0, 1):
                found[edge][component, :, 2 * number + component] = traction
    soft = SOFT * np.sqrt(plate.area) / (plate.young * plate.thickness)
    strong = np.sqrt(_STRONG * min(line.unit for line in lines) / soft)
    return [strong * each for each in found]


def _edge_work(rigid: Membrane, left: list[F64], right: list[F64]) -> F64:
    """Integrals ∮ t t' and ∮ s t t' of tractions over each edge, (8, L, R)."""
    found = np.zeros((8, left[0].shape[-1], right[0].shape[-1]))
    for edge, (one, other) in enumerate(zip(left, right, strict=True)):
        line = rigid.mesh.lines[1 - edge // 2]
        for power in (0, 1):
            weighed = moments(line, power) @ other
            found[2 * edge + power] = np.einsum("dil,dir->lr", one, weighed)
    return found


def _holds(edge: Edge) -> bool:
    """Whether an edge holds the plate in its plane."""
    return edge.springs.membrane > 0
