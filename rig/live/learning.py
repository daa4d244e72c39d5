"""The bench learned on while the loop runs, from touches of which nobody says where they are.

A touch that is held still for some frames counts as a press of unknown place and force. What it
says of the bench is worked out beside the loop, and taken over a fixed number of frames later, so
that a run over recorded images ends the same however fast they come. Of a known weight the force is
known as well: it sets the newton.

A bench of which nothing is known but its scene is found from its first touches together, see
`FirstTouches`; then each one moves what is known a little.
"""

from __future__ import annotations

from concurrent.futures import Future
from dataclasses import dataclass, replace
from functools import partial
from math import hypot, inf

import numpy as np

import models
from models import BenchEstimate, BenchForward
from rig.live.beside import beside, failure
from rig.live.chain import Chain
from rig.live.first_touches import FirstTouches
from rig.live.frame_estimate import FrameEstimate
from rig.live.held_touch import ELSEWHERE, HeldTouch, hold, is_apart, steady_touch
from rig.live.learned import Learned
from rig.live.next_bench import NextBench
from rig.live.notice import Notice
from rig.system.arrays import F64

HELD = 8
"""Frames that a touch must be held for, and is looked at for."""
LATER = 20
"""Frames after which what was learned is taken over."""
_LONG_AGO = 20.0  # s after the touch before, from which on one at the same place says something new
_STRONG = 0.5  # N
_UNSURE = 30.0  # s after which a bench that showed nothing is less sure
WEIGHT = 3e-3
"""Standard deviation of a known weight, as a fraction: kitchen scales, and that it lies flat."""
_OTHER = 4.0  # standard deviations by which a touch may differ from the weight that it shall be
_PRESSED = 2.0  # N, for which is stated how well the newton is known


@dataclass(frozen=True, eq=False)
class _Work:
    """What is worked out beside the loop, and in how many frames it counts, or later.

    It is what a touch says, of a known weight in N or not, or the bench that first touches show.
    """

    made: Future[NextBench | None]
    wait: int
    weighed: float | None
    first: FirstTouches | None = None


