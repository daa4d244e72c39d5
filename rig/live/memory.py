"""Touches that ended: the plate may show a few percent of them for a while."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from models import MEMORY, NO_TRACES, Estimate, Traces, left_about, left_by
from rig.system.arrays import F64, Mask

SAME = 10.0  # mm, within which two touches are one
# mm, and fraction of its force, within which one that is gone has slid to where a new one is: what
# it passed between two frames keeps nothing of it. A lift and a press take longer than a frame.
SLID, STEADY = 40.0, 0.25
# Fraction of its largest force below which a touch has ended: thrice what a plate keeps of it.
_THRICE = 3.0
FADED = _THRICE * MEMORY
MANY = 8  # that are remembered: a trace of 0.01 N is seen on a plate of 1 mm
BRIEF = 0.3  # s, in which no touch comes and goes that leaves a trace
RENEWED = 0.5  # of what pressed there before: what is left of that no longer counts


def _none() -> F64:
    return np.empty((0, 3))


def _no_step() -> F64:
    return np.empty((0, 2))


@dataclass(frozen=True, eq=False)
class Memory:
    """What pressed the plate, as x, y and the largest force since it came.

    Attributes
    ----------
    held : (n, 3) float64, mm, mm, N
        The touches of the last frame.
    moved : (n, 2) float64, mm
        How far each of them had moved from the frame before.
    left : Traces
        Of those that ended last, the latest first.
    covered : (n, 3) float64, mm, mm, N
        Those of them where something presses now: their trace does not count until it has gone on.
    unseen : float, s
        For how long frames were lost, less the time since; see `by_frame`.
    """

    held: F64 = field(default_factory=_none)
    moved: F64 = field(default_factory=_no_step)
    left: Traces = NO_TRACES
    covered: F64 = field(default_factory=_none)
    unseen: float = 0.0

    def after(self, found: F64, strays: Traces = NO_TRACES) -> Memory:
        """Memory after a frame with touches (n, 3); `left` is the same array if none ended.

        What else the frame shows may be traces, see `strays`.
        """
        largest = found.copy()
        for touch in largest:
            touch[2] = self.held[_near(self.held, touch), 2].max(initial=touch[2])
        held = largest[found[:, 2] >= FADED * largest[:, 2]]
        moved = np.array([_step(self.held, touch) for touch in held]).reshape(-1, 2)
        come = held[_which(held, lambda touch: not _near(self.held, touch).any())]
        gone = _which(self.held, lambda touch: not _near(held, touch).any())
        ended = gone & ~_which(self.held, lambda touch: _slid(touch, come))
        before = self.left.touches
        # What is weaker than a trace of another leaves none, and may be one.
        strongest = max(part[:, 2].max(initial=0.0) for part in (self.held, before, self.covered))
        ended &= self.held[:, 2] >= MEMORY * strongest
        renewed = _which(before, lambda touch: bool(_near(self.held[ended], touch).any()))
        under = _which(before, lambda touch: _renewed(held, touch))
        still = _which(self.covered, lambda touch: _renewed(held, touch))
        over = _which(self.covered, lambda touch: bool(_near(self.held[ended], touch).any()))
        covered = np.concatenate([before[under & ~renewed], self.covered[still & ~over]])[:MANY]
        back = self.covered[~still & ~over]
        if not (ended.any() or renewed.any() or under.any() or len(back) or len(strays)):
            return Memory(held, moved, self.left, covered, self.unseen)
        older = self.left.of(~renewed & ~under).and_older(left_by(back))
        left = left_by(self.held[ended], self.moved[ended]).and_older(strays).and_older(older)
        return Memory(held, moved, left.of(np.arange(len(left)) < MANY), covered, self.unseen)

    def by_frame(self, seconds: float, lost: bool) -> Memory:
        """Memory before a frame that is taken so long after the last one; some between may be lost.

        A source that is slow has shown all it has. What was not seen shows itself later too, where
        something pressed beside it: the longer it may have been, the longer it counts.
        """
        return replace(self, unseen=max(seconds if lost else 0.0, self.unseen - seconds))

    def faint(self, memory: float, strongest: float = 0.0) -> float:
        """Force, N, below which a touch that came while frames were lost may be a trace; or 0.

        Parameters
        ----------
        memory : float
            Fraction of a touch that the plate keeps, a standard deviation.
        strongest : float, N
            Of the touches of this frame.
        """
        if self.unseen <= BRIEF:
            return 0.0
        return _THRICE * memory * self._strongest(strongest)

    def strays(
        self, estimate: Estimate, memory: float, known: Traces = NO_TRACES
    ) -> tuple[Mask, Traces]:
        """Say which of the touches found may be traces of one that was not seen, and what it left.

        One has gone on while frames were lost, or another came and went. What it left is as weak
        as the plate keeps of the strongest, and lies far from where all were seen last and from
        strays that are known already.

        Parameters
        ----------
        estimate : Estimate
        memory : float
            As for `faint`.
        known : Traces
        """
        found = np.column_stack([estimate.xy, estimate.force])
        strongest = self._strongest(float(estimate.force.max(initial=0.0)))
        faint = self.faint(memory, strongest)
        if not faint:
            return np.zeros(len(found), dtype=bool), NO_TRACES
        every = np.concatenate([self.held, known.touches])
        come = _which(found, lambda touch: not _near(every, touch).any())
        stray = come & (found[:, 2] < faint)
        places = [estimate.touch_covariance(int(k))[:2, :2] for k in np.flatnonzero(stray)]
        left = np.column_stack([found[stray, :2], np.full(len(places), strongest)])
        return stray, left_about(left, np.reshape(places, (-1, 2, 2)))

    def _strongest(self, now: float) -> float:
        """Largest force of late, N: of what pressed last, what ended, and what presses now."""
        return float(max((now, *self.held[:, 2], *self.left.touches[:, 2])))


def _which(touches: F64, holds: Callable[[F64], bool]) -> Mask:
    """For which touches (n, 3) something holds, (n,)."""
    return np.array([holds(touch) for touch in touches], dtype=bool)


def _step(before: F64, touch: F64) -> F64:
    """How far a touch has moved from the nearest of those before, (2,); zero where none is near."""
    steps = touch[:2] - before[:, :2]
    lengths = np.hypot(*steps.T)
    return steps[lengths.argmin()] if lengths.min(initial=np.inf) <= SLID else np.zeros(2)


def _slid(touch: F64, come: F64) -> bool:
    """Whether a touch that is gone has slid to where one of those that came is."""
    steady = np.abs(come[:, 2] - touch[2]) <= STEADY * touch[2]
    return bool((steady & (np.hypot(*(come[:, :2] - touch[:2]).T) <= SLID)).any())


def _renewed(held: F64, touch: F64) -> bool:
    """Whether a touch presses again where one ended, so hard that its trace no longer counts."""
    return bool((held[_near(held, touch), 2] >= RENEWED * touch[2]).any())


def _near(touches: F64, touch: F64) -> Mask:
    """Which touches (n, 3) lie where one does, (n,)."""
    return np.hypot(*(touches[:, :2] - touch[:2]).T) <= SAME
