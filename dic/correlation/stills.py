"""A reference from several still images: less noise of its own, and a σ that was sampled."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import ArrayLike

from dic.arrays import F64, AnyArray
from dic.correlation import clipping
from dic.correlation.checks import check_options, read_roi
from dic.correlation.correlation import correlate, iterate
from dic.correlation.point_status import median_noise
from dic.correlation.reference import Reference, Rest, prepare, prepare_rest
from dic.fields.displacement import DisplacementField
from dic.fields.grid import Grid
from dic.images.image import check_image, check_reference
from dic.images.prefilter import Prefilter, choose_prefilter

_FEWEST = 30  # points from which their scatter is sampled
_TREMBLE = 0.2  # px


def prepare_stills(
    images: Sequence[ArrayLike],
    subset: int = 21,
    step: int = 5,
    order: int = 1,
    roi: ArrayLike | None = None,
    points: ArrayLike | Grid | None = None,
    prefilter: Prefilter | float | None = None,
) -> Reference:
    """Prepare the mean of several images of the specimen at rest as the reference.

    Parameters
    ----------
    images : sequence of (H, W) uint8, uint16 or float, grey levels
        Two or more. The camera may tremble by some hundredths of a px between them.
    subset, step, order, roi, points, prefilter
        As of `prepare`; the prefilter is chosen by the noise that the images differ by.

    Returns
    -------
    Reference
        With `stills`, their number, and `scatter`, by which σ of u and v is widened: what the
        images scatter by over what is stated of each. Noise that is not white shows in it.

    Raises
    ------
    ValueError
        As `prepare`; or there are fewer than two images, they differ in size, or one has moved.
    """
    stills = _checked(images)
    subset, step, order = check_options(stills[0].shape, subset, step, order)
    mean = check_reference(np.asarray(np.mean(stills, axis=0, dtype=np.float64), dtype=np.float32))
    chosen = _prefilter(stills, mean, subset, roi) if prefilter is None else prefilter
    rest = Rest(mean, len(stills), clipping.levels(stills[0]))
    prepared = partial(prepare_rest, rest, subset)
    sparse = prepared(max(step, subset), order, roi, points, None, chosen)
    scatter = _scatter(sparse, stills)
    return replace(prepared(step, order, roi, points, None, chosen), scatter=scatter)


def _checked(images: Sequence[ArrayLike]) -> list[AnyArray]:
    """Check the stills, each by its number; they go on in a list."""
    try:
        stills = [check_image(image, f"still {n + 1}") for n, image in enumerate(images)]
    except TypeError:
        raise ValueError("stills must be images (H, W), two or more; list them") from None
    if len(stills) < 2:
        raise ValueError(
            f"stills must be 2 images or more, got {len(stills)}; use dic.prepare for one"
        )
    (height, width), *others = (still.shape for still in stills)
    for n, other in enumerate(others):
        if other != (height, width):
            raise ValueError(
                f"still {n + 2} is {other[1]}x{other[0]} px and the first {width}x{height} px; "
                "all must come from one camera setting"
            )
    return stills


def _prefilter(
    stills: list[AnyArray], mean: AnyArray, subset: int, roi: ArrayLike | None
) -> Prefilter | None:
    """Choose the prefilter by the noise that one still leaves over on another, if it is found."""
    first = prepare(stills[0], subset, subset, roi=roi, prefilter=0)
    points, _ = iterate(first, stills[-1], np.zeros_like(first.xy))
    noise = median_noise(first, points)
    if not np.isfinite(noise):
        return None
    chosen = choose_prefilter(mean, read_roi(roi, mean.shape), subset, noise)
    return replace(chosen, noise=noise)


def _scatter(sparse: Reference, stills: list[AnyArray]) -> F64:
    """Root mean square of u and v of the stills over their σ, (2,), 1 or more.

    A still is part of the mean that it is compared with: noise and residual are both less by that,
    so their ratio is not.

    Raises
    ------
    ValueError
        A still has moved.
    """
    start = np.zeros_like(sparse.xy)
    squares = [_squares(correlate(sparse, still, start), n) for n, still in enumerate(stills)]
    found = np.concatenate(squares)
    if len(found) < _FEWEST:
        return np.ones(2)
    return np.maximum(np.sqrt(found.mean(axis=0)), 1.0)


def _squares(field: DisplacementField, number: int) -> F64:
    """(u/σ)² and (v/σ)² of the valid points, (V, 2), less the motion that all have."""
    moved = np.column_stack([field.u, field.v])[field.valid]
    sigma = np.column_stack([field.sigma_u, field.sigma_v])[field.valid]
    if not len(moved):
        return np.zeros((0, 2))
    together = np.median(moved, axis=0)
    if np.hypot(*together) > _TREMBLE:
        raise ValueError(
            f"still {number + 1} lies {np.hypot(*together):.2g} px from the mean of all, more than"
            f" the {_TREMBLE:g} px by which a camera may tremble; leave it out"
        )
    return np.square((moved - together) / sigma)
