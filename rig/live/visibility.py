"""What of the pattern is in sight: behind a hand, in the dark, after a jump of the camera."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular

from dic import TileReference, TileSums
from models import CandidateGrid, TilePattern

HIDDEN = 0.75  # of the tiles, beyond which the others say too little
DARK = 0.3  # of the contrast of the reference, below which there is no pattern to follow
DARKEST = 0.05  # of the tiles in sight; fewer say nothing against the others
FLAT = 0.1  # of the usual texture, below which the gain of a tile is not known
COARSE = 512  # px, longer side of the pictures in which a jump is looked for: right to 0.2 px


class MaskedModels:
    """Forward model and candidates for the tiles in sight; those for the last mask are kept.

    What hides a part of the pattern mostly stays there for many frames.

    Attributes
    ----------
    pattern : TilePattern
        The whole pattern.
    search : CandidateGrid
        Its candidates.
    """

    def __init__(self, pattern: TilePattern, search: CandidateGrid, noise: float):
        self.pattern, self.search, self._noise = pattern, search, noise
        self._last = pattern, search
        # Each candidate is one row of amplitudes, whatever is hidden: response = A L / noise.
        shown = solve_triangular(pattern.factor, noise * search.response.T, lower=True, trans=1)
        self._amplitudes = np.asarray(shown.T, dtype=np.float64)

    def behind(self, hidden: NDArray[np.bool_]) -> tuple[TilePattern, CandidateGrid]:
        """Leave out tiles (T,).

        Raises
        ------
        ValueError
            If the others cannot tell the modes of the plate apart.
        """
        if not hidden.any():
            return self.pattern, self.search
        if not np.array_equal(hidden, self._last[0].hidden):
            pattern = self.pattern.hiding(hidden)
            forward = pattern.forward(self._noise)
            response = self._amplitudes @ (pattern.factor / self._noise)
            self._last = pattern, replace(self.search, forward=forward, response=response)
        return self._last


def unusable_reason(reference: TileReference, sums: TileSums, hidden: NDArray[np.bool_]) -> str:
    """Say why touches cannot be told from a frame; empty where they can.

    Parameters
    ----------
    reference : TileReference
    sums : TileSums
    hidden : (T,) bool
        Tiles that do not show the pattern.
    """
    share = float(np.mean(hidden))
    if share > HIDDEN:
        return f"{share:.0%} of the pattern is hidden; clear the view or put the camera back"
    if contrast(sums, ~hidden, reference.tiles.size) < DARK:
        return "the pattern is too faint to follow; look after the light"
    return ""


def contrast_loss(reference: TileReference, sums: TileSums, hidden: NDArray[np.bool_]) -> float:
    """Share of a motion that one pass misses in the shade.

    A frame whose contrast is lower by a factor shows a motion that is smaller by it; what is left
    comes with the next pass, to which the reference is moved. That of the darkest tiles is given.
    """
    pixels = reference.tiles.size**2
    ff, f = sums.light[:, 4:].T
    texture = ff - f**2 / pixels
    clear = ~hidden & (texture > FLAT * np.median(texture))
    gains = 1.0 + (sums.ef - f * sums.e / pixels)[clear] / texture[clear]
    return float(1.0 - np.quantile(gains, DARKEST)) if clear.any() else 0.0


def contrast(sums: TileSums, sight: NDArray[np.bool_], size: int) -> float:
    """Contrast of a frame over that of the reference: the gain of the light, by least squares.

    Parameters
    ----------
    sums : TileSums
    sight : (T,) bool
        Tiles that count.
    size : int, px
        Side of a tile.
    """
    pixels = np.count_nonzero(sight) * size**2
    ff, f = sums.light[sight, 4:].sum(axis=0)
    e, ef = sums.e[sight].sum(), sums.ef[sight].sum()
    return 1.0 + float((ef - f * e / pixels) / max(ff - f**2 / pixels, 1e-9))


def coarse_shift(reference: TileReference, image: NDArray) -> NDArray[np.float64]:
    """Shift of a whole picture against the reference, (2,) px, to some tenths of a pixel.

    By the phase of coarse pictures (Kuglin and Hines 1975), which a hand over a half of them does
    not mislead.
    """
    height, width = image.shape
    step = max(1, round(max(height, width) / COARSE))
    size = width // step, height // step
    before, after = (
        cv2.resize(np.asarray(picture, np.float32), size, interpolation=cv2.INTER_AREA)
        for picture in (reference.image, image)
    )
    window = cv2.createHanningWindow(size, cv2.CV_32F)
    (x, y), _ = cv2.phaseCorrelate(before, after, window)
    return np.array([x * width / size[0], y * height / size[1]])
