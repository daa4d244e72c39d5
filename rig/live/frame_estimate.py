"""From a frame to touches, starting from what the last frame said."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from dic import TileSums
from models import Estimate, Result
from rig.live.baseline import is_consistent, update_drift
from rig.live.chain import Chain, ChainState
from rig.live.fitted import fitted, touches_of
from rig.live.fixed_pattern import FixedPattern
from rig.live.plate_in_time import MeasuredFrame, PlateInTime
from rig.live.registration import (
    Registered,
    jumped,
    register,
    shown_fixed_pattern,
    strangeness,
)
from rig.live.touch_start import begin
from rig.live.visibility import SLIGHT
from rig.system.arrays import F64, AnyArray, Mask
from rig.system.timing import Stopwatch

GUESSES = 3  # at most so often a frame is moved as the touches that were found would move it
STRANGE = 0.2  # of the tiles: where more look strange, the camera may have jumped
TOO_NOISY = 1.5  # of the variance by pixels: beyond it nothing is learned, or found in strain
NO_ESTIMATE = Estimate(
    np.empty((0, 2)), np.empty(0), np.empty((0, 0)), 0.0, 1, 1.0, Result.NO_TOUCH
)
"""The estimate of a frame in which nothing can be seen."""


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
        Tiles of the plate that do not show the pattern, behind a hand for instance.
    hidden_fraction : float
        Their part of those that see the plate.
    unusable_reason : str
        Why no touch can be estimated, as a sentence for the user; empty where it can.
    state : ChainState
        To start the next frame from.
    strain : (T, 3) float64, or None where the scene wants none
    from_strain : Estimate or None
        None where a part of the strain map is lost in this frame, by a hand for instance, or the
        frame is too noisy.
    from_pattern : Estimate or None
        Of the whole pattern, where a net estimates the touches.
    measured : (m,) float64 or None
        The frame in units of the noise of any motion, as touches explain it; None where none can
        be estimated.
    start_reason : str
        Why the touch net proposed nothing and touches were searched for; empty where it did.
    level : float
        Noise by which touches were searched, over that of `measured`, see `Chain.level`.
    pixel_variance : float
        See `Registered.pixel_variance`.
    blur : float, px
        Of the frame since the reference, see `FoundBlur.width`.
    """

    estimate: Estimate
    sums: TileSums
    hidden: Mask
    hidden_fraction: float
    unusable_reason: str
    state: ChainState
    strain: F64 | None = None
    from_strain: Estimate | None = None
    from_pattern: Estimate | None = None
    measured: F64 | None = None
    start_reason: str = ""
    level: float = 1.0
    pixel_variance: float = 1.0
    blur: float = 0.0

    @property
    def whole_and_clear(self) -> bool:
        """Whether hardly anything of the pattern is hidden, and noise is about the usual."""
        return self.hidden_fraction <= SLIGHT and self.pixel_variance <= TOO_NOISY


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
    the touches are found that explain how. Where that fits no touch and tiles look strange, a touch
    that came between two frames may have moved them by more than they can be followed: the
    reference is moved as the touches that were found would move it. Where much looks strange still
    the camera may have jumped. The guess in which less looks strange counts; where the reference
    still moves on in that, the frame says nothing. A pattern of the sensor is taken
    out from the first frame on that shows it.

    Parameters
    ----------
    drift : float
        Weight of what the frame shows in the state of rest if nothing touches, from
        `drift_weight`; 0 leaves it as it is.
    time : float, s, optional
        When the frame was complete; without it the plate is taken as one at equilibrium.
    """
    seen, found = _found(chain, image, state, watch, drift, time)
    if found.unusable_reason:
        return found
    if seen.settled:
        after = replace(state, fixed_pattern=_fixed_pattern(chain, seen, found))
        if after.fixed_pattern.variance and not state.fixed_pattern.variance:
            found = _found(chain, image, after, watch, drift, time)[1]
        return replace(found, state=replace(found.state, fixed_pattern=after.fixed_pattern))
    why = f"the pattern moves farther than it can be followed: it is found {seen.off:.1f} px on"
    kept = replace(found.state, rest=state.rest, memory=state.memory, past=state.past)
    return replace(found, estimate=NO_ESTIMATE, unusable_reason=why, state=kept, measured=None)


def _fixed_pattern(chain: Chain, seen: Registered, found: FrameEstimate) -> FixedPattern:
    """Say what this frame and those before it show of a pattern of the sensor."""
    known = found.state.fixed_pattern
    if known.is_known(chain.pixel_noise) or not found.whole_and_clear:
        return known
    return known.with_frame(shown_fixed_pattern(chain, seen))


def _found(
    chain: Chain,
    image: AnyArray,
    state: ChainState,
    watch: Stopwatch,
    drift: float,
    time: float | None,
) -> tuple[Registered, FrameEstimate]:
    """Guess how the frame has moved, and find the touches in the best guess."""
    fixed = state.fixed_pattern
    seen = register(chain, image, state.motion, watch, fixed)
    found = _estimated(chain, seen, state, watch, drift, time)
    for _ in range(GUESSES):
        explained = not found.hidden.any() or is_consistent(found.estimate)
        if found.unusable_reason or (seen.settled and explained):
            break
        guessed = register(chain, image, found.state.motion, watch, fixed)
        if not strangeness(guessed) < strangeness(seen):
            break
        # On an exact bench nothing but the search depends on the touches of the frame before.
        begun = replace(state, touches=found.state.touches)
        begun = state if chain.estimator.bench or chain.in_time else begun
        seen, found = guessed, _estimated(chain, guessed, begun, watch, drift, time)
    if not found.unusable_reason and (
        found.hidden_fraction <= STRANGE or is_consistent(found.estimate)
    ):
        return seen, found
    moved = jumped(chain, image, state.motion, watch)
    other = register(chain, image, moved, watch, fixed)
    if strangeness(other) < strangeness(seen):
        return other, _estimated(chain, other, state, watch, drift, time)
    return seen, found


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
        return FrameEstimate(
            NO_ESTIMATE, seen.sums, seen.hidden, seen.hidden_fraction, seen.unusable_reason, none
        )
    try:
        if chain.in_time is not None and time is not None:
            return _in_time(chain, chain.in_time, seen, state, watch, drift, time)
        return _at_equilibrium(chain, seen, state, watch, drift)
    except np.linalg.LinAlgError:
        # Numbers of a bench that nothing can stand on; the run goes on, and says what helps.
        why = "no touch can be estimated on the bench as it is known; calibrate the bench"
        none = replace(state, touches=np.empty((0, 3)))
        return FrameEstimate(NO_ESTIMATE, seen.sums, seen.hidden, seen.hidden_fraction, why, none)


def _at_equilibrium(
    chain: Chain, seen: Registered, state: ChainState, watch: Stopwatch, drift: float
) -> FrameEstimate:
    """Find the touches that explain a frame of a plate that follows them at once."""
    with watch.stage("estimate"):
        level = chain.level(seen.motion, seen.hidden, seen.pixel_variance(chain.noise))
        pattern, estimator = chain.masked_models.for_frame(seen.hidden, level)
        rest = state.rest
        right = seen.right - pattern.normal[:, : len(rest)] @ rest
        measured = pattern.whiten(right, chain.noise)
        begun, why = begin(chain.start, measured, state.touches, seen.hidden)
        clear = measured / level
        estimate, memory = fitted(estimator, clear, begun, state.memory)
        motion = pattern.amplitudes(estimate, right)
        motion[: len(rest)] += rest
        untouched = not estimate.count and is_consistent(estimate)
        if drift and untouched and seen.hidden_fraction <= SLIGHT:
            crept = estimator.without_memory(clear, memory.left)
            rest = update_drift(rest, pattern, crept, level * chain.noise, drift)
    after = replace(state, motion=motion, rest=rest, touches=touches_of(estimate), memory=memory)
    return FrameEstimate(
        estimate,
        seen.sums,
        seen.hidden,
        seen.hidden_fraction,
        "",
        after,
        measured=measured,
        start_reason=why,
        level=level,
        pixel_variance=seen.pixel_variance(chain.noise),
        blur=seen.blur_width,
    )


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
        begun, why = begin(chain.start, measured, state.touches, seen.hidden)
        frame = MeasuredFrame(measured, pattern.factor, chain.noise, time, pattern.motions)
        found = plate.estimate(estimator, frame, begun, state.past, state.memory)
        modal = pattern.motions.modal_amplitudes(found.estimate.xy, found.estimate.force)
        motion = pattern.with_camera(modal + found.beside, right)
        motion[: len(rest)] += rest
        if drift and found.left is not None and seen.hidden_fraction <= SLIGHT:
            rest = update_drift(rest, pattern, found.left, chain.noise, drift)
    touches = touches_of(found.estimate)
    after = replace(
        state, motion=motion, rest=rest, touches=touches, past=found.past, memory=found.memory
    )
    return FrameEstimate(
        found.estimate,
        seen.sums,
        seen.hidden,
        seen.hidden_fraction,
        "",
        after,
        measured=found.measured,
        start_reason=why,
        pixel_variance=seen.pixel_variance(chain.noise),
        blur=seen.blur_width,
    )
