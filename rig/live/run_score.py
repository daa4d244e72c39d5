"""The twin's truth against the estimates of a run: errors, misses and false touches."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

import fe
from models import Estimate, match
from rig.system.arrays import F32, F64

KEPT = 100_000  # pairs whose errors are kept: an hour of one touch
RECENT = 300  # pairs in the running medians


class _Errors:
    """The last `KEPT` errors, mm, N and fraction of the true force: the oldest give their place."""

    def __init__(self) -> None:
        self._rows = np.empty((KEPT, 3), dtype=np.float32)
        self._count = 0

    def __len__(self) -> int:
        return min(self._count, len(self._rows))

    def add(self, errors: F64) -> None:
        """Keep rows (n, 3) in the place of the oldest."""
        self._rows[(self._count + np.arange(len(errors))) % len(self._rows)] = errors
        self._count += len(errors)

    def latest(self, count: int) -> F32:
        """Return the last rows, `count` of them or all there are."""
        count = min(count, len(self))
        return self._rows[(self._count - 1 - np.arange(count)) % len(self._rows)]


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
    """

    min_force: float
    frames: int = 0
    misses: int = 0
    false: int = 0
    _errors: _Errors = field(default_factory=_Errors)

    def add(self, estimate: Estimate, truth: tuple[fe.Touch, ...]) -> tuple[float, float] | None:
        """Score one frame; returns its mean errors in mm and N, None where nothing was pressed.

        Errors are kept of frames in which all that presses is found, and nothing else.
        """
        self.frames += 1
        pressed = tuple(touch for touch in truth if touch.force >= self.min_force)
        self.misses += max(0, len(pressed) - estimate.count)
        self.false += max(0, estimate.count - len(truth))
        if estimate.count != len(pressed) or len(pressed) != len(truth) or not pressed:
            return None
        position, force, true_force = match(estimate, pressed)
        off = np.abs(force)
        self._errors.add(np.column_stack([position, off, off / true_force]))
        return float(position.mean()), float(off.mean())

    def running(self) -> tuple[float, float] | None:
        """Medians of the last errors in mm and N."""
        if not len(self._errors):
            return None
        position, force, _ = self._errors.latest(RECENT).T
        return float(np.median(position)), float(np.median(force))

    def summary(self) -> dict[str, float | int | None]:
        """Figures of the run; None where nothing could be scored."""
        position, force, relative = (
            np.asarray(column, dtype=np.float64) for column in self._errors.latest(KEPT).T
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
