"""Few shapes and stresses that hold the states of a plate, found in states of the whole plate.

Proper orthogonal decomposition: of all sets of so many functions, the one that leaves the least
energy of the states outside.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from fe.arrays import F32, F64, I64
from fe.elements.hermite import hermite_gram
from fe.elements.mesh import Mesh
from fe.reduced.interpolation import between
from fe.reduced.karman import Karman
from fe.reduced.parallel import in_parts
from fe.reduced.symmetry import Symmetry, from_to
from fe.reduced.training import SnapshotParts, Snapshots, copied, copied_parts

# Shapes of w from linear solutions, which couple one touch to another, and from what touches leave;
# stresses; displacements in the plane. A quarter more stresses and a tenth more shapes lower errors
# of strain by a tenth.
_LINEAR, _REST, _STRESSES, _DRIFTS = 16, 24, 110, 64
# States whose strain is computed at once: at all Gauss points it takes memory.
_TOGETHER = 12


class ReducedBasis(NamedTuple):
    """What the reduced plate is made of, besides the functions that move with the touch.

    Attributes
    ----------
    shapes : (2 nx + 2, 2 ny + 2, n) float64
        Shapes of w, orthonormal in bending energy.
    stresses : (3, gx, gy, M) float64
        Stresses in the plane in balance, orthonormal in their energy.
    drifts : (2, 2 nx + 2, 2 ny + 2, U) float64
        Displacements u, v in the plane, orthonormal over the area.
    stretched : float
        Largest norm of a state in these stresses, N mm to the power ½.
    """

    shapes: F64
    stresses: F64
    drifts: F64
    stretched: float


def basis(
    karman: Karman,
    states: Snapshots,
    shapes: F64,
    ways: Sequence[Symmetry],
    progress: Callable[[], object] = lambda: None,
) -> ReducedBasis:
    """Find the basis of some states and of their copies, with `fixed_shapes` of them.

    The copies of one kind are gone before those of the next are made. `progress` is called 1 +
    `PARTS` times.
    """
    drifts = _drifts(karman, states, ways)
    progress()
    stresses, stretched = _stresses(karman, states, ways, progress)
    return ReducedBasis(shapes, stresses, drifts, stretched)


def fixed_shapes(karman: Karman, parts: SnapshotParts, ways: Sequence[Symmetry]) -> F64:
    """Find shapes (2 nx + 2, 2 ny + 2, n) of w in the parts of states and of their copies."""
    parts = copied_parts(karman, parts, ways)
    stiffness, free = karman.stiffness, karman.linear.free
    linear = parts.linear @ leading(parts.linear.T @ (stiffness @ parts.linear), _LINEAR)
    rest = parts.rest - linear @ (linear.T @ (stiffness @ parts.rest))
    rest = rest @ leading(rest.T @ (stiffness @ rest), _REST)
    flat = np.concatenate([linear, rest], axis=1)
    shapes = np.zeros((*karman.mesh.shape, flat.shape[1]))
    shapes[free] = flat.reshape(*shapes[free].shape)
    return shapes


def _stresses(
    karman: Karman, states: Snapshots, ways: Sequence[Symmetry], progress: Callable[[], object]
) -> tuple[F64, float]:
    """Stresses (3, gx, gy, M), and the largest norm of a state in them.

    Work of one copy on another is that of the state on the copy which leads from one to the other:
    copies of all stresses, the largest arrays of all that is made, are never there together.
    """
    values = copied(lambda way: way.deflections(states.values), ways)
    own = stretching_work(karman, states.stress, values, progress)
    blocks = own.reshape(len(own), len(ways), -1)[:, from_to(ways)]
    energy = blocks.transpose(1, 0, 2, 3).reshape(values.shape[2], -1)
    mixed = balanced(0.5 * (energy + energy.T), _STRESSES)
    stresses = np.zeros((*states.stress.shape[:3], mixed.shape[1]))
    for way, part in zip(ways, np.split(mixed, len(ways)), strict=True):
        # By components: all at once are as large as what is made.
        for component, moved in zip(stresses, way.stresses(states.stress), strict=True):
            component += moved @ part
    return stresses, float(np.linalg.norm(mixed.T @ energy, axis=0).max())


def stretching_work(
    karman: Karman, stress: F64, values: F64, progress: Callable[[], object] = lambda: None
) -> F64:
    """Work of C stresses (3, gx, gy, C) on the stretching of S deflections: (C, S), N mm.

    `progress` is called `PARTS` times.
    """
    count = values.shape[2]
    work = np.empty((stress.shape[-1], count))
    for some in in_parts(count):
        for part in _together(some):
            strain = karman.membrane.stretching(values[:, :, part])
            work[:, part] = karman.membrane.work(stress, strain)
        progress()
    return work


def _together(some: I64) -> list[I64]:
    """Divide numbers of states into those that are computed at once."""
    return [some[first : first + _TOGETHER] for first in range(0, len(some), _TOGETHER)]


def _drifts(karman: Karman, states: Snapshots, ways: Sequence[Symmetry]) -> F64:
    plane = copied(lambda way: way.displacements(states.plane), ways)
    product = np.zeros((plane.shape[-1],) * 2)
    for component in plane:
        forces = spread_out(karman.mesh, component)
        product += np.tensordot(component, forces, ((0, 1), (0, 1)))
    return plane @ balanced(product, _DRIFTS)


def at_nodes(karman: Karman, stresses: F64) -> F64:
    """Stresses (3, gx, gy, M) at the nodes, (nx + 1, ny + 1, 3, M)."""
    gauss, nodes = karman.membrane.gauss, karman.mesh.nodes
    x, y = (between(a.places, at) for a, at in zip((gauss.x, gauss.y), nodes, strict=True))
    return np.einsum("ig,jh,cghm->ijcm", x, y, stresses, optimize=True)


def work_on_strain(
    karman: Karman, stresses: F64, drifts: F64, progress: Callable[[], object] = lambda: None
) -> F32:
    """Work of the stresses of a basis, and of those that its displacements as forces bring.

    Single precision, for the reduced plate errs by more than 1e-4. `progress` is called 2 `PARTS`
    times.

    Returns
    -------
    (M + U, 3 gx gy) float32
        Matrix from strains at the Gauss points.
    """
    membrane, own = karman.membrane, stresses.shape[3]
    rows = np.empty((own + drifts.shape[3], stresses[..., 0].size), dtype=np.float32)
    for some in in_parts(own):
        for part in _together(some):
            rows[part] = membrane.weigh(stresses[..., part])
        progress()
    for some in in_parts(drifts.shape[3]):
        for part in _together(some):
            forces = np.stack([spread_out(karman.mesh, one) for one in drifts[..., part]])
            drifting = membrane.stress(membrane.strain(membrane.solve(forces)))
            rows[own + part] = -membrane.weigh(drifting)
        progress()
    return rows


def spread_out(mesh: Mesh, values: F64) -> F64:
    """Compute the loads ∫ f u dA, for every f, of functions u: (2 nx + 2, 2 ny + 2, C) both."""
    along_x, along_y = (hermite_gram(line, 0, 0).toarray() for line in mesh.lines)
    return along_y @ np.tensordot(along_x, values, 1)


def balanced(product: F64, count: int) -> F64:
    """Like `leading`, with every state of the same weight."""
    scale = 1.0 / np.sqrt(np.diag(product))
    return scale[:, None] * leading(scale[:, None] * product * scale, count)


def leading(product: F64, count: int) -> F64:
    """Mixtures of S functions that are orthonormal and hold most of them.

    Parameters
    ----------
    product : (S, S) float64
        Inner products of the functions.
    count : int

    Returns
    -------
    (S, C) float64
        C at most `count`, fewer where the functions have no more to give.
    """
    energies, vectors = np.linalg.eigh(product)
    energies, vectors = energies[::-1][:count], vectors[:, ::-1][:, :count]
    # Below this part of the largest, rounding has mixed into the product.
    there = energies > 1e-12 * energies[0]
    return vectors[:, there] / np.sqrt(energies[there])
