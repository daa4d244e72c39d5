"""States of the whole plate to learn from: touches that sample it, and what it does under them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import ceil
from typing import NamedTuple

import numpy as np

from fe.arrays import F64
from fe.elements.functional import derivative
from fe.elements.mesh import scaled_mesh
from fe.elements.refinement import refined
from fe.plate.plate import Plate, Touch
from fe.reduced.karman import PREPARED, Deflected, Karman
from fe.reduced.parallel import in_parallel, in_parts
from fe.reduced.symmetry import Symmetry
from fe.reduced.touch_shape import TouchShapes

MARGIN = 0.05
"""Touches nearer than this to an edge, in parts of the shorter side, are not trained."""

# One touch and two touches.
_ONE, _TWO = 160, 50
# Pairs that stretch a plate most. Few states seldom come as far, and up to there it is trusted.
_FARTHEST = np.array([[[1 / 3, 0.5, 1.0], [2 / 3, 0.5, 1.0]], [[0.5, 0.5, 1.0], [0.4, 0.6, 1.0]]])
# Smallest force, in parts of the largest. Below it the plate is nearly linear, which is exact.
_SOFTEST = 0.2
# Residual at which a state is good enough to learn from; the reduced plate errs by 1e-3.
_RESIDUAL = 1e-4
# And on half the elements, which are a start: they are off by more.
_COARSE_RESIDUAL = 1e-3
# Part of the states that must be so good; of flat plates all are.
_BALANCED = 0.9


class Snapshots(NamedTuple):
    """S states of the plate.

    Attributes
    ----------
    touches : list of tuple of Touch
        What presses, one or two each.
    values : (2 nx + 2, 2 ny + 2, S) float64, mm
        Unknowns of w.
    stress : (3, gx, gy, S) float64, N/mm
    plane : (2, 2 nx + 2, 2 ny + 2, S) float64, mm
        Unknowns of u and v.
    """

    touches: list[tuple[Touch, ...]]
    values: F64
    stress: F64
    plane: F64


class SnapshotParts(NamedTuple):
    """Deflections that make up S states with R touches in all, free unknowns.

    Attributes
    ----------
    linear : (N, R) float64, mm
        Linear solution under 1 N at the place of each touch.
    rest : (N, S) float64
        What the functions that move with the touches leave of each state, in parts of the root of
        twice the bending energy of the state less its linear part.
    """

    linear: F64
    rest: F64


def sample(plate: Plate, force: float, copies: int = 1) -> list[tuple[Touch, ...]]:
    """Spread single touches and pairs evenly over the plate and over forces up to the largest.

    `copies` is how many of each the symmetries of the plate make of one.
    """
    one = evenly(ceil(_ONE / copies), 3)
    two = evenly(ceil(_TWO / copies), 6).reshape(-1, 2, 3)
    two = np.concatenate([two, _FARTHEST])
    one = np.concatenate([one, [[0.5, 0.5, 1.0]]])
    return [
        *((_touch(plate, force, part),) for part in one),
        *((_touch(plate, force, a), _touch(plate, force, b)) for a, b in two),
    ]


def evenly(count: int, dimensions: int) -> F64:
    """Points (count, dimensions) that fill the unit cube evenly, always the same ones.

    The k-th is k times a vector of powers of the root of g^(d + 1) = g + 1, modulo 1: for one
    dimension the golden ratio.
    """
    ratio = 1.5
    for _ in range(50):
        ratio = (1.0 + ratio) ** (1.0 / (dimensions + 1))
    steps = ratio ** -np.arange(1.0, dimensions + 1)
    return np.mod(0.5 + np.arange(1, count + 1)[:, None] * steps, 1.0)


def _touch(plate: Plate, force: float, part: F64) -> Touch:
    """Touch for a point of the unit cube: denser towards the edges, where stresses vary most."""
    margin = MARGIN * min(plate.size)
    fraction = 0.5 * part[:2] + 0.25 * (1.0 - np.cos(np.pi * part[:2]))
    x, y = margin + fraction * (np.array(plate.size) - 2.0 * margin)
    return Touch(float(x), float(y), force * _SOFTEST ** float(1.0 - part[2]))


def snapshots(
    karman: Karman,
    touches: list[tuple[Touch, ...]],
    progress: Callable[[], object] = lambda: None,
) -> Snapshots:
    """Solve the whole plate under each set of touches, two at a time, from half the elements on.

    Parameters
    ----------
    karman : Karman
    touches : list of tuple of Touch
    progress : callable
        Called `snapshot_steps` times.

    Raises
    ------
    ValueError
        Too few of them find a balance: a bowed plate that snaps through under the forces.
    """
    count = len(touches)
    values = np.empty((*karman.mesh.shape, count))
    stress = np.empty((3, *karman.membrane.stiffness.shape, count))
    plane = np.empty((2, *karman.mesh.shape, count))
    balanced = np.zeros(count, dtype=bool)
    coarse = Karman(karman.plate, scaled_mesh(karman.mesh, 0.5))
    coarse.prepare(progress)
    karman.prepare(progress)

    def solve(pressed: tuple[Touch, ...]) -> Deflected:
        loads, fine = pressure(coarse, pressed), pressure(karman, pressed)
        first = coarse.solve(loads, _COARSE_RESIDUAL)
        if first.residual > _COARSE_RESIDUAL:
            return karman.solve(fine, _RESIDUAL)
        # What is singular under a touch is in the linear part, which each mesh has its own of.
        smooth = first.values - coarse.linear.solve(loads)
        start = karman.linear.solve(fine) + refined(coarse.mesh, smooth, karman.mesh)
        return karman.solve(fine, _RESIDUAL, start)

    for k, state in enumerate(in_parallel(solve, touches)):
        values[:, :, k] = state.values[:, :, 0]
        stress[..., k] = state.plane.stress[..., 0]
        plane[..., k] = state.plane.values[..., 0]
        balanced[k] = state.residual <= _RESIDUAL
        progress()
    if balanced.mean() < _BALANCED:
        raise ValueError(
            f"reduced plate needs states in balance, got {balanced.sum()} of {count} up to "
            f"{max(t.force for pressed in touches for t in pressed):.3g} N; reduce the plate for "
            "a smaller force, or use the shell"
        )
    if balanced.all():
        return Snapshots(touches, values, stress, plane)
    kept = [pressed for pressed, there in zip(touches, balanced, strict=True) if there]
    return Snapshots(kept, values[:, :, balanced], stress[..., balanced], plane[..., balanced])


def snapshot_steps(touches: list[tuple[Touch, ...]]) -> int:
    """Count the steps of `snapshots`."""
    return 2 * PREPARED + len(touches)


def pressure(karman: Karman, touches: tuple[Touch, ...]) -> F64:
    """Generalised loads of point touches, (2 nx + 2, 2 ny + 2, 1) float64, N."""
    xy = np.array([(t.x, t.y) for t in touches])
    loads = np.zeros((*karman.mesh.shape, 1))
    along_z = np.array([-t.force for t in touches])
    derivative(karman.mesh, xy).add_to(loads, along_z, np.zeros(len(xy), dtype=np.int64))
    return loads


def split(
    shapes: TouchShapes, states: Snapshots, progress: Callable[[], object] = lambda: None
) -> SnapshotParts:
    """Take from the states what the shapes that move with the touches hold of them.

    That is the linear part, and of the tense shapes as much as brings the bending energy of the
    rest to its least. `progress` is called `PARTS` times.
    """
    free, stiffness = shapes.karman.linear.free, shapes.karman.stiffness

    def part(k: int) -> tuple[F64, F64]:
        touches = states.touches[k]
        moving = [shapes.at(np.array([[t.x, t.y]]), np.ones(1))[free] for t in touches]
        moving = np.stack([part.reshape(-1, part.shape[2]) for part in moving], axis=1)
        linear = moving[:, :, 0]
        left = states.values[:, :, k][free].ravel() - linear @ np.array([t.force for t in touches])
        size = np.sqrt(left @ (stiffness @ left))
        tense = moving[:, :, 1:].reshape(len(left), -1)
        bent = stiffness @ tense
        left = left - tense @ np.linalg.lstsq(tense.T @ bent, bent.T @ left, rcond=1e-10)[0]
        return linear, left / size

    found: list[tuple[F64, F64]] = []
    for some in in_parts(len(states.touches)):
        found += in_parallel(part, some.tolist())
        progress()
    linear, rest = zip(*found, strict=True)
    return SnapshotParts(np.concatenate(linear, axis=1), np.stack(rest, axis=1))


def copied(laid: Callable[[Symmetry], F64], ways: Sequence[Symmetry]) -> F64:
    """Lay something on the plate in every way in which it lies on itself, along the last axis.

    One way after the other: together they are the largest arrays of all that is made.
    """
    if len(ways) == 1:
        return laid(ways[0])
    every = np.empty(0)
    for k, way in enumerate(ways):
        part = laid(way)
        count = part.shape[-1]
        if not k:
            every = np.empty((*part.shape[:-1], count * len(ways)))
        every[..., k * count : (k + 1) * count] = part
        del part
    return every


def copied_parts(karman: Karman, parts: SnapshotParts, ways: Sequence[Symmetry]) -> SnapshotParts:
    """Lay parts of deflections on the plate in every way in which it lies on itself."""
    if len(ways) == 1:
        return parts
    free = karman.linear.free

    def moved(vectors: F64) -> F64:
        table = np.zeros((*karman.mesh.shape, vectors.shape[1]))
        table[free] = vectors.reshape(*table[free].shape)
        return copied(lambda way: way.deflections(table)[free].reshape(vectors.shape), ways)

    return SnapshotParts(moved(parts.linear), moved(parts.rest))
