"""What the image net reads of a warped pair: steps of Gauss and Newton over many windows.

Over a window W the pixels say that the motion left over is δ = -(Σ J Jᵀ)⁻¹ Σ J r, with the residual
r = g - f and the gradient J of both images together, which makes the step right to second order
(efficient second-order minimisation, Benhimane and Malis, IROS 2004). A window flattens what is
left over, and not the motion so far; with the mean of that over the window it smooths both. The net
chooses and mixes windows; all else that it reads says how.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np

from models.arrays import F32, Mask
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
    """What a pair says about what is known of its motion, cell by cell.

    What only the net reads is computed when it is asked for.

    Attributes
    ----------
    sums : (R, C, 6) float32
        Means over cells of Jx², Jx Jy, Jy², -Jx r, -Jy r, r², over the contrast.
    motion : PairMotion
        What is known.
    noise : (R, C) float32, px
        σ of a window of 5 x 5 cells.
    zncc : (R, C) float32
        Correlation of both images around each cell.
    left : (R, C) float32, px²
        Mean square of the residual that no motion of 5 x 5 cells explains, over the contrast.
    usual : (R, C) float32, px²
        Mean of that, far around.
    looked_at : (R, C) bool
        Cells of which a part is in the ROI.
    """

    sums: F32
    motion: PairMotion
    noise: F32
    zncc: F32
    left: F32
    usual: F32
    looked_at: Mask

    @cached_property
    def five(self) -> F32:
        """Motion left over in windows of 5 x 5 cells, (R, C, 2) px."""
        return _window(self.sums, WINDOWS[_FIVE])

    @cached_property
    def nine(self) -> F32:
        """Motion left over in windows of 9 x 9 cells, (R, C, 2) px."""
        return _window(self.sums, WINDOWS[_NINE])

    @cached_property
    def windows(self) -> F32:
        """Motion left over of u and v, as each of `WINDOWS` says it, (2, PARTS, R, C) px.

        Then the mean of the motion so far over each of `MEANS`, less the motion itself.
        """
        known = {_FIVE: self.five, _NINE: self.nine}
        here = np.ascontiguousarray(np.moveaxis(self.motion.cells, 0, -1))
        every = [
            known[k] if k in known else _window(self.sums, window)
            for k, window in enumerate(WINDOWS)
        ]
        every += [_box(here, window) - here for window in MEANS]
        return np.ascontiguousarray(np.moveaxis(np.stack(every), -1, 0))

    @cached_property
    def size(self) -> F32:
        """Local size of the motion left over with its noise, (R, C) px."""
        power = 0.5 * np.square(self.windows[:, 0]).sum(axis=0)
        around = _box(np.asarray(power, np.float32), WINDOWS[3])
        return np.sqrt(around + np.square(self.noise))

    @cached_property
    def inputs(self) -> F32:
        """What the net reads, (INPUTS, R', C'), filled up to its stride."""
        size, noise, small = self.size, self.noise, _box(self.sums, WINDOWS[_FIVE])
        scores = np.arcsinh(self.windows * _ROOTS[:, None, None] / noise)
        inputs = np.concatenate([
            scores.reshape(-1, *size.shape),
            small[..., 0:1].transpose(2, 0, 1) - 1, small[..., 1:2].transpose(2, 0, 1),
            small[..., 2:3].transpose(2, 0, 1) - 1,
            0.5 * np.log(size / noise)[None], 0.5 * np.log(noise)[None] + 2,
            (np.sqrt(np.maximum(self.left, 0) / (self.usual + 1e-12)) - 1)[None],
            0.5 * np.log(self.motion.sigma / noise) + 0.5,
        ])  # fmt: skip
        return _whole(inputs.astype(np.float32))


_FIVE, _NINE = WINDOWS.index((5, 5)), WINDOWS.index((9, 9))


def pair_features(pair: ImagePair, motion: PairMotion) -> PairFeatures:
    """Compare a pair about what is known of its motion."""
    first, weight = pair.first, pair.weight
    second, zncc = _lit_as(first, pair.second(motion.pixels), weight)
    sums = _products(first, second, weight)
    inside = on_cells(weight)
    covered = _box(inside, (_WIDE, _WIDE)) + np.float32(1e-3)
    contrast = _box(0.5 * (sums[..., 0] + sums[..., 2]), (_WIDE, _WIDE)) / covered
    sums /= contrast[..., None] + np.float32(1e-3)
    left = _left_over(_box(sums, WINDOWS[_FIVE]))
    wide = np.asarray(_box(left, (_WIDE, _WIDE)) / covered, np.float32)
    pixels = 4 * WINDOWS[_FIVE][0] * WINDOWS[_FIVE][1]
    noise = np.maximum(np.sqrt(np.maximum(wide, 0) / pixels), np.float32(_FAINT))
    return PairFeatures(sums, motion, noise, on_cells(zncc), left, wide, inside > 0)


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
