"""Follows one plate from frame to frame: what each frame says, and which touch is which."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace

from models import BenchForward, Estimate, LargeForward, Result
from rig.live.baseline import ReferenceFrame, drift_weight, is_consistent
from rig.live.bench import Bench, PreparedBench
from rig.live.chain import ChainState, at_rest
from rig.live.frame_estimate import NO_ESTIMATE, FrameEstimate
from rig.live.memory import Memory
from rig.live.next_bench import NextBench, on_next_bench
from rig.live.pace import LATENCY
from rig.live.quality import SOFT
from rig.live.reported import report_frame
from rig.live.strain_chain import with_strain, with_touches
from rig.live.tracks import Event, Track, Tracks
from rig.live.visibility import SLIGHT
from rig.live.warm_up import Report, quiet, rehearsal
from rig.system.frame import Frame
from rig.system.timing import Stopwatch


@dataclass(frozen=True, eq=False)
class FrameResult:
    """What a frame shows after those before it.

    Attributes
    ----------
    before : ChainState
        What it was estimated from.
    frame_estimate : FrameEstimate
    identities : (n,) int
        Of the touches found.
    tracks : (n,) tuple of Track
        Theirs: what all frames so far say of each.
    events : tuple of Event
    """

    before: ChainState
    frame_estimate: FrameEstimate
    identities: tuple[int, ...]
    tracks: tuple[Track, ...]
    events: tuple[Event, ...]


class FrameProcessor:
    """Estimates the touches of frame after frame.

    Parameters
    ----------
    bench : Bench
    reference : ReferenceFrame
        The plate at rest.
    watch : Stopwatch
    clock : callable
        Monotonic time, s; the same that stamps the frames.
    report : callable
        Called while frames that are made up go through everything first; see `rehearsal`.

    Attributes
    ----------
    chain : Chain
    strain : StrainChain or None

    Raises
    ------
    ValueError
        If the reference does not suit the bench.
    """

    def __init__(
        self,
        bench: Bench,
        reference: ReferenceFrame,
        watch: Stopwatch,
        clock: Callable[[], float],
        report: Report = quiet,
    ):
        self._use(bench.prepare_all(reference))
        self._bench, self._clock = bench, clock
        self._watch = Stopwatch(time.monotonic)  # what is made up counts for nothing
        self._begin()
        for frame in rehearsal(self.chain, bench.theory.force, report):
            self.sentence(self.process(frame).frame_estimate)
        self._watch = watch
        self._begin()

    def process(self, frame: Frame) -> FrameResult:
        """Estimate the touches of a frame and follow them."""
        watch = self._watch
        watch.add("arrive", self._clock() - frame.given)
        seconds = 0.0 if self._captured is None else frame.captured - self._captured
        lost = self._sequence is not None and frame.sequence > self._sequence + 1
        before = replace(self._state, memory=self._state.memory.by_frame(seconds, lost))
        drift = drift_weight(seconds)
        frame_estimate = report_frame(
            self.chain, self._net, frame.image, before, watch, drift, frame.captured
        )
        watch.add(LATENCY, self._clock() - frame.given)
        frame_estimate = with_strain(self.strain, frame_estimate, watch, self._bench.alignment)
        with watch.stage("track"):
            followed = self._tracks.follow(frame_estimate.estimate, frame.captured)
        self._tracks, identities, events = followed
        self._hidden = self._hidden.followed(frame_estimate.hidden)
        self._state = frame_estimate.state
        self._captured, self._sequence = frame.captured, frame.sequence
        known = {track.identity: track for track in self._tracks.tracks}
        tracks = tuple(known[identity] for identity in identities)
        return FrameResult(before, frame_estimate, identities, tracks, events)

    def renew(self, prepared: PreparedBench) -> None:
        """Compare frames with another reference from the next on; touches keep their identity.

        What had crept or was left of touches that ended is in the new reference.
        """
        self._use(prepared)
        before, rest = self._state, at_rest(self.chain)
        self._state = replace(
            rest,
            touches=before.touches,
            from_strain=before.from_strain,
            memory=Memory(before.memory.held, before.memory.moved),
        )

    def stand_still(self, prepared: PreparedBench) -> None:
        """Go on as before on the same reference, prepared anew."""
        self._use(prepared)

    def stand_on(self, known: NextBench) -> None:
        """Take another bench from the next frame on."""
        self.chain = on_next_bench(self.chain, known)
        if self.strain is not None and self.strain.estimator is not None:
            self.strain = with_touches(self.strain, self.chain)

    def miss(self, time: float) -> tuple[Event, ...]:
        """Let touches leave while no frames come."""
        self._tracks, _, events = self._tracks.follow(NO_ESTIMATE, time)
        return events

    def sentence(self, frame_estimate: FrameEstimate, cause: str = "") -> str:
        """Say what a frame shows, and what may be wrong with it.

        Parameters
        ----------
        frame_estimate : FrameEstimate
        cause : str
            What is known to be otherwise than described, as a sentence.
        """
        if frame_estimate.unusable_reason:
            return frame_estimate.unusable_reason
        said, fraction = _count(frame_estimate.estimate), frame_estimate.hidden_fraction
        fits, slight = is_consistent(frame_estimate.estimate), fraction <= SLIGHT
        hidden = "" if fits and slight else self._hidden.sentence(frame_estimate.hidden)
        if not slight:
            said += f"; {fraction:.0%} of the pattern is hidden: {hidden}"
        focus = _unfocused(frame_estimate.blur)
        if not fits:
            said += f", but the image does not fit{_why(hidden, cause or focus) if slight else ''}"
        elif focus:
            said += f". {focus}"
        if caution := self._caution(frame_estimate):
            said += f"; {caution}"
        if unseen := self._unseen(frame_estimate):
            said += f"; {unseen}"
        return said

    def _unseen(self, frame_estimate: FrameEstimate) -> str:
        """Say what cannot be known since frames were lost; empty where all was seen."""
        bench, force = self.chain.estimator.bench, frame_estimate.estimate.force
        if bench is None:
            return ""
        memory = frame_estimate.state.memory
        faint = memory.faint(bench.memory, float(force.max(initial=0.0)))
        if not faint:
            return ""
        return (
            f"frames were lost: for {memory.unseen:.1f} s a new touch of less than {faint:.2f} N"
            " may be taken for what another left"
        )

    def _caution(self, frame_estimate: FrameEstimate) -> str:
        """Say what is wrong with material or theory under these touches; empty where both hold."""
        touches, forward = frame_estimate.state.touches, self.chain.estimator.forward
        if overstrained := self._bench.theory.overstrained(float(touches[:, 2].sum())):
            return overstrained
        if not len(touches) or isinstance(forward, BenchForward):
            return ""
        if isinstance(forward, LargeForward):
            from fe import Trust

            trust = forward.trust(touches)
            return "" if trust is Trust.TRAINED else trust.value
        return self._bench.theory.beyond(float(touches[:, 2].max()))

    def _use(self, prepared: PreparedBench) -> None:
        self.chain, self.strain, self._net = prepared.chain, prepared.strain, prepared.net

    def _begin(self) -> None:
        """Start from a plate at rest, and know no touch."""
        self._state, self._tracks = at_rest(self.chain), Tracks()
        self._hidden = self._bench.hidden_parts
        self._captured: float | None = None
        self._sequence: int | None = None


def _unfocused(blur: float) -> str:
    """Say by how many px an image is blurred; empty where it is as sharp as the reference."""
    if blur < SOFT:
        return ""
    return (
        f"The image is blurred by {blur:.1f} px more than the reference: let the camera stand still"
        " and focus it, or take the reference again"
    )


def _why(hidden: str, cause: str) -> str:
    """Say why touches do not explain a frame in which hardly anything is hidden."""
    if cause:
        return f". {cause}"
    if hidden:
        return f": {hidden}"
    return (
        ": the bench is not as the scene says, or touches are other than the theory has them"
        " (touchplate diagnose)"
    )


def _count(estimate: Estimate) -> str:
    if estimate.result is not Result.FOUND:
        return estimate.result.value
    return "one touch" if estimate.count == 1 else f"{estimate.count} touches"
