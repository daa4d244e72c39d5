"""A press on the plate as it was measured, with what is known of its place and force."""

from __future__ import annotations

from dataclasses import dataclass
from math import hypot, sqrt

import numpy as np

from models.arrays import F64
from models.checks import read_array
from models.motion_errors import OF_PIXELS, MotionErrors


@dataclass(frozen=True, eq=False)
class Press:
    """One press on the plate, as it was measured.

    Attributes
    ----------
    measured : (m,) float64
        Whitened by the forward model: mean of frames.
    touch : (3,) float64, mm, mm, N
        x, y, F where they are known; where not, any start near by.
    sigma : (3,) float64, mm, mm, N
        Their standard deviations; infinite where unknown.
    noise : float
        Standard deviation of `measured` by the press's own frames: 1 for one, 1/√n for the mean of
        n, where the reference is without noise.
    whitening : (m, K + U) float64, optional
        Where a part of the pattern was hidden: that of the others, see `BenchForward`.
    reference : float
        Standard deviation of what the noise of the reference adds, which all presses share.
    moved : (R,) float64 or None
        By how much the camera has moved since the reference was taken, in units of the motions that
        were taken out of `measured`, see `with_tilts`. None where it is not known, or nothing more
        is to be taken off; see `TilePattern.uncorrected`.
    """

    measured: F64
    touch: F64
    sigma: F64
    noise: float = 1.0
    whitening: F64 | None = None
    reference: float = 0.0
    moved: F64 | None = None

    @classmethod
    def of_frames(
        cls,
        measured: F64,
        touch: F64,
        sigma: F64,
        frames: tuple[int, int],
        whitening: F64 | None,
        moved: F64 | None = None,
        errors: MotionErrors = OF_PIXELS,
    ) -> Press:
        """Build a press from the mean of frames, and the reference from the mean of others.

        Parameters
        ----------
        measured : (m,) float64
            In units of the noise of one frame against the reference.
        touch, sigma : (3,) float64
        frames : tuple of int
            Of the press, and of the reference.
        whitening : (m, K + U) float64 or None
        moved : (R,) float64 or None
        errors : MotionErrors
            Of one frame; what aliasing leaves is the same in all of a press, and a gain is that of
            all presses, which Young's modulus takes.
        """
        own, still = (errors.pixels / count for count in frames)
        one = 1.0 + 1.0 / frames[1]
        noise = min(sqrt(own / one + errors.aliased), 1.0)
        return cls(measured, touch, sigma, noise, whitening, sqrt(still / one), moved)

    @property
    def total_noise(self) -> float:
        """Standard deviation of `measured`, the noise of the reference included."""
        return min(hypot(self.noise, self.reference), 1.0)

    def __post_init__(self) -> None:
        size = (3,)
        touch = read_array("touch of a press", self.touch, "x, y, F", size)
        sigma = read_array("sigma of a press", self.sigma, "of x, y, F", size)
        if not np.isfinite(touch).all() or not (sigma > 0).all():
            raise ValueError(
                f"a press must have a finite start and positive σ, got {touch} and {sigma}; write"
                " inf for the σ of what is not known"
            )
        if not 0 < self.noise <= 1:
            raise ValueError(f"noise of a press must lie in 0 to 1, got {self.noise:g}; use 1/√n")
        if not 0 <= self.reference <= 1:
            raise ValueError(
                f"noise of the reference must lie in 0 to 1, got {self.reference:g}; use 1/√n of"
                " its frames"
            )
