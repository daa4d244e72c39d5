"""What a touch net takes touches for beforehand: any number of them, anywhere, of any force."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from models.arrays import F64

MAX_TOUCHES = 4
"""Touches at once that a touch net knows."""


@dataclass(frozen=True)
class TouchRange:
    """Touches that a net is trained on, each number, place and force as likely as any other.

    Attributes
    ----------
    size : (float, float), mm
        Of the plate.
    margin : float
        Fraction of a side at each edge in which no touch lies.
    force : (float, float), N
        Least and largest.
    """

    size: tuple[float, float]
    margin: float
    force: tuple[float, float]

    @cached_property
    def bounds(self) -> F64:
        """Least and largest x, y, F, (2, 3) mm, mm, N."""
        low, high = self.margin, 1.0 - self.margin
        a, b = self.size
        return np.array([[low * a, low * b, self.force[0]], [high * a, high * b, self.force[1]]])

    @cached_property
    def log_volume(self) -> float:
        """Logarithm of the range of one touch, mm² N."""
        low, high = self.bounds
        return float(np.log(high - low).sum())

    def scaled(self, touches: F64) -> F64:
        """Touches (…, 3) from -1 to 1 over the range."""
        low, high = self.bounds
        return 2.0 * (touches - low) / (high - low) - 1.0

    def unscaled(self, scaled: F64) -> F64:
        """Return what `scaled` took, (…, 3) mm, mm, N."""
        low, high = self.bounds
        return low + 0.5 * (scaled + 1.0) * (high - low)

    def draw(self, rng: np.random.Generator, count: int) -> F64:
        """Draw `count` touches, however close together, (count, 3)."""
        low, high = self.bounds
        return rng.uniform(low, high, (count, 3))
