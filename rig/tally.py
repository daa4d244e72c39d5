"""The twin's truth against the estimates of a run: errors, misses and false touches."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

import fe
from models.estimate import Estimate
from models.matching import match

RECENT = 300  # pairs in the running medians


@dataclass
class Tally:
    """Counts frames and keeps the errors of every matched touch.

    Attributes
    ----------
    least : float, N
        True touches weaker than this (a finger that just lands) are neither missed nor scored.
    """

    least: float
    frames: int = 0
    misses: int = 0
    false: int = 0
    position: list[float] = field(default_factory=list)
    force: list[float] = field(default_factory=list)
    relative: list[float] = field(default_factory=list)

    def add(self, estimate: Estimate, truth: tuple[fe.Touch, ...]) -> tuple[float, float] | None:
        """Score one frame; returns its mean errors in mm and N, None where nothing was pressed."""
        self.frames += 1
        pressed = tuple(touch for touch in truth if touch.force >= self.least)
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
        return float(np.median(self.position[-RECENT:])), float(np.median(self.force[-RECENT:]))

    def summary(self) -> dict[str, float | int | None]:
        """Figures of the whole run; None where nothing could be scored."""
        position, force, relative = (
            np.array(values) for values in (self.position, self.force, self.relative)
        )
        scored = len(position) > 0
        return {
            "scored": len(position),
            "misses": self.misses,
            "false_touches": self.false,
            "position_median_mm": float(np.median(position)) if scored else None,
            "position_p95_mm": float(np.percentile(position, 95)) if scored else None,
            "position_rms_mm": float(np.sqrt(np.mean(position**2))) if scored else None,
            "force_median_n": float(np.median(force)) if scored else None,
            "force_median_percent": float(100 * np.median(relative)) if scored else None,
        }
