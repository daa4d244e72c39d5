"""The twin's truth against the estimates of a run: errors, misses and false touches."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field
from itertools import islice

import numpy as np

import fe
from models import Estimate, match

KEPT = 100_000  # pairs whose errors are kept: an hour of one touch
RECENT = 300  # pairs in the running medians


def _errors() -> deque[float]:
    return deque(maxlen=KEPT)


@dataclass
class RunScore:
    """Counts frames and keeps the errors of the last `KEPT` matched touches.

    Attributes
    ----------
    min_force : float, N
        True touches weaker than this (a finger that just lands) are neither missed nor scored.
    frames : int
        Frames that were compared with the truth.
    misses, false : int
        Touches, summed over the frames, that were not found, or found and not there.
    position, force, relative : float, mm, N and fraction of the true force
        Errors of the pairs, in frames where all that presses is found and nothing else.
    """

    min_force: float
    frames: int = 0
    misses: int = 0
    false: int = 0
    position: deque[float] = field(default_factory=_errors)
    force: deque[float] = field(default_factory=_errors)
    relative: deque[float] = field(default_factory=_errors)

    def add(self, estimate: Estimate, truth: tuple[fe.Touch, ...]) -> tuple[float, float] | None:
        """Score one frame; returns its mean errors in mm and N, None where nothing was pressed."""
        self.frames += 1
        pressed = tuple(touch for touch in truth if touch.force >= self.min_force)
        self.misses += max(0, len(pressed) - estimate.count)
        self.false += max(0, estimate.count - len(truth))
        if estimate.count != len(pressed) or len(pressed) != len(truth) or not pressed:
            return None
        position, force, true_force = match(estimate, pressed)
        self.position.extend(position)
        self.force.extend(np.abs(force))
        self.relative.extend(np.abs(force) / true_force)
        return float(position.mean()), float(np.abs(force).mean())

    def running(self) -> tuple[float, float] | None:
        """Medians of the last errors in mm and N."""
        if not self.position:
            return None
        position, force = (
            float(np.median(list(islice(reversed(errors), RECENT))))
            for errors in (self.position, self.force)
        )
        return position, force

    def summary(self) -> dict[str, float | int | None]:
        """Figures of the run; None where nothing could be scored."""
        position, force, relative = (
            np.array(values) for values in (self.position, self.force, self.relative)
        )
        scored = len(position) > 0
        return {
            "frames": self.frames,
            "scored": len(position),
            "misses": self.misses,
            "false_touches": self.false,
            "position_median_mm": float(np.median(position)) if scored else None,
            "position_p95_mm": float(np.percentile(position, 95)) if scored else None,
            "position_rms_mm": float(np.sqrt(np.mean(position**2))) if scored else None,
            "force_median_n": float(np.median(force)) if scored else None,
            "force_median_percent": float(100 * np.median(relative)) if scored else None,
        }
