"""Correlate a frame with its reference: the moment method.

Once an iteration the whole frame is warped by the dense motion U between the points, and every
point solves for the motion u_p of its subset and the light,

    min Σ_W [ (g(x + U) - B)/A - f - ∇f·U + ∇f·u_p(ξ) - α f - β ]²,

from sums over its subset. Gain A and offset B make it ZNSSD. The fixed point does not depend on how
U is interpolated to first order: whatever g(x + U) misses of the motion is in the residual.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from dic.arrays import F64, I64, AnyArray, Mask
from dic.correlation import dense_motion, features, frame_moments, point_status, seeds
from dic.correlation.deformed_image import DeformedImage, read_parts, read_whole
from dic.correlation.newton import Points
from dic.correlation.reference import Reference
from dic.fields import shape
from dic.fields.displacement import DisplacementField, Status
from dic.fields.grid import Grid
from dic.images.image import check_image, check_pair
from dic.numbers import check_type, read_array

_MAX_PASSES = 10  # of the whole field
_PART = 2500  # px filtered for one point, in the time that the whole image takes
_FEW = 0.05  # fraction of points below which they iterate alone
_HARDLY_ANY = 0.001  # fraction of points by which those found may still grow
_SEED_SPACINGS = 60, 30  # px, the second where holes or lost parts leave too few
_TRIES = 2  # a point that is lost is tried again beside those found
_HOPE = 0.5  # fraction of a field that must not be flat after some passes
_PATIENCE = 3  # passes
_BESIDE = 40  # px, how far a motion is carried to points that were lost
_ENOUGH = 0.4  # fraction of the seeds found from which they are enough
_TURNED = 0.25  # fraction of the seeds below which the image may be turned or stretched


def correlate(
    ref: Reference, image: ArrayLike, guess: DisplacementField | ArrayLike | None = None
) -> DisplacementField:
    """Measure the displacement of every point of a reference in a frame.

    Parameters
    ----------
    ref : Reference
    image : (H, W) uint8, uint16 or float, grey levels
        The deformed image, of the size of the reference. Gain and offset of its light are free.
    guess : DisplacementField or (N, 2) px, optional
        Displacement to start from, such as the field of the previous frame. NaN is filled from the
        nearest neighbour. Without it, or if all of it is NaN, the points are searched for over the
        whole image.

    Returns
    -------
    DisplacementField
        A point that cannot be measured has its `Status` and NaN.

    Raises
    ------
    ValueError
        The image or the guess does not belong to the reference.

    Notes
    -----
    σ: where both images carry noise σ, the residual of a subset has the variance (1 + κ)σ², κ ≤ 1
    being what interpolation leaves of the noise between the pixels. From it follows σ, and σ_u² is
    2σ² times the diagonal of the inverse of the full Hessian (motion and light): 2σ²/SSSIG for a
    balanced pattern. The fraction of the Hessian that is noise of the reference is taken off, and
    where a field on a grid is rougher than its σ says, σ is that much larger (`roughness`).
    """
    return point_status.displacement_field(ref, *iterate(ref, image, guess))


def iterate(
    ref: Reference, image: ArrayLike, guess: DisplacementField | ArrayLike | None
) -> tuple[Points, DeformedImage]:
    """Iterate the points of a reference on a frame, as far as they can be followed.

    Raises
    ------
    ValueError
        As `correlate`.
    """
    check_type(ref, Reference, "ref", "dic.prepare")
    image = check_image(image, "deformed")
    check_pair(ref.image.shape, image.shape)
    usable = ref.status == Status.OK
    motion, known, repeats = _start(ref, image, guess, usable)
    points = Points(dense_motion.fill(ref.xy, motion, known)[0])
    if repeats or not known.any():
        points.repeats = usable & repeats
        return points, read_parts(image)
    frame = None
    if ref.grid is None and len(motion) * _PART < image.size:
        frame = read_parts(image)
        _iterate_points(ref, frame, points, usable)
        usable &= np.isnan(points.change)
    if frame is None or usable.any():
        frame = read_whole(image, ref.prefilter)
        if ref.grid is not None:
            _iterate_field(ref, ref.grid, frame.pixels, points)
            usable = point_status.is_correlated(ref, points) & ~points.still
            if np.count_nonzero(usable) > _FEW * len(usable):
                usable &= ~point_status.is_flat(ref, points)
        _iterate_points(ref, frame, points, usable)
    return points, frame


def _start(
    ref: Reference, image: AnyArray, guess: DisplacementField | ArrayLike | None, usable: Mask
) -> tuple[F64, Mask, bool]:
    """Motion (N, 2, P) to start from, where it is known, and whether the pattern repeats."""
    motion = np.zeros((len(ref.xy), 2, shape.count(ref.order)))
    if guess is None:
        places, found, known, repeats = _search(ref, image.astype(np.float32), usable)
        motion[places, :, :3] = found
        motion[:, :, 1:] *= ref.order > 0
        return motion, known, repeats
    given = _read_guess(ref, guess)
    known = np.isfinite(given.sum(axis=1))
    if not known.any():
        return _start(ref, image, None, usable)
    motion[known, :, 0] = given[known]
    if isinstance(guess, DisplacementField):
        motion[known, :, 1:3] = guess.gradient[known] if ref.order else 0.0
    return motion, known, False


def _read_guess(ref: Reference, guess: DisplacementField | ArrayLike) -> F64:
    """Return the displacement (N, 2) px of a guess, or raise ValueError."""
    if isinstance(guess, DisplacementField):
        given = np.column_stack([guess.u, guess.v])
    else:
        given = read_array(guess, "guess", "px")
    if given.shape != ref.xy.shape:
        raise ValueError(
            f"guess must be {ref.xy.shape} px, one (u, v) a point, got {given.shape}; "
            "take NaN where none is known"
        )
    largest = max(ref.image.shape)
    if np.any(np.abs(given) > largest):
        raise ValueError(
            f"guess holds motions up to {np.nanmax(np.abs(given)):g} px, more than the image of "
            f"{largest} px; set what is not known to NaN"
        )
    return given


def _search(ref: Reference, image: AnyArray, usable: AnyArray):
    """Find some points (S,) of a reference, their motion (S, 2, 3), and which are known (N,).

    And whether the pattern repeats, so that none is known.
    """
    places, motion, found = np.zeros(0, dtype=np.int64), np.zeros((0, 2, 3)), np.zeros(0, bool)
    repeats = False
    for spacing in _SEED_SPACINGS:
        places = _seed_places(ref, usable, spacing)
        motion, found, repeats = seeds.find(ref.image, image, ref.xy[places])
        # Closer seeds find more where some are found; where none is, they find none either.
        if repeats or not found.any() or np.count_nonzero(found) >= _ENOUGH * len(places):
            break
    if not repeats and np.count_nonzero(found) < _TURNED * len(places):
        turn = features.affine(ref.image, image)
        if turn is not None:
            xy, straight = ref.xy[places], features.straighten(image, turn)
            rest, there, _ = seeds.find(ref.image, straight, xy)
            if np.count_nonzero(there) > np.count_nonzero(found):
                motion, found = features.follow(xy, turn, rest), there
    known = np.zeros(len(usable), dtype=bool)
    known[places] = found
    return places, motion, known, repeats


def _seed_places(ref: Reference, usable: Mask, spacing: int) -> I64:
    """Choose the points to search for: in each cell of the image the one nearest its middle.

    Points whose subset is whole come first: a hole in a template is found in other holes.
    """
    places = np.flatnonzero(usable)
    cell, offset = np.divmod(ref.xy[places], spacing)
    away = np.abs(offset - spacing / 2).max(axis=1)
    away += spacing * (ref.light[places, 2] < ref.subset**2)
    nearest = np.argsort(away, kind="stable")
    _, first = np.unique(cell[nearest] @ (1.0, 1e5), return_index=True)
    return places[nearest[first]]


def _iterate_field(ref: Reference, grid: Grid, spline: AnyArray, points: Points) -> None:
    """Iterate a grid on the frame warped by its dense motion, until few points still move."""
    held, sums_of = -1, _summing(ref, grid, spline)
    for passes in range(_MAX_PASSES):
        net = dense_motion.motion_grid(points.motion, grid)
        points.step(ref, sums_of(net), net.base)
        good = point_status.is_correlated(ref, points)
        moving, count = np.count_nonzero(good & ~points.still), np.count_nonzero(good)
        if moving <= _FEW * count and count <= held + _HARDLY_ANY * count:
            return
        if passes >= _PATIENCE and point_status.is_flat(ref, points)[good].mean() > _HOPE:
            return
        held = count
        points.motion, _ = dense_motion.fill(ref.xy, points.motion, good)


def _summing(
    ref: Reference, grid: Grid, spline: AnyArray
) -> Callable[[dense_motion.MotionGrid], AnyArray]:
    """Make what takes the sums (N, S) of a frame for a dense motion, where the reference says."""
    if ref.device is not None:
        from dic.correlation import device_moments

        return device_moments.summing(ref.texture, spline, grid, ref.order, ref.device)
    windows = *grid.pixels, ref.half
    sums = np.empty((*grid.shape, len(frame_moments.frame_plan(ref.order).sums)))

    def take(net: dense_motion.MotionGrid) -> AnyArray:
        frame_moments.sums_on_grid(ref.texture, spline, net, windows, ref.order, sums)
        return sums.reshape(len(ref.xy), -1)

    return take


def _iterate_points(
    ref: Reference, frame: DeformedImage, points: Points, waiting: AnyArray
) -> None:
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
