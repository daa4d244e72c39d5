"""A pattern of the sensor, dirt or unequal pixels: how much of it there is, by what frames show.

What stands still while the plate moves leaves the more of a tile unexplained the farther that
moved, whatever it shows, see `dic.fixed_pattern_sums`. Frames are read as if there was none until
it is known.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import inf, sqrt

import numpy as np

import dic
from models import TileFit
from rig.system.arrays import F64, Mask

MOVED = 0.3  # px, which some tile must move by: below it this and aliasing look alike
GROUPS = 16  # of tiles that moved by about as much, each of which counts by its median:
# where a hand covers a part of a tile, that is no pattern of the sensor
SURE = 6.0  # standard deviations of its variance, below which there is none
KNOWN = 0.01  # of the noise of a frame: a variance that is known to this is not measured again


@dataclass(frozen=True)
class FixedPattern:
    """What frames have shown of a pattern of the sensor.

    Attributes
    ----------
    precision : float, grey levels⁻⁴
        Of its variance; 0 where no frame has shown anything.
    shown : float, grey levels⁻²
        Its variance times the precision.
    """

    precision: float = 0.0
    shown: float = 0.0

    @classmethod
    def of(cls, variance: float, sigma: float) -> FixedPattern:
        """Return what presses have shown, see `stated`."""
        return cls(sigma**-2.0, variance * sigma**-2.0)

    @property
    def variance(self) -> float:
        """Its variance, grey levels²; 0 where it may be noise alone."""
        sure = self.shown > SURE * sqrt(self.precision)
        return self.shown / self.precision if sure else 0.0

    @property
    def stated(self) -> tuple[float, float]:
        """Its variance and the standard deviation of that, grey levels²; infinite if not known."""
        return (variance, self.precision**-0.5) if (variance := self.variance) else (0.0, inf)

    @property
    def level(self) -> float:
        """Its standard deviation, grey levels."""
        return sqrt(self.variance)

    @property
    def detectable(self) -> float:
        """Standard deviation, grey levels, of one that would be known by now; infinite at first."""
        return sqrt(SURE) * self.precision**-0.25 if self.precision else inf

    def with_frame(self, frame: FixedPattern) -> FixedPattern:
        """Put what another frame shows with it."""
        return FixedPattern(self.precision + frame.precision, self.shown + frame.shown)

    def is_known(self, noise: float) -> bool:
        """Whether frames of this noise, grey levels, need not be looked at any more."""
        return self.precision * (KNOWN * noise**2) ** 2 > 1.0

    def taken_out(self, reference: dic.TileReference, sums: dic.TileSums) -> dic.TileSums:
        """Return the sums of a frame as they would be without it."""
        if not (variance := self.variance):
            return sums
        added = dic.fixed_pattern_sums(reference, sums.flow)[0]
        return replace(sums, gradient=sums.gradient - variance * added)


NO_FIXED_PATTERN = FixedPattern()
"""Where no frame has shown anything."""


def fixed_pattern(
    reference: dic.TileReference, sums: dic.TileSums, fit: TileFit, visible: Mask
) -> FixedPattern:
    """Find what a frame shows of it.

    What aliasing leaves of a motion u grows with it too, but goes as sin²(πu) along each axis: it
    returns to nothing at a pixel, so that tiles which move by more than a half separate the two.

    Parameters
    ----------
    reference : TileReference
    sums : TileSums
        Of the frame.
    fit : TileFit
        Of these.
    visible : (T,) bool
        Tiles that show the plate.
    """
    flow = sums.flow[visible]
    if len(flow) < GROUPS or np.abs(flow).max() < MOVED:
        return NO_FIXED_PATTERN
    added = dic.fixed_pattern_sums(reference, sums.flow)[1][visible] / reference.tiles.size**2
    aliased = np.square(np.sin(np.pi * flow)).sum(axis=1)
    left = fit.unexplained[visible] / fit.freedom
    groups = np.array_split(np.argsort(added), GROUPS)
    usual = np.array([np.median(left[group]) for group in groups])
    # Of a median of normal numbers, each with the variance of one of χ².
    scatter = np.sqrt(np.pi / (fit.freedom * len(flow) / GROUPS)) * np.maximum(usual, 1e-6)
    beside = [np.ones(GROUPS), [aliased[group].mean() for group in groups]]
    away = [added[group].mean() for group in groups]
    return _slope(usual / scatter, np.array(away) / scatter, np.array(beside) / scatter)


def _slope(seen: F64, along: F64, beside: F64) -> FixedPattern:
    """Fit `seen` (n,) by `along` (n,) and what stands beside it (k, n), all in units of noise.

    Where they do not fit, the slope is as much less sure.
    """
    basis = np.linalg.qr(beside.T)[0]
    seen, along = (each - basis @ (basis.T @ each) for each in (seen, along))
    precision, shown = float(along @ along), float(along @ seen)
    if not precision > 0.0:
        return NO_FIXED_PATTERN
    chi2 = (float(seen @ seen) - shown**2 / precision) / (len(seen) - len(beside) - 1)
    return FixedPattern(precision / max(chi2, 1.0), shown / max(chi2, 1.0))
