"""What an image says of a deformable plate."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import fe
from models.arrays import F64
from models.estimate import Estimate


class Surface(Enum):
    """What an image says of a deformable plate; the value is the sentence to show."""

    SEEN = "base and touches found"
    NEAR_LIMIT = (
        "the base is near a limit point, where a small touch moves the plate far: place and force"
        " cannot be known; bend it more or twist it less"
    )
    TOO_SOFT = (
        "the touch bends this base by more than its tangent is good for: place and force cannot be"
        " known; press less"
    )
    STRANGE = (
        "no touch explains how the bent plate has moved: it may be pressed at more places than are"
        " looked for, or by more than a finger"
    )
    MOVED_ON = (
        "the base has moved further than the response that was prepared is good for; prepare it"
        " again"
    )
    NO_FIT = (
        "no bend and twist explain the image: the base may be outside of the range, may have"
        " snapped, or something lies before it"
    )


SOFT = 0.1
"""Eigenvalue, in parts of that at rest, below which a small touch or step moves a shape far."""


def shape_verdict(stability: fe.Stability) -> fe.Verdict:
    """Judge a shape whose base is known from an image: STABLE, NEAR_LIMIT or OVERSTRAINED.

    An image does not know the base so well that it could tell on which side of a limit point the
    plate is, so that a shape counts as near one sooner than in `fe.Verdict`. By which way a stable
    shape was found says nothing of it.
    """
    if stability.verdict is fe.Verdict.OVERSTRAINED:
        return fe.Verdict.OVERSTRAINED
    return fe.Verdict.NEAR_LIMIT if stability.eigenvalue < SOFT else fe.Verdict.STABLE


@dataclass(frozen=True, eq=False)
class SurfaceEstimate:
    """A base and the touches on it.

    Attributes
    ----------
    estimate : Estimate
        Touches; UNRESOLVABLE where `surface` says that they cannot be known.
    base : fe.Base
        Bend and twist.
    covariance : (2, 2) float64
        Of bend and twist, mm and degrees.
    surface : Surface
    misfit : float, grey levels²
        Mean square of what is left of the image, of the median tile.
    motion : (K + 6,) float64
        Amplitudes of the response, the camera and the base, from which the next frame starts.
    measured : (K,) float64
        The frame in units of its noise, less what it shows at rest, as touches explain it.
    """

    estimate: Estimate
    base: fe.Base
    covariance: F64
    surface: Surface
    misfit: float
    motion: F64
    measured: F64
