"""What the image net reads of a warped pair: steps of Gauss and Newton over many windows.

Over a window W the pixels say that the motion left over is δ = -(Σ J Jᵀ)⁻¹ Σ J r, with the residual
r = g - f and the gradient J of both images together, which makes the step right to second order
(efficient second-order minimisation, Benhimane and Malis, IROS 2004). A window flattens what is
left over, and not the motion so far; with the mean of that over the window it smooths both. The net
chooses and mixes windows; all else that it reads says how.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from models.arrays import F32
from models.image_net.warped_pair import ImagePair, PairMotion, on_cells

WINDOWS = (
    (3, 3), (5, 5), (9, 9), (17, 17), (33, 33),
    (9, 3), (3, 9), (17, 3), (3, 17), (17, 5), (5, 17),
)  # fmt: skip
"""Columns and rows of cells of each window."""
MEANS = ((9, 9), (17, 17), (33, 33))
"""Windows over which the mean of the motion so far is taken too."""
OTHERS = 8
PARTS = len(WINDOWS) + len(MEANS)
INPUTS = 2 * PARTS + OTHERS
STRIDE = 8  # cells: rows and columns of what the net reads are a multiple

_LIGHT = 41  # px, over which gain and offset are one
_WIDE = 33  # cells, over which noise and contrast are measured
_RIDGE = 0.02  # of the usual contrast: a window without pattern says that nothing moves
_DERIVATIVE = np.array([1, -8, 0, 8, -1], np.float32)[::-1] * np.float32(-1 / 12)
_FAINT = 1e-3  # px, the least noise that is known
_ROOTS = np.array([0.1 * (a * b) ** 0.5 for a, b in (*WINDOWS, *MEANS)], np.float32)
"""Half of what a window says is in units of its own noise, of which the net reads the arsinh."""


@dataclass(frozen=True, eq=False)
class PairFeatures:
    """What the net reads of a pair, cell by cell.

    Attributes
    ----------
    inputs : (INPUTS, R', C') float32
        Filled up to its stride.
    windows : (2, PARTS, R, C) float32, px
        Motion left over of u and v, as each of `WINDOWS` says it; and the mean of the motion so far
        over each of `MEANS`, less the motion itself.
    size : (R, C) float32, px
        Local size of the motion left over with its noise.
    noise : (R, C) float32, px
        σ of a window of 5 x 5 cells.
    zncc : (R, C) float32
        Correlation of both images around each cell.
    left : (R, C) float32, px²
        Mean square of the residual that no motion of 5 x 5 cells explains, over the contrast.
    """

    inputs: F32
    windows: F32
    size: F32
    noise: F32
    zncc: F32
    left: F32


def pair_features(pair: ImagePair, motion: PairMotion) -> PairFeatures:
    """Compare a pair about what is known of its motion."""
    first, weight = pair.first, pair.weight
    second, zncc = _lit_as(first, pair.second(motion.pixels), weight)
    sums = _products(first, second, weight)
    covered = _box(on_cells(weight), (_WIDE, _WIDE)) + np.float32(1e-3)
    contrast = _box(0.5 * (sums[..., 0] + sums[..., 2]), (_WIDE, _WIDE)) / covered
    sums /= contrast[..., None] + np.float32(1e-3)
    here = np.ascontiguousarray(np.moveaxis(motion.cells, 0, -1))
    windows = np.stack(
        [_window(sums, window) for window in WINDOWS]
        + [_box(here, window) - here for window in MEANS]
    )
    small = _box(sums, WINDOWS[1])
    left = _left_over(small)
    wide = _box(left, (_WIDE, _WIDE)) / covered
    pixels = 4 * WINDOWS[1][0] * WINDOWS[1][1]
    noise = np.maximum(np.sqrt(np.maximum(wide, 0) / pixels), np.float32(_FAINT))
    power = 0.5 * np.square(windows[0]).sum(axis=-1)
    size = np.sqrt(_box(power, WINDOWS[3]) + np.square(noise))
    windows = np.ascontiguousarray(np.moveaxis(windows, -1, 0))
    scores = np.arcsinh(windows * _ROOTS[:, None, None] / noise)
    inputs = np.concatenate([
        scores.reshape(-1, *size.shape),
        small[..., 0:1].transpose(2, 0, 1) - 1, small[..., 1:2].transpose(2, 0, 1),
        small[..., 2:3].transpose(2, 0, 1) - 1,
        0.5 * np.log(size / noise)[None], 0.5 * np.log(noise)[None] + 2,
        (np.sqrt(np.maximum(left, 0) / (wide + 1e-12)) - 1)[None],
        0.5 * np.log(motion.sigma / noise) + 0.5,
    ])  # fmt: skip
    return PairFeatures(
        _whole(inputs.astype(np.float32)), windows, size, noise, on_cells(zncc), left
    )


def _lit_as(first: F32, second: F32, weight: F32) -> tuple[F32, F32]:
    """Give the second image the mean and the contrast that the first has around each pixel.

    Returns
    -------
    second : (H, W) float32, grey levels
    zncc : (H, W) float32
        Correlation of both around each pixel.
    """
    count = _around(weight) + np.float32(1e-3)
    f, g = first * weight, second * weight
    mean_f, mean_g = _around(f) / count, _around(g) / count
    var_f = np.maximum(_around(f * first) / count - mean_f * mean_f, 1e-3)
    var_g = np.maximum(_around(g * second) / count - mean_g * mean_g, 1e-3)
    zncc = (_around(f * second) / count - mean_f * mean_g) / np.sqrt(var_f * var_g)
    gain = np.clip(np.sqrt(var_f / var_g), 0.25, 4.0)
    return np.asarray((second - mean_g) * gain + mean_f, np.float32), zncc.astype(np.float32)


def _around(pixels: F32) -> F32:
    return _box(pixels, (_LIGHT, _LIGHT))


def _products(f: F32, g: F32, weight: F32) -> F32:
    """Means over cells of Jx², Jx Jy, Jy², -Jx r, -Jy r, r²: (R, C, 6)."""
    both, r = np.asarray(0.5 * (f + g), np.float32), (g - f) * weight
    one = np.ones(1, np.float32)
    jx = np.asarray(cv2.sepFilter2D(both, cv2.CV_32F, _DERIVATIVE, one), np.float32) * weight
    jy = np.asarray(cv2.sepFilter2D(both, cv2.CV_32F, one, _DERIVATIVE), np.float32) * weight
    planes = (jx * jx, jx * jy, jy * jy, -jx * r, -jy * r, r * r)
    return np.stack([on_cells(np.asarray(plane, np.float32)) for plane in planes], -1)


def _window(sums: F32, window: tuple[int, int]) -> F32:
    """Motion left over in each window, (R, C, 2) px."""
    xx, xy, yy, bx, by = np.moveaxis(_box(sums[..., :5], window), -1, 0)
    xx, yy = xx + np.float32(_RIDGE), yy + np.float32(_RIDGE)
    over = 1 / (xx * yy - xy * xy)
    return np.stack([(yy * bx - xy * by) * over, (xx * by - xy * bx) * over], -1)


def _left_over(sums: F32) -> F32:
    """Mean square that the motion of a window leaves, over the contrast, (R, C), px²."""
    xx, xy, yy, bx, by, rr = np.moveaxis(sums, -1, 0)
    xx, yy = xx + np.float32(_RIDGE), yy + np.float32(_RIDGE)
    taken = (yy * bx * bx - 2 * xy * bx * by + xx * by * by) / (xx * yy - xy * xy)
    return np.maximum(rr - taken, 0.0)


def _box(planes: F32, window: tuple[int, int]) -> F32:
    """Mean over a window around each cell."""
    return np.asarray(
        cv2.boxFilter(np.ascontiguousarray(planes), -1, window, borderType=cv2.BORDER_REFLECT),
        np.float32,
    )


def _whole(inputs: F32) -> F32:
    """Fill rows and columns up to a multiple of the stride, by the last ones."""
    missing = [-n % STRIDE for n in inputs.shape[1:]]
    return np.pad(inputs, ((0, 0), (0, missing[0]), (0, missing[1])), mode="edge")