class Learning:
    """Learns the bench of a chain on.

    Parameters
    ----------
    bench : BenchEstimate
        What is known of it at the start.
    references : int
        Frames of the reference, whose noise all touches share.
    first : FirstTouches, optional
        Of a bench of which nothing is known but its scene.
    waits : bool
        Whether frames wait while a bench is found: those of images that are kept do.

    Attributes
    ----------
    bench : BenchEstimate
        What is known of it now.
    learned : Learned
    notice : Notice
        What has become of a known weight.
    """

    def __init__(
        self,
        bench: BenchEstimate,
        references: int,
        first: FirstTouches | None = None,
        waits: bool = False,
    ):
        self.bench, self.learned, self.notice = bench, Learned(), Notice()
        self._references, self._waits, self._first = references, waits, first
        self._before: F64 | None = np.empty((0, 2))  # places of the frame before, where known
        self._held: HeldTouch | None = None
        self._last: tuple[float, F64] | None = None  # time and touch of what was learned last
        self._known_at: float | None = None
        self._work: _Work | None = None

    def weigh(self, force: float) -> None:
        """Take the touch that is held next, anywhere on the plate, as a known weight.

        Parameters
        ----------
        force : float, N

        Raises
        ------
        ValueError
            If it is too small to be learned from, or no weight.
        """
        if not _STRONG <= force < inf:
            raise ValueError(
                f"known weight must be {_STRONG:g} N or more, got {force:g} N; a litre of water"
                " weighs 9.81 N"
            )
        self.learned = replace(self.learned, weight=force)
        self.notice.say(f"known weight: lay {force:g} N on the plate and let it lie")

    def pause(self) -> None:
        """Forget what is on its way; nothing is learned until the next frame that is followed.

        First touches are gathered anew: they were measured against a reference that is no more.
        """
        self._held = self._work = None
        if self._first is not None:
            self._first = replace(self._first, presses=())
            self.learned = replace(self.learned, gathered=0)

    def follow(self, time: float, found: FrameEstimate, chain: Chain) -> NextBench | None:
        """Look at a frame; give the bench where it is another one from the next frame on.

        Parameters
        ----------
        time : float, s
            Of the capture.
        found : FrameEstimate
        chain : Chain
            That found it.
        """
        self._known_at = time if self._known_at is None else self._known_at
        if self.learned.force_sigma is None:
            self._judge(chain)
        if self._work is None:
            known = self._looked_at(time, found, chain)
        else:
            known = self._taken_over(self._work, chain)
        self._before = None if found.measured is None else found.estimate.xy
        return known

    def _looked_at(self, time: float, found: FrameEstimate, chain: Chain) -> NextBench | None:
        """See whether a frame shows a touch that says something."""
        held, self._held = self._held, self._holding(found, chain)
        if self._held is not None and len(self._held.shown) == HELD:
            self._ask(time, self._held, chain)
            self._held = None
        elif self._first and held and held.came_alone and self._has_gone(held, found):
            self._ask(time, held, chain)
        return self._less_sure(time) if self._work is None else None

    def _has_gone(self, held: HeldTouch, found: FrameEstimate) -> bool:
        """Whether a frame shows nothing near a touch of the one before, which lay still then."""
        return found.measured is not None and is_apart(held.touch, found.estimate.xy)

    def _less_sure(self, time: float) -> NextBench | None:
        """Let a bench that has shown nothing for some time be less sure."""
        if self._known_at is None or time - self._known_at < _UNSURE:
            return None
        self.bench = models.wandered(self.bench, time - self._known_at)
        self._known_at = time
        return NextBench(self.bench)

    def _taken_over(self, work: _Work, chain: Chain) -> NextBench | None:
        """Take over what was worked out, when it is time; live frames do not wait for a bench."""
        if work.wait > 1 or not (self._waits or work.first is None or work.made.done()):
            self._work = replace(work, wait=work.wait - 1)
            return None
        self._work, why = None, failure("the learning of the bench", work.made)
        known = None if why else work.made.result()
        if work.first is not None:
            known = self._found(known, work.weighed, work.first, chain)
        else:
            known = self._moved(known, work.weighed, chain)
        if why:
            self.notice.say(f"the bench stays as it was known: {why}")
        return known

    def _moved(
        self, known: NextBench | None, weighed: float | None, chain: Chain
    ) -> NextBench | None:
        """Take over a bench that one touch has moved, a known weight or not."""
        learned = self.learned
        if known is None:
            self.learned = replace(learned, strange=learned.strange + 1)
            if weighed:
                self.notice.say(
                    f"known weight of {weighed:g} N: what it shows fits no likely bench"
                )
            return None
        before, self.bench = self.bench, known.bench
        # A first touch counts among those that are gathered.
        touches = learned.touches + (self._first is None)
        weights = learned.weights + (weighed is not None)
        self.learned = replace(learned, touches=touches, weights=weights)
        self._judge(chain)
        if weighed:
            stiffer = float(known.bench["young"][0] - before["young"][0])
            self.notice.say(
                f"known weight of {weighed:g} N: the plate is {abs(stiffer):.1%}"
                f" {'stiffer' if stiffer > 0 else 'softer'} than was thought; forces are known to"
                f" {self.learned.force_sigma or 0.0:.1%} now"
            )
        return known

    def _found(
        self, known: NextBench | None, weighed: float | None, first: FirstTouches, chain: Chain
    ) -> NextBench | None:
        """Take over a bench that the first touches show, and follow it when they are enough."""
        count = len(first.presses)
        if known is None:
            self.notice.say(f"the first {count} touches show no likely bench; more are gathered")
            if first.complete:
                self.pause()
            return None
        self.bench, learned = known.bench, self.learned
        touches, weights = learned.touches + learned.gathered, learned.weights
        weights += weighed is not None
        self.learned = replace(learned, touches=touches, weights=weights, gathered=0)
        self._judge(chain)
        self.notice.say(
            f"the bench is found from {count} touches: places and forces are those on it from now"
            f" on, forces to {self.learned.force_sigma or 0.0:.1%}"
        )
        if first.complete:
            self._first = None
        return known

    def _judge(self, chain: Chain) -> None:
        """Work out how well the newton is known, in the middle of the plate."""
        forward = chain.estimator.forward
        if isinstance(forward, BenchForward):
            a, b = forward.plate.size
            middle = np.array([0.5 * a, 0.5 * b, _PRESSED])
            sigma = models.force_sigma(forward, self.bench, middle)
            self.learned = replace(self.learned, force_sigma=sigma)

    def _holding(self, found: FrameEstimate, chain: Chain) -> HeldTouch | None:
        """Add a frame to the touch that is held; None where it shows no single, steady touch."""
        touch = steady_touch(found)
        if touch is None or touch[2] < _STRONG or not self._may_be_weight(found):
            return None
        return hold(self._held, touch, found, chain, self._before)

    def _may_be_weight(self, found: FrameEstimate) -> bool:
        """Whether a touch may be the weight that is waited for, if one is."""
        weight = self.learned.weight
        if weight is None:
            return True
        force, sigma = float(found.estimate.force[0]), float(found.estimate.covariance[2, 2] ** 0.5)
        if abs(force - weight) <= _OTHER * hypot(sigma, WEIGHT * weight):
            return True
        self.notice.say(
            f"known weight: what lies there presses with {force:.2f} ± {sigma:.2f} N and not with"
            f" {weight:g} N; lay the weight alone"
        )
        return False

    def _ask(self, time: float, held: HeldTouch, chain: Chain) -> None:
        """Work out what a touch says, where it is not the one that was looked at last."""
        forward, weight = chain.estimator.forward, self.learned.weight
        if not isinstance(forward, BenchForward):
            return
        if weight is None and not self._is_new(time, held.touch):
            return
        self._last = time, held.touch
        since = 0.0 if self._known_at is None else max(time - self._known_at, 0.0)
        self.bench, self._known_at = models.wandered(self.bench, since), time
        shown, frames = np.mean(held.shown, axis=0), (len(held.shown), self._references)
        touch, sigma = held.touch.copy(), np.full(3, inf)
        if weight is not None:
            touch[2], sigma[2] = weight, WEIGHT * weight
            self.learned = replace(self.learned, weight=None)
        press = models.Press.of_frames(shown, touch, sigma, frames, None, held.moved)
        if self._first is not None:
            self._first = self._first.with_press(press)
            self.learned = replace(self.learned, gathered=self.learned.gathered + 1)
        if self._first is not None and self._first.due:
            find = partial(self._first.find, chain.pattern, chain.noise)
            self._work = _Work(beside("learning", find), 1, weight, self._first)
        elif self._first is None or weight is not None:
            learn = partial(_learned, forward.apart(), self.bench, press, held.left)
            self._work = _Work(beside("learning", learn), LATER, weight)

    def _is_new(self, time: float, touch: F64) -> bool:
        if self._last is None:
            return True
        then, before = self._last
        return time - then > _LONG_AGO or hypot(*(touch[:2] - before[:2])) > ELSEWHERE


def _learned(
    forward: BenchForward, bench: BenchEstimate, press: models.Press, left: models.Traces
) -> NextBench | None:
    made = models.learn(forward, bench, press, left)
    return None if made is None or not made.is_sound else NextBench(made)
