"""How much of the noise of a frame's forces and places there is: what makes it most likely."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular

from models.arrays import F64

# How fast a force gains speed, N/s per √s: a finger that rests up to one that taps hard.
_FORCES = (0.3, 3.0, 30.0, 300.0, 3000.0, 30000.0)
_SLIDES = (5.0, 200.0)  # mm/s, of a finger that stays or slides


@dataclass(frozen=True)
class Columns:
    """Where each kind of direction stands: those known before, then those of a frame's noise.

    Attributes
    ----------
    before : int
    frequencies : int
    touches : int
    steps : int
        Knots of each touch.
    interval : float, s
    """

    before: int
    frequencies: int
    touches: int
    steps: int
    interval: float

    @property
    def total(self) -> int:
        """Number of directions."""
        return self.place(self.touches) + self.touches * self.steps

    def place(self, touch: int) -> int:
        """First of the two directions in which a touch moves."""
        return self.before + self.frequencies + 2 * touch

    def force(self, touch: NDArray[np.int64]) -> NDArray[np.int64]:
        """First of the directions of each touch's force."""
        return self.place(self.touches) + self.steps * touch

    def scales(self, force: float, slide: float) -> F64:
        """Sizes of all directions for forces and places that change so fast, (r,)."""
        sizes = np.ones(self.total)
        sizes[self.place(0) : self.place(self.touches)] = slide * self.interval
        sizes[self.place(self.touches) :] = force
        return sizes


def choose_scales(columns: Columns, seen: F64, away: F64) -> tuple[F64, float]:
    """Choose how fast forces and places change.

    Parameters
    ----------
    columns : Columns
    seen : (m, r) float64
        What each direction does to the measurement.
    away : (m,) float64
        Measurement less the prediction, in units of its noise.

    Returns
    -------
    scales : (r,) float64
    likelihood : float
        Its logarithm, but for what no direction changes.
    """
    gram, towards = seen.T @ seen, seen.T @ away
    best: tuple[float, F64] | None = None
    choices = product(_FORCES, _SLIDES) if columns.touches else [(1.0, 1.0)]
    for force, slide in choices:
        scale = columns.scales(force, slide)
        lower = np.linalg.cholesky(np.eye(len(scale)) + scale[:, None] * gram * scale)
        white = solve_triangular(lower, scale * towards, lower=True, check_finite=False)
        fit = 0.5 * float(white @ white) - float(np.log(np.diag(lower)).sum())
        if best is None or fit > best[0]:
            best = fit, scale
    if best is None:
        raise ValueError("there must be a choice of scales")
    return best[1], best[0]
