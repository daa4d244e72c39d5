"""What the motion of tiles errs by: pixels anew in each frame, aliasing by the motion itself."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from models.estimate import Estimate


@dataclass(frozen=True)
class MotionErrors:
    """Errors of a frame, by the noise for which it is whitened.

    Where that holds for any motion, what aliasing leaves of half a pixel is in it, which is not
    there while less moves.

    Attributes
    ----------
    pixels : float
        Variance by the pixels of the frame and of the reference, 1 where there is no aliasing.
    aliased : float
        Variance that aliasing leaves of the motion of this frame.
    gain : float
        Standard deviation of the fraction by which all motion is measured too large.
    """

    pixels: float = 1.0
    aliased: float = 0.0
    gain: float = 0.0


OF_PIXELS = MotionErrors()
"""Errors without aliasing."""


def with_motion_errors(estimate: Estimate, errors: MotionErrors) -> Estimate:
    """Give touches the errors of their own motion, of which aliasing stays as long as they do.

    Parameters
    ----------
    estimate : Estimate
        By the noise that the errors are over.
    errors : MotionErrors
    """
    covariance, known = estimate.covariance, estimate.systematic
    if errors == OF_PIXELS or not estimate.count or not np.isfinite(covariance).all():
        return estimate
    systematic = np.zeros_like(covariance) if known is None else known
    noise = covariance - systematic
    larger = np.kron(errors.gain * estimate.force, [0.0, 0.0, 1.0])
    systematic = systematic + errors.aliased * noise + np.outer(larger, larger)
    return replace(estimate, covariance=systematic + errors.pixels * noise, systematic=systematic)
