"""Follows a bent plate from frame to frame: its base, and the touches on it.

Whatever takes seconds is done in the background. While a shape is not known, or not well enough to
say what touches it, no touch is reported, and why stands in the sentence of the frame.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

import fe
from models import (
    Estimate,
    PreparedShape,
    Result,
    Surface,
    SurfaceEstimate,
    shape_verdict,
)
from rig.live.baseline import ReferenceFrame
from rig.live.fitted import touches_of
from rig.live.frame_estimate import NO_ESTIMATE
from rig.live.pace import LATENCY
from rig.live.snapshot import BaseReading
from rig.live.tracks import Event, Track, Tracks
from rig.on_base.background import Background, in_a_thread
from rig.on_base.base_bench import BaseBench
from rig.on_base.preparation import Preparation, Way
from rig.on_base.resting_plate import FRAMES, RestingPlate, is_untouched, unknown_rest
from rig.on_base.shapes import (
    ListedShapes,
    ReadyShape,
    find_again,
    find_shape,
    follow_shape,
    list_shapes,
    turns_of,
)
from rig.system.arrays import F64
from rig.system.frame import Frame
from rig.system.timing import Stopwatch

UNKNOWN = replace(NO_ESTIMATE, p_value=np.nan, result=Result.UNRESOLVABLE)
"""The estimate of a frame that cannot say what touches."""

EARLY = 0.4  # of what a response is good for, after which the next one is prepared
LISTED = np.array([0.3, 1.5])  # mm and degrees, after which the stable shapes are sought anew
NEAR = 0.2  # in parts of the largest displacement: shapes that differ by more are others
STEADY = 1.0  # s over which the speed of a base is measured at least

SEARCHING, RESTING = "SEARCHING", "RESTING"
"""Outcomes of a frame before its shape is known, and while the plate at rest is taken."""

_SEARCHED = "the shape of the base is being identified; touch nothing"
_RESTED = "the bent plate at rest is being taken ({} of {} frames); touch nothing"


@dataclass(frozen=True, eq=False)
class SurfaceResult:
    """What a frame of a bent plate shows after those before it.

    Attributes
    ----------
    estimate : Estimate
        Of touches; none and UNRESOLVABLE where they cannot be known.
    tracks : (n,) tuple of Track
        What all frames so far say of each touch.
    events : tuple of Event
    sentence : str
        For the user.
    outcome : str
        Name of what can be said of touches: "FOUND", "NO_TOUCH", or why they cannot be known.
    base : BaseReading or None
    said : SurfaceEstimate or None
        What the frame said by itself; None while no shape is known.
    """

    estimate: Estimate
    tracks: tuple[Track, ...]
    events: tuple[Event, ...]
    sentence: str
    outcome: str
    base: BaseReading | None
    said: SurfaceEstimate | None

    @property
    def knows(self) -> bool:
        """Whether it says what touches."""
        return self.outcome in (Result.FOUND.name, Result.NO_TOUCH.name)


class SurfaceFollower:
    """Estimates base and touches of frame after frame.

    Parameters
    ----------
    bench : BaseBench
    reference : ReferenceFrame
        The flat plate.
    watch : Stopwatch
    clock : callable
        Monotonic time, s; the same that stamps the frames.
    background : callable
        Does what takes seconds; see `Background`.

    Attributes
    ----------
    ready : ReadyShape or None
        None until a shape was identified.
    preparation : Preparation
        Of the next one.
    """

    def __init__(
        self,
        bench: BaseBench,
        reference: ReferenceFrame,
        watch: Stopwatch,
        clock: Callable[[], float],
        background: Background = in_a_thread,
    ):
        self.ready: ReadyShape | None = None
        self.preparation = Preparation(background, clock)
        self._bench, self._watched = bench, bench.watched(reference)
        self._noise, self._background = reference.noise, background
        self._watch, self._clock = watch, clock
        self._tracks, self._rest = Tracks(), RestingPlate(np.empty(0))
        self._motion, self._touches = np.empty(0), np.empty((0, 3))
        self._seen = False
        self._captured: float | None = None
        self._from: tuple[float, fe.Base] | None = None
        self._listing: Future[ListedShapes] | None = None
        self._listed: ListedShapes | None = None

    @property
    def knows_rest(self) -> bool:
        """Whether the bent plate at rest was taken, so that it may be touched."""
        return self.ready is not None and self._rest.known

    def search(self) -> None:
        """Identify the shape anew, and take the plate at rest again."""
        self.ready, self.preparation.trouble = None, ""
        self.preparation.forget()

    def process(self, frame: Frame) -> SurfaceResult:
        """Estimate base and touches of a frame and follow them."""
        self._watch.add("arrive", self._clock() - frame.given)
        self._take_over(frame.captured)
        if self.ready is None:
            work = partial(find_shape, self._bench, self._watched, frame.image, self._noise)
            self.preparation.start(Way.SEARCH, work)
            self._watch.add(LATENCY, self._clock() - frame.given)
            return self._unknown(frame.captured)
        with self._watch.stage("estimate"):
            rest = self._rest.amplitudes
            shape = self.ready.shape
            said = _named(shape, shape.read(frame.image, self._motion, self._touches, rest))
        self._watch.add(LATENCY, self._clock() - frame.given)
        resting = self._take_rest(frame.captured, self.ready, said)
        self._start_next(self.ready, said)
        self._keep_up(frame, self.ready, said)
        return self._result(frame.captured, self.ready, said, resting=resting)

    def miss(self, time: float) -> tuple[Event, ...]:
        """Let touches leave while no frames come."""
        self._tracks, _, events = self._tracks.follow(NO_ESTIMATE, time)
        return events

    def _take_over(self, time: float) -> None:
        """Go over to the next shape where it is ready, unless the last one is seen again."""
        found, before = self.preparation.take(), self.ready
        if found is None or (found[0] is Way.SEARCH and before and self._seen):
            return
        self.use(found[1], time)

    def use(self, ready: ReadyShape, time: float) -> None:
        """Go over to a shape; what one near by showed at rest, and its touches, go with it.

        Parameters
        ----------
        ready : ReadyShape
        time : float, s
            Capture of the next frame.
        """
        before, rest = self.ready, unknown_rest(ready.shape)
        camera, touches = ready.camera, np.empty((0, 3))
        if before is not None and _near(before, ready):
            rest = self._rest.carried(ready.shape, before.shape)
            camera, touches = self._motion[-6:-2], self._touches
        self.ready, self._from = ready, (time, ready.shape.state.base)
        self._motion, self._touches, self._rest = ready.shape.still(camera), touches, rest
        self._list(ready.shape.state)

    def _list(self, state: fe.ShellState) -> None:
        """Have the stable shapes sought, unless those of a base near by are known."""
        listed, base = self._listed, state.base
        if self._listing is None and (listed is None or (_apart(listed.base, base) > LISTED).any()):
            self._listed = turns_of(state)
            self._listing = self._background(partial(list_shapes, self._bench, base))

    def _shapes(self, state: fe.ShellState) -> ListedShapes:
        """Give the stable shapes as far as they were sought."""
        if self._listing is not None and self._listing.done():
            listing, self._listing = self._listing, None
            with suppress(ValueError):  # a base for which no other start comes to rest
                self._listed = listing.result()
        return self._listed or turns_of(state)

    def _take_rest(self, time: float, ready: ReadyShape, said: SurfaceEstimate) -> bool:
        """Take a frame for the plate at rest where it is; say whether it is still being taken."""
        since = 0.0 if self._captured is None else time - self._captured
        self._captured = time
        if said.surface is Surface.SEEN and is_untouched(said.estimate, self._rest):
            was = self._rest.known
            self._rest = self._rest.taken(ready.shape, said.measured, since)
            return not was
        return False

    def _start_next(self, ready: ReadyShape, said: SurfaceEstimate) -> None:
        """Keep what the next frame starts from."""
        self._seen = said.surface is Surface.SEEN
        fits = ready.shape.explains(said.misfit)
        self._motion = said.motion if fits else ready.shape.still(self._motion[-6:-2])
        self._touches = touches_of(said.estimate) if self._seen else np.empty((0, 3))

    def _keep_up(self, frame: Frame, ready: ReadyShape, said: SurfaceEstimate) -> None:
        """Have the next shape prepared where this one is or will soon be no good."""
        shape = ready.shape
        if self.preparation.busy:
            return
        if not shape.explains(said.misfit):
            parts = self._bench, self._watched, frame.image, shape, self._noise
            self.preparation.start(Way.SEARCH, partial(find_again, *parts))
        elif shape.travelled(said.motion) > EARLY:
            base, camera = self._ahead(frame.captured, said.base), said.motion[-6:-2]
            parts = self._bench, self._watched, ready, base, camera
            self.preparation.start(Way.FOLLOW, partial(follow_shape, *parts))

    def _ahead(self, time: float, base: fe.Base) -> fe.Base:
        """Give the base that a steady motion will have come to when the next shape is ready."""
        since, begun = self._from or (time, base)
        if time - since < STEADY:
            return base
        lead = min(self.preparation.lead / (time - since), 1.0)
        return fe.Base(
            max(base.bend + lead * (base.bend - begun.bend), 0.0),
            base.twist + lead * (base.twist - begun.twist),
        )

    def _unknown(self, time: float) -> SurfaceResult:
        """Say that no shape is known yet, and why."""
        self._tracks, _, events = self._tracks.follow(UNKNOWN, time)
        trouble = self.preparation.trouble
        sentence = f"{trouble}; {_SEARCHED}" if trouble else _SEARCHED
        return SurfaceResult(UNKNOWN, (), events, sentence, SEARCHING, None, None)

    def _result(
        self, time: float, ready: ReadyShape, said: SurfaceEstimate, *, resting: bool
    ) -> SurfaceResult:
        outcome = RESTING if resting else said.surface.name
        if outcome == Surface.SEEN.name:
            outcome = said.estimate.result.name
        known = outcome in (Result.FOUND.name, Result.NO_TOUCH.name)
        estimate = said.estimate if known else UNKNOWN
        self._tracks, identities, events = self._tracks.follow(estimate, time)
        of = {track.identity: track for track in self._tracks.tracks}
        tracks = tuple(of[identity] for identity in identities)
        sentence = self._sentence(said, resting=resting)
        if shape_verdict(ready.shape.state.stability) is fe.Verdict.OVERSTRAINED:
            sentence += f"; {fe.Verdict.OVERSTRAINED.value}"
        reading = self._reading(ready, said, outcome)
        return SurfaceResult(estimate, tracks, events, sentence, outcome, reading, said)

    def _sentence(self, said: SurfaceEstimate, *, resting: bool) -> str:
        if resting:
            return _RESTED.format(self._rest.frames, FRAMES)
        if said.surface is Surface.SEEN:
            found, count = said.estimate.result, said.estimate.count
            if found is not Result.FOUND:
                return found.value
            return "one touch" if count == 1 else f"{count} touches"
        doing = "; the next shape is being prepared" if self.preparation.busy else ""
        return said.surface.value + doing

    def _reading(self, ready: ReadyShape, said: SurfaceEstimate, outcome: str) -> BaseReading:
        state, base = ready.shape.state, said.base
        listed = self._shapes(state)
        sigma_bend, sigma_twist = np.sqrt(np.diag(said.covariance)).tolist()
        return BaseReading(
            bend=base.bend,
            twist=base.twist,
            sigma_bend=sigma_bend,
            sigma_twist=sigma_twist,
            eigenvalue=state.stability.eigenvalue,
            verdict=shape_verdict(state.stability).name,
            outcome=outcome,
            shapes=listed.marked(state),
            all_sought=listed.all_sought,
        )


def _named(shape: PreparedShape, said: SurfaceEstimate) -> SurfaceEstimate:
    """Call a base that has moved on what it is only where that explains the image."""
    if said.surface is Surface.MOVED_ON and not shape.explains(said.misfit):
        return replace(said, surface=Surface.NO_FIT)
    return said


def _apart(one: fe.Base, other: fe.Base) -> F64:
    return np.abs([one.bend - other.bend, one.twist - other.twist])


def _near(one: ReadyShape, other: ReadyShape) -> bool:
    """Whether two shapes are nearly the same, so that one shows at rest what the other does."""
    before, after = one.shape.state, other.shape.state
    if (_apart(before.base, after.base) > LISTED).any():
        return False
    off = np.abs(before.values - after.values).max()
    return bool(off < NEAR * max(np.abs(before.values).max(), before.plate.thickness))
