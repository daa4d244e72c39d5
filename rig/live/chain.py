"""The live chain: all that is prepared for a reference, and what goes on from frame to frame."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import floor, log
from typing import TYPE_CHECKING

import numpy as np

from dic import (
    TileBlocks,
    TileReference,
    aliasing_left,
    gain_left,
    prepare_blocks,
    prepare_tiles,
    tile_prefilter,
)
from models import Estimator, ImageMotions, MotionErrors, TilePattern, prepare_pattern
from rig.live.baseline import ReferenceFrame
from rig.live.fixed_pattern import NO_FIXED_PATTERN, FixedPattern
from rig.live.focus import BlurTrace, blur_traces
from rig.live.illumination import without_gain_offset
from rig.live.known_bench import KnownBench
from rig.live.memory import Memory
from rig.live.noise_curve import tile_weights
from rig.live.plate_in_time import Past, PlateInTime
from rig.live.touch_start import TouchStart, prepare_start
from rig.live.visibility import MaskedModels
from rig.system.arrays import F64, Mask

if TYPE_CHECKING:
    import models

LEVELS = 0.5**0.25  # from one level of noise to the next: a search is a fifth too blunt at most


@dataclass(frozen=True, eq=False)
class Chain:
    """Everything that is prepared once for a reference.

    Attributes
    ----------
    reference : TileReference
    tiles : TileBlocks
        The same, each tile by itself.
    masked_models : MaskedModels
        Of the whole pattern and behind what hides a part of it.
    noise : float, grey levels
        By which the motion of tiles errs, see `TileReference.motion_noise`.
    pixel_noise : float, grey levels
        Of a frame less the reference.
    weight : (T,) float64
        Of the motion that each tile shows, by its own noise.
    blurs : tuple of BlurTrace
        What a camera out of focus would make of each tile.
    in_time : PlateInTime or None
        How the plate rings and creeps, where each frame is not taken as an equilibrium.
    start : TouchStart or None
        What proposes touches to a frame that follows none, in the place of a search.
    fixed_pattern : FixedPattern
        What is known of a pattern of the sensor before any frame.
    """

    reference: TileReference
    tiles: TileBlocks
    masked_models: MaskedModels
    noise: float
    pixel_noise: float
    weight: F64
    blurs: tuple[BlurTrace, ...]
    in_time: PlateInTime | None = None
    start: TouchStart | None = None
    fixed_pattern: FixedPattern = NO_FIXED_PATTERN

    @property
    def pattern(self) -> TilePattern:
        """The whole pattern as a measurement."""
        return self.masked_models.pattern

    def motion_errors(
        self, motion: F64, hidden: Mask, pixel_variance: float, level: float = 1.0
    ) -> MotionErrors:
        """Say what a frame of this motion (K + R,) errs by, the hidden tiles (T,) aside.

        By the noise of any motion, or that of a `level` of it; for the variance by pixels see
        `Registered`. A gain is that of presses as well, and Young's modulus of an inferred bench
        has it.
        """
        pixels = self._pixels * pixel_variance / level**2
        if not self.aliases:
            return MotionErrors(pixels)
        flow = self._flow(motion, hidden)
        gain = 0.0 if self.estimator.bench else self.reference.gain_error * gain_left(flow)
        aliased = (1.0 - self._pixels) * aliasing_left(flow)
        return MotionErrors(pixels, aliased / level**2, gain)

    def level(self, motion: F64, hidden: Mask, pixel_variance: float) -> float:
        """Noise by which a frame of this motion (K + R,) is searched, over that of any motion.

        Its own, up to the next of few levels, each of which has an estimator.
        """
        own = self._pixels * pixel_variance
        if self.aliases:
            own += (1.0 - self._pixels) * aliasing_left(self._flow(motion, hidden))
        return LEVELS ** floor(0.5 * log(own, LEVELS) + 1e-9)

    @property
    def aliases(self) -> bool:
        """Whether aliasing is a part of the noise."""
        return self.pixel_noise != self.noise

    @property
    def _pixels(self) -> float:
        """Part of the variance of any motion that pixels make."""
        return (self.pixel_noise / self.noise) ** 2

    def _flow(self, motion: F64, hidden: Mask) -> F64:
        """Motion (n, 2) px of the tiles that see the plate."""
        return self.pattern.motions.flow(motion)[self.pattern.motions.on_plate & ~hidden]

    @property
    def estimator(self) -> Estimator:
        """What finds touches in the whole pattern."""
        return self.masked_models.estimator


def prepare_chain(
    reference: ReferenceFrame,
    motions: ImageMotions,
    max_touches: int,
    known: KnownBench | None = None,
    in_time: PlateInTime | None = None,
    net: models.TouchNet | None = None,
    prefilter: float | None = None,
    friction: float = 0.0,
) -> Chain:
    """Prepare the chain for a reference, on a bench of which so much is known.

    A prefilter, px, is chosen where none is given; for the friction of touches see
    `models.Estimator`.
    """
    image, size = reference.image, motions.tiles.size
    given = tile_prefilter(image, size, reference.noise) if prefilter is None else prefilter
    tile_reference = prepare_tiles(image, size, given, reference.own_noise)
    noise = tile_reference.motion_noise(reference.noise, motions.on_plate)
    tiles = prepare_blocks(tile_reference, 1)
    aliased = noise**2 - reference.noise**2
    curve = None if reference.curve is None else reference.curve + aliased
    weight = tile_weights(image, noise, curve, motions.tiles)
    without_light = without_gain_offset(tiles, weight)
    pattern = prepare_pattern(motions, without_light)
    if known is not None:
        pattern = known.seen(pattern)
    bench = None if known is None else known.estimate
    forward = pattern.forward(noise)
    estimator = Estimator(forward, max_touches=max_touches, bench=bench, friction=friction)
    start = None if net is None else prepare_start(net, estimator)
    masked = MaskedModels(pattern, estimator, noise)
    blurs, own = blur_traces(tiles, without_light, weight), reference.noise
    fixed = NO_FIXED_PATTERN if bench is None else FixedPattern.of(*bench.fixed_pattern)
    return Chain(tile_reference, tiles, masked, noise, own, weight, blurs, in_time, start, fixed)


@dataclass(frozen=True, eq=False)
class ChainState:
    """What the next frame starts from.

    Attributes
    ----------
    motion : (K + R,) float64
        Amplitudes of the plate's modes and of the camera's rigid motions.
    rest : (K,) float64
        Those of the modes while nothing touches: what the plate has crept to since the reference.
    touches : (n, 3) float64, mm, mm, N
        x, y, F.
    from_strain : (n, 3) float64, mm, mm, N
        Those that strain alone shows.
    memory : Memory
        Touches that ended; empty where the bench is exact.
    past : Past
        How the plate rings and what it has crept to, where that is followed.
    fixed_pattern : FixedPattern
        What frames have shown of a pattern of the sensor.
    """

    motion: F64
    rest: F64
    touches: F64
    from_strain: F64
    memory: Memory = field(default_factory=Memory)
    past: Past = field(default_factory=Past)
    fixed_pattern: FixedPattern = NO_FIXED_PATTERN


def at_rest(chain: Chain) -> ChainState:
    """Nothing moved and nothing touches."""
    none = np.empty((0, 3))
    return ChainState(
        chain.pattern.still(),
        np.zeros(chain.pattern.count),
        none,
        none,
        fixed_pattern=chain.fixed_pattern,
    )
