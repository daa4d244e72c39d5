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
from fe.linear.membrane import Membrane, stretch
from fe.modal.parameters import SIDES
from fe.modal.transverse import Transverse, moments
from fe.plate.edges import Edges, Springs, edge_of
from fe.plate.plate import Plate
from fe.reduced.basis import balanced, spread_out

_STRESSES, _DRIFTS = 110, 180
# Compliance of the edges to learn from, in parts of that of the plate across: many times, and some,
# of what a clamp has.
_COMPLIANCES = (0.3, 0.1)
_PRESSED = (9, 6)  # places to learn from, along the longer side and the other
_MIXED = 2  # mixtures of shapes under each of them


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


def stresses(functions: Transverse, shapes: F64) -> Stresses:
    """Learn the stresses of a plate whose shape is a mixture of some, (2 nx + 2, 2 ny + 2, S)."""
    rigid = Membrane(functions.held, functions.mesh)
    strain = _stretching(rigid, *_pressed(functions), shapes)
    stress, plane = _learned(rigid, strain)
    basis = _stress_basis(rigid, stress)
    drifts = _drift_basis(functions.mesh, plane)
    forces = np.stack([spread_out(functions.mesh, component) for component in drifts])
    reading = rigid.stress(rigid.strain(rigid.solve(forces)))
    own, acting = reactions(rigid, basis), reactions(rigid, reading) - forces
    giving, slipping = _edge_work(functions.mesh, own, own), _edge_work(functions.mesh, acting, own)
    return Stresses(basis, giving, drifts, reading, slipping)


def _pressed(functions: Transverse) -> tuple[F64, F64]:
    """Deflections of light touches over the plate, and of all turns: (2 nx + 2, 2 ny + 2, C)."""
    a, b = functions.mesh.size
    counts = _PRESSED if a >= b else _PRESSED[::-1]
    x, y = (side * (np.arange(n) + 0.5) / n for side, n in zip((a, b), counts, strict=True))
    modes = slice(functions.count)
    amplitudes = functions.at(np.array(list(product(x, y))))[:, modes]
    amplitudes = amplitudes / np.diag(functions.stiffness)[modes]
    touched = functions.values[..., modes] @ amplitudes.T
    turned = functions.values[..., functions.count :]
    largest = [np.abs(part[::2, ::2]).max(initial=1e-9) for part in (touched, turned)]
    return touched / largest[0], turned / largest[1]


def _stretching(rigid: Membrane, touched: F64, turned: F64, shapes: F64) -> F64:
    """Strains (3, gx, gy, C) of deflections, touches with the next and over mixed shapes."""
    pressed, turning = rigid.gauss.slopes(touched), rigid.gauss.slopes(turned)
    following = np.roll(pressed[0], 1, axis=2), np.roll(pressed[1], 1, axis=2)
    parts = [stretch(pressed, pressed), stretch(pressed, following), stretch(turning, turning)]
    mixtures = np.random.default_rng(0).standard_normal(
        (_MIXED, shapes.shape[2], len(pressed[0].T))
    )
    for mixture in mixtures:
        parts.append(stretch(rigid.gauss.slopes(shapes @ mixture), pressed))
    return np.concatenate(parts, axis=3)


def _learned(rigid: Membrane, strain: F64) -> tuple[F64, F64]:
    """Stresses and displacements in the plane that strains bring between many kinds of edges."""
    plates = [rigid.plate, *_giving_plates(rigid.plate)]
    states = [Membrane(plate, rigid.mesh).relax(strain) for plate in plates]
    return (
        np.concatenate([state.stress for state in states], axis=3),
        np.concatenate([state.values for state in states], axis=3),
    )


def _giving_plates(plate: Plate) -> list[Plate]:
    """Plates of which each edge that is held gives in the plane, and all of them."""
    typical = max(plate.size) / (plate.young * plate.thickness)
    held = [side for side in SIDES if getattr(plate.sides, side).springs.membrane > 0]
    soft = [(side,) for side in held]
    kinds = [(each, _COMPLIANCES[0] * typical) for each in soft] if len(held) > 1 else []
    kinds += [(tuple(held), c * typical) for c in _COMPLIANCES if held]
    return [_with_springs(plate, sides, 1.0 / compliance) for sides, compliance in kinds]


def _with_springs(plate: Plate, sides: tuple[str, ...], spring: float) -> Plate:
    edges = {side: getattr(plate.sides, side) for side in SIDES}
    for side in sides:
        deflection, rotation, _ = edges[side].springs
        edges[side] = edge_of(Springs(deflection, rotation, spring))
    return replace(plate, edges=Edges(**edges))


def _stress_basis(rigid: Membrane, stress: F64) -> F64:
    """Combine stresses into few that are orthonormal in energy, each of the same weight."""
    strain = _strain_of(rigid, stress)
    energy = rigid.work(stress, strain)
    return stress @ balanced(0.5 * (energy + energy.T), _STRESSES)


def _strain_of(rigid: Membrane, stress: F64) -> F64:
    """Strain C⁻¹ N of stresses."""
    nu, c = rigid.plate.poisson, rigid.stiffness[:, :, None] * (1.0 - rigid.plate.poisson**2)
    xx, yy, xy = stress
    return np.stack([(xx - nu * yy) / c, (yy - nu * xx) / c, (1.0 + nu) * xy / c])


def grading(rigid: Membrane, stress: F64, weight: F64) -> F64:
    """Complementary energy ∫ f N : C⁻¹ N dA of stresses by a weight f (gx, gy): (M, M)."""
    return rigid.work(weight[..., None] * stress, _strain_of(rigid, stress))


def _drift_basis(mesh: Mesh, plane: F64) -> F64:
    forces = np.stack([spread_out(mesh, component) for component in plane])
    gram = np.tensordot(plane, forces, ((0, 1, 2), (0, 1, 2)))
    return plane @ balanced(gram, _DRIFTS)


def reactions(rigid: Membrane, stress: F64) -> F64:
    """Generalised forces ∫ N : ε(ψ) dA of stresses on u and v, (2, 2 nx + 2, 2 ny + 2, C) N."""
    xx, yy, xy = stress
    return np.stack([rigid.gauss.loads(xx, xy), rigid.gauss.loads(xy, yy)])


def _edge_work(mesh: Mesh, left: F64, right: F64) -> F64:
    """Integrals ∮ t t' and ∮ s t t' over each edge, (8, L, R), of tractions with these reactions.

    What acts in a corner is shared by its two edges.
    """
    found = np.empty((8, left.shape[-1], right.shape[-1]))
    for edge in range(4):
        axis, last = divmod(edge, 2)
        line = mesh.lines[1 - axis]
        ends = np.ones(line.unknowns)
        ends[[0, -2]] = 0.5
        solve = scipy.linalg.inv(moments(line, 0))
        one, other = (
            solve @ (ends[:, None] * np.moveaxis(table, axis + 1, 1)[:, -2 if last else 0])
            for table in (left, right)
        )
        for power in (0, 1):
            weighed = moments(line, power) @ other
            found[2 * edge + power] = np.einsum("dil,dir->lr", one, weighed)
    return found
