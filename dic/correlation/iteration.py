"""Iterate the points of a reference on a frame: a whole grid at a time, or one by one."""

from __future__ import annotations

import numpy as np

from dic.arrays import AnyArray, Mask
from dic.correlation import dense_motion, frame_moments, point_status
from dic.correlation.deformed_image import DeformedImage
from dic.correlation.newton import Points
from dic.correlation.reference import Reference
from dic.correlation.start import Start
from dic.fields.displacement import Status
from dic.fields.grid import Grid

MAX_PASSES = 10
"""Of a whole field."""

FEW = 0.05
"""Fraction of points below which they iterate alone."""

_HARDLY_ANY = 0.001  # fraction of points by which those found may still grow
_TRIES = 2  # a point that is lost is tried again beside those found
HOPE = 0.5  # fraction of a field that must not be flat after some passes
PATIENCE = 3  # passes
_BESIDE = 40  # px, how far a motion is carried to points that were lost


def iterate_field(ref: Reference, grid: Grid, spline: AnyArray, points: Points) -> None:
    """Iterate a grid on the frame warped by its dense motion, until few points still move."""
    held, windows = -1, (*grid.pixels, ref.half)
    usable = ref.status == Status.OK
    sums = np.empty((*grid.shape, len(frame_moments.frame_plan(ref.order).sums)))
    for passes in range(MAX_PASSES):
        net = dense_motion.motion_grid(points.motion, grid)
        frame_moments.sums_on_grid(ref.texture, spline, net, windows, ref.order, sums)
        points.step(ref, sums.reshape(len(ref.xy), -1), net.base)
        inside = usable & ~point_status.leaves_image(ref, points.motion)
        good = inside & (points.zncc >= point_status.FOUND)
        moving, count = int(np.sum(good & ~points.still)), int(np.sum(good))
        if moving <= FEW * count and not may_grow(count, held, int(np.sum(inside)) - count):
            return
        if passes >= PATIENCE and point_status.is_flat(ref, points)[good].mean() > HOPE:
            return
        held = count
        points.motion, _ = dense_motion.fill(ref.xy, points.motion, good)


def unsettled(ref: Reference, points: Points) -> Mask:
    """Find the points of a field that was iterated which shall go on alone, (N,) bool."""
    usable = point_status.is_correlated(ref, points) & ~points.still
    if np.count_nonzero(usable) > FEW * len(usable):
        usable &= ~point_status.is_flat(ref, points)
    return usable


def begin_again(ref: Reference, points: Points, begun: Start) -> Mask:
    """Put points of small parts that were lost back to where they began, (N,) bool.

    What moves around such a part reaches into the dense motion between its points.
    """
    if begun.alone is None:
        return np.zeros(len(ref.xy), bool)
    lost = begun.alone & ~point_status.is_correlated(ref, points)
    points.motion[lost], points.still[lost] = begun.motion(ref.order)[lost], False
    points.zncc[lost], points.change[lost] = np.nan, np.nan
    return lost


def may_grow(count: int, held: int, lost: int) -> bool:
    """Whether more points may be found than `count`: it rose from `held`, and some are lost."""
    return min(count - held, lost) > _HARDLY_ANY * count


def iterate_points(ref: Reference, frame: DeformedImage, points: Points, waiting: AnyArray) -> None:
    """Iterate the points `waiting` one by one; try those that are lost again beside those found.

    Alone, a point does not feel what a lost neighbour does to the dense motion.
    """
    tried = np.zeros(len(waiting), dtype=np.int8)
    while waiting.any():
        tried += waiting
        points.iterate(ref, frame, np.flatnonzero(waiting & ~points.still))
        good = point_status.is_correlated(ref, points) & ~point_status.is_flat(ref, points)
        lost = (ref.status == Status.OK) & ~good
        if not lost.any() or not (good & waiting).any():
            return
        motion, given = dense_motion.fill(ref.xy, points.motion, good, _BESIDE)
        waiting = given & lost & ~point_status.leaves_image(ref, motion) & (tried < _TRIES)
        points.motion[waiting], points.still[waiting] = motion[waiting], False
