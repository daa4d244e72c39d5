"""What of the pattern is visible: behind a hand, in the dark, after a jump of the camera."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
from scipy.linalg import solve_triangular

from dic import Status, TileBlocks, TileReference, TileSums, tile_gradient
from models import Estimator, TilePattern
from rig.system.arrays import F64, AnyArray, Mask

SLIGHT = 0.02  # of the tiles hidden: a speck or a scratch, not a hand
HIDDEN = 0.75  # of the tiles, beyond which the others say too little
DARK = 0.3  # of the contrast of the reference, below which there is no pattern to follow
COARSE = 512  # px, longer side of the images in which a jump is looked for: right to 0.4 px


class MaskedModels:
    """Pattern and estimators for the visible tiles; those for the last mask are kept.

    What hides a part of the pattern mostly stays there for many frames.

    Attributes
    ----------
    pattern : TilePattern
        The whole pattern.
    estimator : Estimator
        Of its touches.
    """

    def __init__(self, pattern: TilePattern, estimator: Estimator, noise: float):
        self.pattern, self.estimator, self._noise = pattern, estimator, noise
        self._whole = {1.0: estimator}
        self._behind: tuple[TilePattern, dict[float, Estimator]] = pattern, {}
        # Each candidate is one row of amplitudes, whatever is hidden: response = A L / noise.
        response = noise * estimator.candidates.response
        shown = solve_triangular(pattern.factor, response.T, lower=True, trans=1)
        self._amplitudes = np.asarray(shown.T, dtype=np.float64)

    def pattern_for(self, hidden: Mask) -> TilePattern:
        """Leave tiles (T,) out of the pattern.

        Raises
        ------
        ValueError
            If the others cannot tell the modes of the plate apart.
        """
        if not hidden.any():
            return self.pattern
        if not np.array_equal(hidden, self._behind[0].hidden):
            self._behind = self.pattern.hiding(hidden), {}
        return self._behind[0]

    def for_mask(self, hidden: Mask) -> tuple[TilePattern, Estimator]:
        """Leave tiles (T,) out of the pattern and of the estimator of its touches; see above."""
        return self.for_frame(hidden, 1.0)

    def for_frame(self, hidden: Mask, level: float) -> tuple[TilePattern, Estimator]:
        """Leave tiles (T,) out, for frames whose noise is a `level` of that of any motion."""
        pattern = self.pattern_for(hidden)
        kept = self._whole if pattern is self.pattern else self._behind[1]
        if level not in kept:
            kept[level] = self._estimator(pattern, level * self._noise)
        return pattern, kept[level]

    def _estimator(self, pattern: TilePattern, noise: float) -> Estimator:
        """Estimator of the touches of a pattern in frames of such a noise."""
        forward = pattern.forward(noise)
        response = self._amplitudes @ (pattern.factor / noise)
        grid = replace(self.estimator.candidates, forward=forward, response=response)
        return replace(self.estimator, forward=forward, grid=grid)


def unusable_reason(reference: TileReference, sums: TileSums, visible: Mask, hidden: float) -> str:
    """Say why touches cannot be estimated from a frame; empty where they can.

    Parameters
    ----------
    reference : TileReference
    sums : TileSums
    visible : (T,) bool
        Tiles that show the pattern.
    hidden : float
        Part of the pattern that does not show it.
    """
    if hidden > HIDDEN:
        return (
            f"{hidden:.0%} of the pattern is hidden; clear the view, focus the camera or put it"
            " back"
        )
    if contrast(sums, visible, reference.tiles.size) < DARK:
        return "the pattern is too faint to follow; look after the light"
    return ""


def contrast(sums: TileSums, visible: Mask, size: int) -> float:
    """Contrast of a frame over that of the reference: the gain of the light, by least squares.

    Parameters
    ----------
    sums : TileSums
    visible : (T,) bool
        Tiles that count.
    size : int, px
        Side of a tile.
    """
    pixels = np.count_nonzero(visible) * size**2
    ff, f = sums.light[visible, 4:].sum(axis=0)
    e, ef = sums.e[visible].sum(), sums.ef[visible].sum()
    return 1.0 + float((ef - f * e / pixels) / max(ff - f**2 / pixels, 1e-9))


def coarse_shift(reference: TileReference, image: AnyArray) -> F64:
    """Shift of a whole image against the reference, (2,) px, to some tenths of a pixel.

    By the phase of coarse images (Kuglin and Hines 1975), which a hand over a half of them does
    not mislead.
    """
    height, width = image.shape
    step = max(1, round(max(height, width) / COARSE))
    size = width // step, height // step
    before, after = (
        cv2.resize(np.asarray(one, np.float32), size, interpolation=cv2.INTER_AREA)
        for one in (reference.image, image)
    )
    window = cv2.createHanningWindow(size, cv2.CV_32F)
    (x, y), _ = cv2.phaseCorrelate(before, after, window)
    return np.array([x * width / size[0], y * height / size[1]])


def tile_shift(blocks: TileBlocks, sums: TileSums) -> F64:
    """Shift that the tiles of a frame have in common beyond their flow, (2,) px.

    The median of what each tile says, its light left out; a hand over less than a half of them
    does not mislead it.

    Parameters
    ----------
    blocks : TileBlocks
        Of one tile each.
    sums : TileSums
        Taken at a flow that is right to half a pixel or so.
    """
    left = (blocks.inverse @ tile_gradient(blocks, sums)[..., None])[..., 0]
    return np.asarray(np.median(left[blocks.status == Status.OK], axis=0), dtype=np.float64)
