"""Stresses in the plane that hold the states of a plate however its edges give there.

A stress in balance with itself is work of the edges alone: where an edge gives by c, it moves by
-c t under its traction t. A basis of such stresses, learned from the stretching of many deflections
between rigid and giving edges, turns the plane into as many numbers.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy.linalg

from fe.arrays import F64
from fe.elements.mesh import Mesh
from fe.linear.membrane import Membrane, Stretched
from fe.modal.transverse import Transverse, moments
from fe.plate.edges import Edge
from fe.reduced.basis import balanced, spread_out


@dataclass(frozen=True, eq=False)
class Stresses:
    """Stresses in the plane and how edges move under them.

    Attributes
    ----------
    stress : (3, gx, gy, M) float64, N/mm
        In balance with themselves, orthonormal in their energy.
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
    own = reactions(rigid, basis)
    reading = _stress_under(rigid, forces)
    slipping = _edge_work(rigid, reactions(rigid, reading) - forces, own)
    return Stresses(basis, _edge_work(rigid, own, own), drifts, reading, slipping)


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
    own, acting = reactions(rigid, plane.stress), reactions(rigid, reading) - forces
    return replace(
        plane,
        drifts=rigid.solve(forces),
        reading=reading,
        slipping=_edge_work(rigid, acting, own),
    )


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


def _edge_work(rigid: Membrane, left: F64, right: F64) -> F64:
    """Integrals ∮ t t' and ∮ s t t' over each edge, (8, L, R), of tractions with these reactions.

    What acts in a corner is shared by the edges that hold the plate there.
    """
    found = np.zeros((8, left.shape[-1], right.shape[-1]))
    for edge in range(4):
        axis, last = divmod(edge, 2)
        if not _holds(rigid.plate.sides.along(axis)[last]):
            continue
        line = rigid.mesh.lines[1 - axis]
        ends = np.ones(line.unknowns)
        ends[[0, -2]] = [
            1.0 / (1 + _holds(next_one)) for next_one in rigid.plate.sides.along(1 - axis)
        ]
        solve = scipy.linalg.inv(moments(line, 0))
        one, other = (
            solve @ (ends[:, None] * np.moveaxis(table, axis + 1, 1)[:, -2 if last else 0])
            for table in (left, right)
        )
        for power in (0, 1):
            weighed = moments(line, power) @ other
            found[2 * edge + power] = np.einsum("dil,dir->lr", one, weighed)
    return found


def _holds(edge: Edge) -> bool:
    """Whether an edge holds the plate in its plane."""
    return edge.springs.membrane > 0
