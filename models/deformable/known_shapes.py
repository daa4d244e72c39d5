"""Which of many shapes an image shows: where a search for bend and twist begins."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from scipy.ndimage import gaussian_filter, map_coordinates

import fe
from models.arrays import F64, AnyArray
from models.deformable.seen_shape import SeenShape
from models.deformable.shape_fit import ShapeFit, Watched, fit_shape, misfit_of

BENDS = (0.1, 0.4, 1.0, 2.0, 3.5, 5.5, 7.5, 9.5)
"""Bends of the shapes that are known, mm in 100 mm of length."""

TWISTS = (0.0, 3.0, 6.0, 9.0, 12.0, 15.0)
"""Their twists, degrees; those the other way are mirror images."""

# Points a side at which images are compared, in from the edge by so much of the side.
_POINTS, _EDGE = 41, 0.04
# Blur of both images, px: what lies between two known shapes.
_BLUR = 5.0
# Shapes that are looked at more closely.
_BEST = 3


def known_shapes(
    shell: fe.Shell,
    bends: Sequence[float] = BENDS,
    twists: Sequence[float] = TWISTS,
    report: Callable[[int, int], object] = lambda done, total: None,
) -> tuple[fe.ShellState, ...]:
    """Compute one stable shape of each of a range of bases; see `with_images`.

    Parameters
    ----------
    shell : fe.Shell
    bends : sequence of float, mm
    twists : sequence of float, degrees
        Rising from 0.
    report : callable
        Takes how many of how many shapes are done.
    """
    found: list[fe.ShellState] = []
    total = len(bends) * len(twists)
    for bend in bends:
        state = shell.at(fe.Base(bend))
        for twist in twists:
            state = shell.moved(state, fe.Base(bend, twist))
            if not state.stability.converged:
                break
            found.append(state)
            report(len(found), total)
    return tuple(found)


def with_images(states: Sequence[fe.ShellState]) -> tuple[fe.ShellState, ...]:
    """Add the half turns and mirror images of shapes of a plate held alike on opposite edges."""
    images = ((*turned_shapes(state), *turned_shapes(mirror(state))) for state in states)
    return tuple(each for group in images for each in group)


def turned_shapes(state: fe.ShellState) -> tuple[fe.ShellState, ...]:
    """Return a state and its half turns, which have the same base and energy, each once."""
    shapes = [state]
    for axis in range(3):
        values = fe.half_turned(state.values, axis)
        if all(np.abs(values - other.values).max() > 1e-3 for other in shapes):
            shapes.append(replace(state, values=values))
    return tuple(shapes)


def mirror(state: fe.ShellState) -> fe.ShellState:
    """Return the mirror image of a state: of the same bend, twisted the other way."""
    base = fe.Base(state.base.bend, -state.base.twist)
    return replace(state, base=base, values=fe.mirrored(state.values))


def agreement(watched: Watched, frame: AnyArray, states: Sequence[fe.ShellState]) -> F64:
    """Zero-normalised cross-correlation of blurred images at points of each shape, (S,)."""
    plate = states[0].plate
    lines = [np.linspace(_EDGE * side, (1 - _EDGE) * side, _POINTS) for side in plate.size]
    xy = np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1).reshape(-1, 2)
    rest = SeenShape(states[0], watched.camera).at_rest(xy)
    expected = _sampled(watched.reference, watched.camera.project(rest))
    blurred = gaussian_filter(np.asarray(frame, dtype=np.float64), _BLUR)
    found = np.empty(len(states))
    for index, state in enumerate(states):
        px = watched.camera.project(SeenShape(state, watched.camera).places(xy))
        seen = map_coordinates(blurred, [px[:, 1], px[:, 0]], order=1, mode="nearest")
        found[index] = np.corrcoef(expected, np.asarray(seen))[0, 1]
    return found


def identify_shape(watched: Watched, frame: AnyArray, known: Sequence[fe.ShellState]) -> ShapeFit:
    """Find the shape of a plate in an image of which nothing is known.

    Of the known shapes the few that agree best are fitted to blurred images, and the one that
    leaves least of them is followed to the sharp ones.
    """
    best: list[int] = np.argsort(-agreement(watched, frame, known))[:_BEST].tolist()
    coarse = [misfit_of(watched, frame, known[index]) for index in best]
    return fit_shape(watched, frame, min(coarse, key=lambda fit: fit.misfit).state)


def _sampled(image: AnyArray, px: F64) -> F64:
    blurred = gaussian_filter(np.asarray(image, dtype=np.float64), _BLUR)
    return np.asarray(map_coordinates(blurred, [px[:, 1], px[:, 0]], order=1, mode="nearest"))
