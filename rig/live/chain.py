"""The live chain: from a frame to touches, starting from what the last frame said."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

import synthetic
from dic import (
    TileBlocks,
    TileReference,
    TileSums,
    prepare_blocks,
    prepare_tiles,
    tile_displacement,
    tile_sums,
)
from models import (
    Estimate,
    Estimator,
    ImageMotions,
    Result,
    StrainMap,
    TilePattern,
    hidden_tiles,
    prepare_pattern,
    prepare_strain_map,
)
from rig.live.alignment import Alignment
from rig.live.baseline import ReferenceFrame, is_consistent, update_drift
from rig.live.illumination import sums_without_gain_offset, without_gain_offset
from rig.live.known_bench import KnownBench
from rig.live.memory import Memory
from rig.live.plate_in_time import MeasuredFrame, Past, PlateInTime
from rig.live.visibility import (
    MaskedModels,
    coarse_shift,
    contrast_loss,
    tile_shift,
    unusable_reason,
)
from rig.system.arrays import F64, AnyArray, Mask
from rig.system.timing import Stopwatch

MAX_OFF = 0.1  # px: a reference that was moved wrongly by more is moved again within the frame
MISSED = (
    0.003  # px that an iteration may miss in the shade: the trace of 0.05 N that are there no more
)
MAX_ITERATIONS = 6  # at most so often; two are usual where something moves
STRANGE = 0.2  # of the tiles: where more look strange, the camera may have jumped
NO_ESTIMATE = Estimate(
    np.empty((0, 2)), np.empty(0), np.empty((0, 0)), 0.0, 1, 1.0, Result.NO_TOUCH
)
"""The estimate of a frame in which nothing can be seen."""


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
    in_time : PlateInTime or None
        How the plate rings and creeps, where each frame is not taken as an equilibrium.
    """

    reference: TileReference
    tiles: TileBlocks
    masked_models: MaskedModels
    noise: float
    in_time: PlateInTime | None = None

    @property
    def pattern(self) -> TilePattern:
        """The whole pattern as a measurement."""
        return self.masked_models.pattern

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
) -> Chain:
    """Prepare the chain for a reference, on a bench of which so much is known."""
    tile_reference, noise = prepare_tiles(reference.image, motions.tiles.size), reference.noise
    tiles = prepare_blocks(tile_reference, 1)
    pattern = prepare_pattern(motions, without_gain_offset(tiles))
    if known is not None:
        pattern = known.seen(pattern)
    bench = None if known is None else known.estimate
    estimator = Estimator(pattern.forward(noise), max_touches=max_touches, bench=bench)
    return Chain(tile_reference, tiles, MaskedModels(pattern, estimator, noise), noise, in_time)


@dataclass(frozen=True, eq=False)
class StrainChain:
    """What estimates touches from the strain map of the same frames, and draws that map."""

    blocks: TileBlocks
    map: StrainMap
    estimator: Estimator
    noise: float


def prepare_strain(
    chain: Chain, camera: synthetic.AnyCamera, block: int, window: int
) -> StrainChain:
    """Prepare strain over blocks of `block` tiles and windows of `window` blocks a side."""
    blocks = prepare_blocks(chain.reference, block)
    strain_map = prepare_strain_map(chain.pattern, blocks, camera, window)
    return strain_of(StrainChain(blocks, strain_map, chain.estimator, chain.noise), chain)


