"""What the field net reads of tiles, and what it writes: all in units of the adaptive field's σ."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.ndimage import uniform_filter

from dic import AdaptiveTiles
from models.arrays import F32, F64, AnyArray
from models.field_net.unet import INPUTS, STRIDE

_FINE, _COARSE = 9, 33  # tiles, boxes whose mean is taken off
_REST = 6.0  # σ, largest residual that is read
_BOXES = 1, 3, 9, 25  # tiles
_CALM = 3.0  # σ of the adaptive field, up to which a mean is read as it is
LOGARITHM = 1.5  # largest change of the logarithm of σ


def net_inputs(tiles: AdaptiveTiles) -> F32:
    """Make the inputs (2, 9, R', C') of the net for u and v, filled up to its stride.

    Means over four boxes of what tiles leave over of the adaptive field, in its σ; that field less
    its means over two boxes, of which the second shows a step and no plane; its σ and that of its
    slope, over the noise of a tile; and whether the tile was seen.
    """
    known = np.isfinite(tiles.values[0, 0])
    seen = known & tiles.valid
    out = np.zeros((2, INPUTS, *known.shape), np.float32)
    for a in range(2):
        noise = np.maximum(tiles.noise[a], 1e-12)
        value = _continued(tiles.values[a, 0], known)
        spread = [np.maximum(_continued(tiles.sigma[a, k], known) / noise, 1e-6) for k in range(3)]
        rest = np.where(seen, np.clip((tiles.seen[a] - value) / noise, -_REST, _REST), 0.0)
        for k, side in enumerate(_BOXES):
            out[a, k] = _CALM * np.arcsinh(_mean(rest, seen, side) / spread[0] / _CALM)
        fine = _mean(value, known, _FINE)
        out[a, 4] = np.arcsinh((value - fine) / noise)
        out[a, 5] = np.arcsinh((fine - _mean(fine, known, _COARSE)) / noise)
        out[a, 6] = 0.5 * np.log(spread[0]) + 1
        out[a, 7] = 0.5 * np.log(np.hypot(spread[1], spread[2])) + 1
        out[a, 8] = seen
    return np.nan_to_num(_whole(out))


def corrected(tiles: AdaptiveTiles, outputs: AnyArray) -> AdaptiveTiles:
    """Add what the net says, (2, 6, R', C'), to the adaptive field and to ln σ.

    How unsure slopes are where the field bends is a part of that.
    """
    rows, columns = tiles.valid.shape
    said = np.asarray(outputs, np.float64)[:, :, :rows, :columns]
    values = tiles.values + said[:, :3] * tiles.sigma
    growth = np.exp(np.clip(said[:, 3:], -LOGARITHM, LOGARITHM))
    factor = np.ones_like(tiles.slope_factor)
    return replace(tiles, values=values, sigma=tiles.sigma * growth, slope_factor=factor)


def _continued(plane: F64, known: AnyArray) -> F64:
    if known.all():
        return plane
    usual = float(np.median(plane[known])) if known.any() else 0.0
    return np.where(known, plane, usual)


def _mean(plane: F64, known: AnyArray, side: int) -> F64:
    """Mean of what is known over a box around each tile."""
    weight = known.astype(np.float64)
    total = np.asarray(uniform_filter(plane * weight, side, mode="nearest"))
    return total / np.maximum(np.asarray(uniform_filter(weight, side, mode="nearest")), 1e-6)


def _whole(inputs: F32) -> F32:
    """Fill rows and columns up to a multiple of the stride of the net, by the last ones."""
    missing = [-n % STRIDE for n in inputs.shape[2:]]
    return np.pad(inputs, ((0, 0), (0, 0), (0, missing[0]), (0, missing[1])), mode="edge")
