"""The plate at rest when the loop starts, and its slow drift while nothing touches it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import exp, sqrt

import numpy as np
from scipy.linalg import solve_triangular

from dic import lay_tiles
from models import Estimate, TilePattern
from rig.live.noise_curve import noise_curve
from rig.system.arrays import F32, F64, AnyArray

MIN_NOISE = 0.05  # grey levels: less than the rounding of an 8-bit image
TILE = 16  # px, side of the tiles in which motion is looked for while the reference is taken
MOVED = 2.0  # of a tile's own noise, which alone stays below 1.6 in 4000 tiles of 16 × 16 px
ROUNDING = 1 / 12  # grey levels²: variance of whole grey levels, where a tile shows less noise
DRIFT_TIME = 10.0  # s in which a drift is followed to 63 %; a finger lands in a fraction of one
MISFIT_RATE = 1 / (1000 * 3600 * 30)
"""Fraction of frames that noise alone may make a misfit: one in 1000 hours at 30 a second."""


@dataclass(frozen=True, eq=False)
class ReferenceFrame:
    """The plate at rest: the mean of several frames, and the noise of a frame against it.

    Attributes
    ----------
    image : (H, W) float32
    noise : float, grey levels
    curve : (17,) float64, grey levels², optional
        Its variance by grey level, see `noise_curve`; None where it counts as the same everywhere.
    frames : int
        Of which the image is the mean; 0 where that is not known.
    """

    image: F32
    noise: float
    curve: F64 | None = None
    frames: int = 0

    @property
    def own_noise(self) -> float | None:
        """Noise of the image itself, σ/√N, grey levels; None where it is not known."""
        return self.noise / sqrt(self.frames + 1) if self.frames else None


def average_reference(frames: Sequence[AnyArray]) -> ReferenceFrame:
    """Average frames of the untouched plate, two or more, and measure their noise.

    The noise is that of a frame less the mean of N others, σ √(1 + 1/N), grey levels: over the
    whole image, and by grey level. A lamp that flickers is none of it: motion is read without the
    light of each tile.

    Raises
    ------
    ValueError
        If there are fewer than two frames.
    """
    if len(frames) < 2:
        raise ValueError(
            f"reference needs 2 frames or more to know their noise, got {len(frames)}; set"
            " dic.reference_frames to 16"
        )
    mean = np.asarray(np.mean(frames, axis=0), dtype=np.float32)
    count = len(frames)
    squares = np.zeros_like(mean)
    for frame in frames:
        squares += np.square(_steady(frame - mean, mean))
    squares *= 1 + 1 / count
    variance = float(squares.mean(dtype=np.float64)) / (count - 1)
    noise = max(float(np.sqrt(variance)), MIN_NOISE)
    curve = noise_curve(mean, squares, count - 1, MIN_NOISE**2)
    return ReferenceFrame(mean, noise, curve, count)


def still_reference(frames: Sequence[AnyArray]) -> ReferenceFrame:
    """Average the first frames of images that were kept, in which nothing may move.

    Raises
    ------
    ValueError
        If something moves in them, or there are fewer than two.
    """
    reference = average_reference(frames)
    if moved_during_reference(frames):
        raise ValueError(
            f"something moves in the first {len(frames)} images, which show the plate untouched"
            " (dic.reference_frames); leave out what comes before it is at rest"
        )
    return reference


def moved_during_reference(frames: Sequence[AnyArray]) -> bool:
    """Whether something moved in the image while frames were taken: a hand, a settling plate.

    The means of the first and the second half differ by noise alone where nothing moves; a tile
    that differs by more than `MOVED` times its own noise, that of one frame against the next, shows
    something that moved. Bright tiles may be noisier than dark ones.
    """
    half = len(frames) // 2
    early, late = (np.mean(part, axis=0) for part in (frames[:half], frames[-half:]))
    light = 0.5 * (early + late)
    change = _squares(late - early, light)
    steps = [
        _squares(np.subtract(after, before, dtype=np.float64), light)
        for before, after in pairwise(frames)
    ]
    noise = np.maximum(np.mean(steps, axis=0) / 2, ROUNDING * TILE**2)
    return bool((change > MOVED * noise * 2 / half).any())


def _squares(change: F64, light: F64) -> F64:
    """Sum the squares of a change over each tile, (T,), without what a lamp that flickers does."""
    steady = _steady(change, light)
    return np.asarray(lay_tiles(steady.shape, TILE).sums(np.square(steady)), dtype=np.float64)


def _steady(change: AnyArray, light: AnyArray) -> AnyArray:
    """Take a gain and an offset of the whole image out of a change of it."""
    shade = light - light.mean()
    gain = float((shade * change).sum()) / max(float((shade**2).sum()), 1e-9)
    steady: AnyArray = change - change.mean() - gain * shade
    return steady


def is_consistent(estimate: Estimate) -> bool:
    """Whether touches explain the frame; not if something is in the way or the camera jumped."""
    return estimate.p_value >= MISFIT_RATE


def drift_weight(seconds: float) -> float:
    """Weight of a frame that comes `seconds` after the last in a mean over `DRIFT_TIME` s."""
    return 1.0 - exp(-max(seconds, 0.0) / DRIFT_TIME)


def update_drift(
    rest: F64, pattern: TilePattern, measured: F64, noise: float, weight: float
) -> F64:
    """Take a part of what an untouched plate shows as its new state of rest.

    Parameters
    ----------
    rest : (K,) float64
        Amplitudes of the plate's modes at rest so far.
    pattern : TilePattern
        With the Cholesky factor L of the modes' normal matrix.
    measured : (K,) float64
        Whitened numbers of a frame without touches, less those of `rest`: Lᵀ q / noise.
    noise : float, grey levels
    weight : float
        Part that is taken, from `drift_weight`.
    """
    shown = solve_triangular(pattern.factor, measured, lower=True, trans=1, check_finite=False)
    return rest + weight * noise * shown
