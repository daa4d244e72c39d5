"""Displacement of points of interest, with uncertainty and an honest status for each."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from dic.arrays import F64, I8, Mask
from dic.fields.grid import Grid


class Status(IntEnum):
    """What became of a point of interest."""

    OK = 0
    EXCLUDED = 1  # the ROI leaves out its centre, or more than half of its subset
    FLAT = 2  # too little contrast in some direction to follow
    DARK = 3  # too much of the subset lies at black
    SATURATED = 4  # too much of the subset lies at white
    OUTSIDE = 5  # most of the subset lies out of the image, or some of it has moved there
    LOW_CORRELATION = 6  # the pattern was not found again
    NOT_CONVERGED = 7  # the iteration still moved when it was stopped
    DISTURBED = 8  # far from what the others leave over: hidden in part, or bent beyond its order
    AMBIGUOUS = 9  # the pattern repeats: another motion, a period away, is as good
    BROKEN = 10  # two motions in one subset, as across a crack
    SPLIT = 11  # measured by the larger side of a subset across a crack

    @property
    def sentence(self) -> str:
        """What became of the point, and what can be done about it."""
        return _SENTENCES[self.name]


_SENTENCES = {
    "OK": "measured",
    "EXCLUDED": "the ROI leaves it out; draw the ROI wider if it should be measured",
    "FLAT": "too little contrast above the noise; take a larger subset, more light or a pattern",
    "DARK": "too much of the subset is black; expose longer or light the pattern",
    "SATURATED": "too much of the subset is white; expose shorter",
    "OUTSIDE": "the subset has left the image; keep the pattern in view or measure fewer points",
    "LOW_CORRELATION": "the pattern was not found again; check focus, light and what hides it, or "
    "follow the test frame by frame",
    "NOT_CONVERGED": "the iteration still moved when it was stopped; take a larger subset",
    "DISTURBED": "the subset is hidden in part or bends beyond its shape function; take a smaller "
    "subset or order 2",
    "AMBIGUOUS": "the pattern repeats, and another motion is as good; give a guess to within half "
    "a period, or print a pattern without one",
    "BROKEN": "two motions in one subset, as across a crack; split the subset, draw the crack into "
    "the ROI or take a smaller subset",
    "SPLIT": "measured by the larger side of a subset across a crack; strain there needs a smaller "
    "subset or a ROI",
}


@dataclass(frozen=True)
class DisplacementField:
    """Displacement measured at N points, in px of the reference; NaN unless OK or SPLIT.

    Attributes
    ----------
    xy : (N, 2) float64, px
    u, v : (N,) float64, px
        Displacement along x (columns, to the right) and y (rows, downwards).
    sigma_u, sigma_v : (N,) float64, px
        One standard deviation, from the residual of the subset itself (see `dic.correlate`).
    gradient : (N, 2, 2) float64
        [[∂u/∂x, ∂u/∂y], [∂v/∂x, ∂v/∂y]] of the subset; zero at order 0.
    sigma_gradient : (N, 2, 2) float64
    zncc : (N,) float64
        Zero-normalised cross-correlation of the subset with the frame, -1…1.
    iterations : (N,) int16
        Iterations until the point stood still.
    valid_fraction : (N,) float64
        Fraction of the pixels of the subset that were used: less than 1 where the ROI or the
        border of the image takes a part.
    status : (N,) int8
        A `Status` each.
    subset : int, px
    order : int
        Order of the shape function.
    grid : Grid or None
        The grid, row by row, or None for scattered points.
    prefilter : float, px
        Standard deviation of the Gaussian that both images passed; 0 is none.
    gauge : (N,) float64 or None, px
        Side of the square that has the noise of the window that the data chose at each point, of a
        field of `dic.adaptive_field`; None where the subset is the window of all.
    """

    xy: F64
    u: F64
    v: F64
    sigma_u: F64
    sigma_v: F64
    gradient: F64
    sigma_gradient: F64
    zncc: F64
    iterations: NDArray[np.int16]
    valid_fraction: F64
    status: I8
    subset: int
    order: int
    grid: Grid | None
    prefilter: float = 0.0
    gauge: F64 | None = None

    @property
    def valid(self) -> Mask:
        """(N,) True where the point was measured."""
        return self.status == Status.OK

    @property
    def ux(self) -> F64:
        """∂u/∂x of the subset, (N,)."""
        return self.gradient[:, 0, 0]

    @property
    def uy(self) -> F64:
        """∂u/∂y of the subset, (N,)."""
        return self.gradient[:, 0, 1]

    @property
    def vx(self) -> F64:
        """∂v/∂x of the subset, (N,)."""
        return self.gradient[:, 1, 0]

    @property
    def vy(self) -> F64:
        """∂v/∂y of the subset, (N,)."""
        return self.gradient[:, 1, 1]