def strain_of(strain: StrainChain, chain: Chain) -> StrainChain:
    """Estimate touches from strain on the bench on which a chain stands."""
    large, factor = chain.pattern.motions.large, strain.map.factor / chain.noise
    forward = large.forward(factor) if large else strain.map.forward(chain.noise)
    return replace(strain, estimator=replace(chain.estimator, forward=forward))


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
    """

    motion: F64
    rest: F64
    touches: F64
    from_strain: F64
    memory: Memory = field(default_factory=Memory)
    past: Past = field(default_factory=Past)


def at_rest(chain: Chain) -> ChainState:
    """Nothing moved and nothing touches."""
    none = np.empty((0, 3))
    return ChainState(chain.pattern.still(), np.zeros(chain.pattern.count), none, none)


@dataclass(frozen=True, eq=False)
class FrameEstimate:
    """What one frame says.

    Attributes
    ----------
    estimate : Estimate
        From the whole pattern.
    sums : TileSums
        Of the last pass, for displacement and strain of the same frame.
    hidden : (T,) bool
        Tiles that do not show the pattern, behind a hand for instance.
    unusable_reason : str
        Why no touch can be estimated, as a sentence for the user; empty where it can.
    state : ChainState
        To start the next frame from.
    strain : (T, 3) float64, or None where the scene wants none
    from_strain : Estimate or None
        None where a part of the strain map is lost in this frame, by a hand for instance.
    from_pattern : Estimate or None
        Of the whole pattern, where a net estimates the touches.
    measured : (m,) float64 or None
        The frame in units of its noise, as touches explain it; None where none can be estimated.
    """

    estimate: Estimate
    sums: TileSums
    hidden: Mask
    unusable_reason: str
    state: ChainState
    strain: F64 | None = None
    from_strain: Estimate | None = None
    from_pattern: Estimate | None = None
    measured: F64 | None = None


@dataclass(frozen=True, eq=False)
class Registered:
    """A frame against the reference, moved to where the frame shows it.

    Attributes
    ----------
    sums : TileSums
    hidden : (T,) bool
        Tiles that do not show the pattern.
    unusable_reason : str
        Why the frame says nothing, as a sentence for the user; empty where it does.
    pattern : TilePattern
        Without the hidden tiles.
    right : (K + R + 2,) float64
        See `TilePattern.gradient`.
    motion : (K + R,) float64
        Amplitudes that the frame shows, whatever moved it.
    """

    sums: TileSums
    hidden: Mask
    unusable_reason: str
    pattern: TilePattern
    right: F64
    motion: F64


def estimate_frame(
    chain: Chain,
    image: AnyArray,
    state: ChainState,
    watch: Stopwatch,
    drift: float = 0.0,
    time: float | None = None,
) -> FrameEstimate:
    """Find the touches in one frame.

    The reference is moved to where the frame shows it, again where the first guess was off; then
    the touches are found that explain how. Where much looks strange and the rest fits no touch the
    camera may have jumped, and the guess in which less looks strange counts.

    Parameters
    ----------
    drift : float
        Weight of what the frame shows in the state of rest if nothing touches, from
        `drift_weight`; 0 leaves it as it is.
    time : float, s, optional
        When the frame was complete; without it the plate is taken as one at equilibrium.
    """
    seen = register(chain, image, state.motion, watch)
    found = _estimated(chain, seen, state, watch, drift, time)
    if not found.unusable_reason and (
        found.hidden.mean() <= STRANGE or is_consistent(found.estimate)
    ):
        return found
    other = register(chain, image, jumped(chain, image, state.motion, watch), watch)
    if strangeness(other) < strangeness(seen):
        return _estimated(chain, other, state, watch, drift, time)
    return found


def register(chain: Chain, image: AnyArray, moved: F64, watch: Stopwatch) -> Registered:
    """Move the reference by `moved` (K + R,), and on until it lies where the frame shows it."""
    seen = _compared(chain, image, moved, watch)
    for _ in range(MAX_ITERATIONS - 1):
        off = chain.pattern.motions.max_motion(seen.motion - moved)
        if seen.unusable_reason or (off <= MAX_OFF and off * _miss(chain, seen) <= MISSED):
            break
        moved = seen.motion
        seen = _compared(chain, image, moved, watch)
    return seen


def _compared(chain: Chain, image: AnyArray, moved: F64, watch: Stopwatch) -> Registered:
    """Compare a frame with the reference moved by `moved` (K + R,)."""
    with watch.stage("correlate"):
        sums = tile_sums(chain.reference, image, chain.pattern.motions.flow(moved))
    with watch.stage("mask"):
        hidden = hidden_tiles(chain.reference, sums, chain.noise)
        why, pattern = unusable_reason(chain.reference, sums, hidden), chain.pattern
        if not why:
            try:
                pattern = chain.masked_models.pattern_for(hidden)
            except ValueError as error:  # too few tiles for so many fields
                why = str(error)
        if why:
            return Registered(sums, hidden, why, chain.pattern, np.empty(0), moved)
        right = pattern.gradient(sums_without_gain_offset(chain.tiles, sums), moved)
        return Registered(sums, hidden, "", pattern, right, pattern.motion(right))


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


def _miss(chain: Chain, seen: Registered) -> float:
    """Give what an iteration has missed as a fraction of what it found."""
    lost = min(contrast_loss(chain.reference, seen.sums, seen.hidden), 0.9)
    return abs(lost) / (1.0 - lost)


def strangeness(seen: Registered) -> tuple[bool, float]:
    """How little a frame shows where the reference was moved to: the less the better."""
    return bool(seen.unusable_reason), float(seen.hidden.mean())


def _estimated(
    chain: Chain,
    seen: Registered,
    state: ChainState,
    watch: Stopwatch,
    drift: float,
    time: float | None,
) -> FrameEstimate:
    """Find the touches that explain a frame."""
    if seen.unusable_reason:
        none = replace(state, touches=np.empty((0, 3)))
        return FrameEstimate(NO_ESTIMATE, seen.sums, seen.hidden, seen.unusable_reason, none)
    if chain.in_time is not None and time is not None:
        return _in_time(chain, chain.in_time, seen, state, watch, drift, time)
    with watch.stage("estimate"):
        pattern, estimator = chain.masked_models.for_mask(seen.hidden)
        rest = state.rest
        right = seen.right - pattern.normal[:, : len(rest)] @ rest
        measured = pattern.whiten(right, chain.noise)
        estimate, memory = _fitted(estimator, measured, state)
        motion = pattern.amplitudes(estimate, right)
        motion[: len(rest)] += rest
        if drift and not estimate.count and not seen.hidden.any() and is_consistent(estimate):
            crept = estimator.without_memory(measured, memory.left)
            rest = update_drift(rest, pattern, crept, chain.noise, drift)
    after = replace(state, motion=motion, rest=rest, touches=_places(estimate), memory=memory)
    return FrameEstimate(estimate, seen.sums, seen.hidden, "", after, measured=measured)


def _in_time(
    chain: Chain,
    plate: PlateInTime,
    seen: Registered,
    state: ChainState,
    watch: Stopwatch,
    drift: float,
    time: float,
) -> FrameEstimate:
    """Find the touches that explain a frame of a plate that rings and creeps."""
    with watch.stage("estimate"):
        pattern, estimator = chain.masked_models.for_mask(seen.hidden)
        rest = state.rest
        right = seen.right - pattern.normal[:, : len(rest)] @ rest
        measured = pattern.whiten(right, chain.noise)
        frame = MeasuredFrame(measured, pattern.factor, chain.noise, time)
        found = plate.estimate(estimator, frame, state.touches, state.past)
        modal = pattern.motions.modal_amplitudes(found.estimate.xy, found.estimate.force)
        motion = pattern.with_camera(modal + found.beside, right)
        motion[: len(rest)] += rest
        if drift and found.left is not None and not seen.hidden.any():
            rest = update_drift(rest, pattern, found.left, chain.noise, drift)
    touches = _places(found.estimate)
    after = replace(state, motion=motion, rest=rest, touches=touches, past=found.past)
    return FrameEstimate(found.estimate, seen.sums, seen.hidden, "", after)


def _fitted(estimator: Estimator, measured: F64, state: ChainState) -> tuple[Estimate, Memory]:
    """Find touches; again where one has ended, since the plate may still show a part of it.

    The memory is that of the frame before, however often this one is looked at.
    """
    before = state.memory
    if estimator.bench is None:
        return estimator.fit_whitened(measured, state.touches), before
    left = before.after(state.touches).left
    estimate = estimator.fit_whitened(measured, state.touches, left=left)
    memory = before.after(_places(estimate))
    if not np.array_equal(memory.left, left):
        estimate = estimator.fit_whitened(measured, memory.held, left=memory.left)
        memory = before.after(_places(estimate))
    return estimate, memory


def sense_strain(
    chain: StrainChain, sums: TileSums, state: ChainState, watch: Stopwatch
) -> tuple[F64, Estimate | None]:
    """Strain of one frame, (T, 3), and the touches that it shows beyond the plate at rest.

    The touches are None where a part of the map is lost in this frame, by a hand for instance.
    """
    with watch.stage("strain"):
        field = tile_displacement(chain.blocks, sums, chain.noise)
        strain = chain.map.strain(field)
    with watch.stage("from strain"):
        measured = chain.map.whiten(strain, chain.noise)
        if measured is None:
            return strain, None
        measured -= state.rest @ chain.map.factor / chain.noise
        return strain, chain.estimator.fit_whitened(measured, state.from_strain)


def with_strain(
    strain_chain: StrainChain | None,
    frame_estimate: FrameEstimate,
    watch: Stopwatch,
    alignment: Alignment | None = None,
) -> FrameEstimate:
    """Add what strain says, where it is wanted, to the estimate of a frame, and correct it all.

    The state stays as it was found: the next frame starts from what this one shows.
    """
    if strain_chain is None:
        return _aligned(frame_estimate, alignment)
    strain, found = sense_strain(strain_chain, frame_estimate.sums, frame_estimate.state, watch)
    if frame_estimate.unusable_reason:
        found = None
    start = np.empty((0, 3)) if found is None else _places(found)
    after = replace(frame_estimate.state, from_strain=start)
    whole = replace(frame_estimate, strain=strain, from_strain=found, state=after)
    return _aligned(whole, alignment)


def _aligned(frame_estimate: FrameEstimate, alignment: Alignment | None) -> FrameEstimate:
    """Correct each estimate of a frame by what known presses have shown."""
    if alignment is None:
        return frame_estimate
    names = "estimate", "from_strain", "from_pattern"
    found = {name: getattr(frame_estimate, name) for name in names}
    corrected = {name: alignment.apply(one) for name, one in found.items() if one}
    return replace(frame_estimate, **corrected)


def _places(estimate: Estimate) -> F64:
    """x, y, F of each touch, (n, 3)."""
    return np.column_stack([estimate.xy, estimate.force])
