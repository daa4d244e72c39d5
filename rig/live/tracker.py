"""Follows one plate from frame to frame: what each frame says, and which touch is which."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from models.estimate import Estimate, Result
from models.forward.large import LargeForward
from rig.live import chain as live
from rig.live.baseline import Zero, fits, share
from rig.live.bench import Bench
from rig.live.quality import SLIGHT
from rig.live.tracks import Event, Tracks
from rig.system.frame import Frame
from rig.system.timing import Stopwatch

LATENCY = "capture to touches"


@dataclass(frozen=True, eq=False)
class Seen:
    """What a frame says in the light of those before it.

    Attributes
    ----------
    before : State
        What it was sensed from.
    sensed : Sensed
    identities : (n,) int
        Of the touches found.
    velocities : (n,) pairs of float, mm/s
        Theirs, as far as they are sure.
    events : tuple of Event
    """

    before: live.State
    sensed: live.Sensed
    identities: tuple[int, ...]
    velocities: tuple[tuple[float, float], ...]
    events: tuple[Event, ...]


class Follower:
    """Senses frame after frame.

    Parameters
    ----------
    bench : Bench
    zero : Zero
        The plate at rest.
    watch : Stopwatch
    clock : callable
        Monotonic time, s; the same that stamps the frames.

    Attributes
    ----------
    chain : Chain
    strain : StrainChain or None

    Raises
    ------
    ValueError
        If the reference does not suit the bench.
    """

    def __init__(self, bench: Bench, zero: Zero, watch: Stopwatch, clock: Callable[[], float]):
        self.chain, self.strain = bench.prepare(zero)
        self._net = bench.prepare_net(zero, self.chain)
        self._bench, self._watch, self._clock = bench, watch, clock
        self._state, self._tracks = live.at_rest(self.chain), Tracks()
        self._captured: float | None = None
        self._warm_up(zero)

    def see(self, frame: Frame) -> Seen:
        """Sense a frame and follow its touches."""
        before, watch = self._state, self._watch
        watch.add("arrive", self._clock() - frame.captured)
        last = frame.captured if self._captured is None else self._captured
        sensed = live.sense(self.chain, frame.image, before, watch, share(frame.captured - last))
        if self._net:
            sensed = self._net.tell(self.chain, frame.image, sensed, watch)
        watch.add(LATENCY, self._clock() - frame.captured)
        sensed = live.with_strain(self.strain, sensed, watch, self._bench.alignment)
        with watch.stage("track"):
            followed = self._tracks.follow(sensed.estimate, frame.captured)
        self._tracks, identities, events = followed
        self._state, self._captured = sensed.state, frame.captured
        pace = {track.identity: track.sure_velocity for track in self._tracks.tracks}
        velocities = tuple(pace[identity] for identity in identities)
        return Seen(before, sensed, identities, velocities, events)

    def miss(self, time: float) -> tuple[Event, ...]:
        """Let touches leave while no frames come."""
        self._tracks, _, events = self._tracks.follow(live.NOTHING, time)
        return events

    def sentence(self, sensed: live.Sensed) -> str:
        """Say what a frame shows, and what is to be doubted in it."""
        if sensed.trouble:
            return sensed.trouble
        said, share = _count(sensed.estimate), float(np.mean(sensed.hidden))
        if share > SLIGHT:
            said += f"; {share:.0%} of the pattern is hidden"
        elif not fits(sensed.estimate):
            said += ", but the picture does not fit: is something in the way, or the pattern worn?"
        if doubt := self._doubt(sensed):
            said += f"; {doubt}"
        return said

    def _doubt(self, sensed: live.Sensed) -> str:
        """Say what is wrong with the theory under these touches; empty where it holds."""
        touches, forward = sensed.state.touches, self.chain.sights.search.forward
        if not len(touches):
            return ""
        if isinstance(forward, LargeForward):
            from fe.reduced.result import Trust

            trust = forward.trust(touches)
            return "" if trust is Trust.TRAINED else trust.value
        return self._bench.theory.beyond(float(touches[:, 2].max()))

    def _warm_up(self, zero: Zero) -> None:
        """Pass the reference through the chain: what compiles does so before time counts."""
        watch = Stopwatch(time.monotonic)
        picture = np.rint(zero.image).astype(np.uint8)
        sensed = live.sense(self.chain, picture, self._state, watch)
        if self._net:
            sensed = self._net.tell(self.chain, picture, sensed, watch)
        live.with_strain(self.strain, sensed, watch)


def _count(estimate: Estimate) -> str:
    if estimate.result is not Result.FOUND:
        return estimate.result.value
    return "one touch" if estimate.count == 1 else f"{estimate.count} touches"
