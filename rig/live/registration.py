"""The reference moved to where a frame shows it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dic import TileSums, tile_sums
from models import TilePattern, frame_noise, hidden_tiles
from rig.live.chain import Chain
from rig.live.focus import find_blur
from rig.live.illumination import contrast_loss, shaded, sums_without_gain_offset
from rig.live.visibility import coarse_shift, tile_shift, unusable_reason
from rig.system.arrays import F64, AnyArray, Mask
from rig.system.timing import Stopwatch

MAX_OFF = 0.1  # px: a reference that was moved wrongly by more is moved again within the frame
MISSED = (
    0.003  # px that an iteration may miss in the shade: the trace of 0.05 N that are there no more
)
FAINT = 1.05  # of the variance by pixels, below which a frame is as clear as the reference
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
    faint : float
        Variance that pixels make of the motion, over that of a frame as clear and quiet as the
        reference, as most are: 1.
    blur : float, px
        Of the frame since the reference, standard deviation, see `FoundBlur.width`.
    missed : float
        Of what the last pass found, it may have missed this fraction.
    """

    sums: TileSums
    hidden: Mask
    hidden_fraction: float
    unusable_reason: str
    pattern: TilePattern
    right: F64
    motion: F64
    off: float = 0.0
    faint: float = 1.0
    blur: float = 0.0
    missed: float = 0.0

    @property
    def settled(self) -> bool:
        """Whether the reference lies where the frame shows it."""
        return self.off <= MAX_OFF


def register(chain: Chain, image: AnyArray, moved: F64, watch: Stopwatch) -> Registered:
    """Move the reference by `moved` (K + R,), and on until it lies where the frame shows it."""
    seen = _compared(chain, image, moved, watch)
    for _ in range(MAX_ITERATIONS - 1):
        if seen.unusable_reason or (seen.settled and seen.off * seen.missed <= MISSED):
            break
        seen = _compared(chain, image, seen.motion, watch)
    return seen


def _compared(chain: Chain, image: AnyArray, moved: F64, watch: Stopwatch) -> Registered:
    """Compare a frame with the reference moved by `moved` (K + R,)."""
    with watch.stage("correlate"):
        flow, flow_gradient = chain.pattern.motions.flow_and_gradient(moved)
        sums = tile_sums(chain.reference, image, flow, flow_gradient)
    with watch.stage("mask"):
        on_plate, pattern = chain.pattern.motions.on_plate, chain.pattern
        hidden = hidden_tiles(chain.reference, sums, chain.pixel_noise) & on_plate
        fraction = np.count_nonzero(hidden) / np.count_nonzero(on_plate)
        why = unusable_reason(chain.reference, sums, on_plate & ~hidden, fraction)
        if not why:
            try:
                pattern = chain.masked_models.pattern_for(hidden)
            except ValueError as error:  # too few tiles for so many fields
                why = str(error)
        if why:
            return Registered(sums, hidden, fraction, why, chain.pattern, np.empty(0), moved)
        without_light = sums_without_gain_offset(chain.tiles, sums, chain.weight)
        visible = on_plate & ~hidden
        blur = find_blur(chain.blurs, without_light, visible, chain.noise)
        sharp, left, width = without_light, 1.0, 0.0
        if blur is not None:
            sharp, left, width = blur.taken_out(without_light), blur.slopes_left, blur.width
        faint = shaded(chain.reference, sums, visible) / left**2
        if blur is None:  # which leaves more unexplained than noise does
            noisier = frame_noise(chain.reference, sums, visible) / chain.noise
            faint *= max(noisier, 1.0) ** 2
        faint = faint if faint > FAINT else 1.0
        missed = max(contrast_loss(chain.reference, sums, visible), abs(1.0 - left))
        right = pattern.gradient(sharp, moved)
        motion = pattern.motion(right)
        off = chain.pattern.motions.max_motion(motion - moved)
        return Registered(
            sums, hidden, fraction, "", pattern, right, motion, off, faint, width, missed
        )


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
