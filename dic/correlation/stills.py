"""A reference from several still images: less noise of its own, and a σ that was sampled."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from dic.arrays import F64, I64, AnyArray
from dic.correlation.checks import check_options, read_roi
from dic.correlation.correlation import correlate, iterate
from dic.correlation.point_status import median_noise
from dic.correlation.reference import Reference, prepare
from dic.fields.displacement import DisplacementField
from dic.fields.grid import Grid
from dic.images.image import check_image, check_pair
from dic.images.prefilter import Prefilter, choose_prefilter

_TRIED = 8  # stills whose scatter is sampled
_FEWEST = 30  # points from which it is


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
        As `prepare`; or there are fewer than two images, or they differ in size.
    """
    stills = [check_image(image, "reference") for image in _listed(images)]
    if len(stills) < 2:
        raise ValueError(
            f"stills must be 2 images or more, got {len(stills)}; use dic.prepare for one"
        )
    for still in stills[1:]:
        check_pair(stills[0].shape, still.shape)
    subset, step, order = check_options(stills[0].shape, subset, step, order)
    mean = np.asarray(np.mean(stills, axis=0, dtype=np.float64), dtype=np.float32)
    chosen = _prefilter(stills, mean, subset, roi) if prefilter is None else prefilter
    reference = prepare(mean, subset, step, order, roi, points, None, chosen)
    reference = replace(reference, stills=len(stills))
    return replace(reference, scatter=_scatter(reference, stills))


def _listed(images: Sequence[ArrayLike]) -> list[ArrayLike]:
    try:
        return list(images)
    except TypeError:
        raise ValueError("stills must be images (H, W), two or more; list them") from None


def _prefilter(
    stills: list[AnyArray], mean: AnyArray, subset: int, roi: ArrayLike | None
) -> Prefilter | None:
    """Choose the prefilter by the noise that one still leaves over on another, if it is found."""
    first = prepare(stills[0], subset, subset // 2, roi=roi, prefilter=0)
    points, _ = iterate(first, stills[-1], np.zeros_like(first.xy))
    noise = median_noise(first, points)
    if not np.isfinite(noise):
        return None
    chosen = choose_prefilter(mean, read_roi(roi, mean.shape), subset, noise)
    return replace(chosen, noise=noise / len(stills) ** 0.5)


def _scatter(reference: Reference, stills: list[AnyArray]) -> F64:
    """Root mean square of u and v of the stills over their σ, (2,), 1 or more.

    A still is part of the mean that it is compared with: noise and residual are both less by that,
    so their ratio is not.
    """
    some: I64 = np.unique(np.linspace(0, len(stills) - 1, _TRIED).astype(np.int64))
    start = np.zeros_like(reference.xy)
    squares = [_squares(correlate(reference, stills[int(k)], start)) for k in some]
    found = np.concatenate(squares)
    if len(found) < _FEWEST:
        return np.ones(2)
    return np.maximum(np.sqrt(found.mean(axis=0)), 1.0)


def _squares(field: DisplacementField) -> F64:
    """(u/σ)² and (v/σ)² of the valid points, (V, 2), less the motion that all have."""
    moved = np.column_stack([field.u, field.v])[field.valid]
    sigma = np.column_stack([field.sigma_u, field.sigma_v])[field.valid]
    if not len(moved):
        return np.zeros((0, 2))
    return np.square((moved - np.median(moved, axis=0)) / sigma)
