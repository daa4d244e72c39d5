"""The reference moved to where a frame shows it."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import sqrt

import numpy as np

from dic import TileSums, tile_sums
from models import TileFit, TilePattern, fit_tiles
from rig.live.chain import Chain
from rig.live.fixed_pattern import NO_FIXED_PATTERN, FixedPattern, fixed_pattern
from rig.live.focus import FoundBlur, find_blur
from rig.live.illumination import (
    contrast_loss,
    sums_without_gain_offset,
    variance_by_contrast,
)
from rig.live.visibility import coarse_shift, tile_shift, unusable_reason
from rig.system.arrays import F64, AnyArray, Mask
from rig.system.timing import Stopwatch

MAX_OFF = 0.1  # px: a reference that was moved wrongly by more is moved again within the frame
MISSED = (
    0.003  # px that an iteration may miss in the shade: the trace of 0.05 N that are there no more
)
UNLIKE = 1.05  # of the variance by pixels, below which a frame counts as one like the reference
MARGIN = (
    1.3  # of what a blur leaves unexplained: that of a lens, a disc, leaves more than a normal one
)
MAX_ITERATIONS = 12  # at most so often; two are usual, a press on a free edge takes eight


@dataclass(frozen=True, eq=False)
class Registered:
    """A frame against the reference, moved to where the frame shows it.

    Attributes
    ----------
    sums : TileSums
    hidden : (T,) bool
        Tiles that do not show the pattern, of those that see the plate.
    hidden_fraction : float
        Their part of these.
    unusable_reason : str
        Why the frame says nothing, as a sentence for the user; empty where it does.
    pattern : TilePattern
        Without the hidden tiles.
    right : (K + R + 2,) float64
        See `TilePattern.gradient`.
    motion : (K + R,) float64
        Amplitudes that the frame shows, whatever moved it.
    off : float, px
        By which the last pass moved the reference on at most; 0 where the frame says nothing.
    contrast : (V,) float64
        Of the visible tiles over that of the reference.
    blur : FoundBlur or None
        Of the frame since the reference; None where the frame says nothing.
    noise : float, grey levels
        Of a pixel of the frame less the reference, the blur aside.
    fit : TileFit or None
        Of the tiles; None where the frame says nothing.
    """

    sums: TileSums
    hidden: Mask
    hidden_fraction: float
    unusable_reason: str
    pattern: TilePattern
    right: F64
    motion: F64
    off: float = 0.0
    contrast: F64 = field(default_factory=lambda: np.empty(0))
    blur: FoundBlur | None = None
    noise: float = 0.0
    fit: TileFit | None = None

    @property
    def slopes_left(self) -> float:
        """What a blur leaves of slopes, over what it leaves of contrast."""
        return self.blur.slopes_left if self.blur else 1.0

    @property
    def blur_width(self) -> float:
        """Blur of the frame since the reference, px, see `FoundBlur.width`."""
        return self.blur.width if self.blur else 0.0

    @property
    def missed(self) -> float:
        """Fraction of what the last pass found that it may have missed."""
        return max(contrast_loss(self.contrast), abs(1.0 - self.slopes_left))

    def pixel_variance(self, usual: float) -> float:
        """Variance that pixels make of the motion, over that of a frame like the reference.

        Most are like it, and have 1.

        Parameters
        ----------
        usual : float, grey levels
            Noise of these.
        """
        noise = max(self.noise / usual, 1.0)
        variance = noise**2 * variance_by_contrast(self.contrast) / self.slopes_left**2
        return variance if variance > UNLIKE else 1.0

    @property
    def settled(self) -> bool:
        """Whether the reference lies where the frame shows it."""
        return self.off <= MAX_OFF


def register(
    chain: Chain,
    image: AnyArray,
    moved: F64,
    watch: Stopwatch,
    fixed: FixedPattern | None = None,
) -> Registered:
    """Move the reference by `moved` (K + R,), and on until it lies where the frame shows it.

    A pattern of the sensor is taken out, as far as it is known: by the chain, or more by now.
    """
    fixed = chain.fixed_pattern if fixed is None else fixed
    seen = _compared(chain, image, moved, watch, fixed)
    for _ in range(MAX_ITERATIONS - 1):
        if seen.unusable_reason or (seen.settled and seen.off * seen.missed <= MISSED):
            break
        seen = _compared(chain, image, seen.motion, watch, fixed)
    return seen


def _compared(
    chain: Chain, image: AnyArray, moved: F64, watch: Stopwatch, fixed: FixedPattern
) -> Registered:
    """Compare a frame with the reference moved by `moved` (K + R,)."""
    with watch.stage("correlate"):
        flow, flow_gradient = chain.pattern.motions.flow_and_gradient(moved)
        sums = tile_sums(chain.reference, image, flow, flow_gradient)
        sums = fixed.taken_out(chain.reference, sums)
    with watch.stage("mask"):
        on_plate, pattern = chain.pattern.motions.on_plate, chain.pattern
        fit = fit_tiles(chain.reference, sums)
        hidden = fit.hidden(chain.pixel_noise) & on_plate
        fraction = np.count_nonzero(hidden) / np.count_nonzero(on_plate)
        why = unusable_reason(chain.reference, sums, on_plate & ~hidden, fraction)
        if not why:
            try:
                pattern = chain.masked_models.pattern_for(hidden)
            except ValueError as error:  # too few tiles for so many fields
                why = str(error)
        if why:
            return Registered(sums, hidden, fraction, why, chain.pattern, np.empty(0), moved)
        visible = on_plate & ~hidden
        contrast = fit.contrast
        without_light = sums_without_gain_offset(chain.tiles, sums, chain.weight, contrast)
        noise = fit.noise(visible)
        blur = find_blur(chain.blurs, without_light, visible, max(noise, chain.noise))
        right = pattern.gradient(blur.taken_out(without_light), moved)
        motion = pattern.motion(right)
        off = chain.pattern.motions.max_motion(motion - moved)
        left = sqrt(max(noise**2 - MARGIN * blur.unexplained**2, 0.0))
        seen = contrast[visible]
        return Registered(
            sums, hidden, fraction, "", pattern, right, motion, off, seen, blur, left, fit
        )


def shown_fixed_pattern(chain: Chain, seen: Registered) -> FixedPattern:
    """Find what a frame shows of a pattern of the sensor."""
    if seen.fit is None:
        return NO_FIXED_PATTERN
    visible = chain.pattern.motions.on_plate & ~seen.hidden
    return fixed_pattern(chain.reference, seen.sums, seen.fit, visible)


def jumped(chain: Chain, image: AnyArray, moved: F64, watch: Stopwatch) -> F64:
    """Give the motion (K + R,) with the camera where its jump has brought it, to 0.15 px.

    The shift of coarse images leaves some tenths, by which tiles of a sharp image look strange
    already; half of them at least say what is left.
    """
    shifted = moved.copy()
    shift = shifted[chain.pattern.count :][:2]
    with watch.stage("jump"):
        shift[:] = coarse_shift(chain.reference, image)
        sums = tile_sums(chain.reference, image, chain.pattern.motions.flow(shifted))
        shift += tile_shift(chain.tiles, sums)
    return shifted


def strangeness(seen: Registered) -> tuple[bool, float, float]:
    """How little a frame shows where the reference was moved to: the less the better.

    Of two that show as much that is better which lies nearer to where the frame shows it.
    """
    return bool(seen.unusable_reason), seen.hidden_fraction, seen.off
