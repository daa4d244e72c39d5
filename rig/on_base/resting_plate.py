"""What a bent plate shows while nothing touches it: what the elements of its shape leave."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

import models
from models import Estimate, Result
from rig.live.baseline import drift_weight, update_drift
from rig.system.arrays import F64

FRAMES = 16
"""Untouched frames after which it is known."""

CARRIED = 8  # frames for which what a shape near by showed counts
CLEAR = 3.0  # standard deviations of a force, beyond which a touch is one while these are taken


@dataclass(frozen=True, eq=False)
class RestingPlate:
    """Amplitudes of a response that untouched frames show.

    Attributes
    ----------
    mean : (K,) float64
        Over the frames so far.
    frames : int
        How many these were.
    known : bool
        Whether these were enough; until then touches have what the elements leave in σ.
    """

    mean: F64
    frames: int = 0
    known: bool = False

    @property
    def amplitudes(self) -> F64 | None:
        """What frames are to be read without; None until it is known."""
        return self.mean if self.known else None

    def taken(self, shape: models.PreparedShape, measured: F64, seconds: float) -> RestingPlate:
        """Take an untouched frame into the mean, as a drift that is followed once it is known.

        Parameters
        ----------
        shape : models.PreparedShape
        measured : (K,) float64
            What a frame shows, less `amplitudes`, in units of its noise.
        seconds : float
            Since the frame before.
        """
        weight = 1.0 / (self.frames + 1)
        if self.known:
            weight = max(weight, drift_weight(seconds))
        before = self.mean if self.known else (1.0 - weight) * self.mean
        mean = update_drift(before, shape.pattern, measured, shape.noise, weight)
        frames = self.frames + 1
        return RestingPlate(mean, frames, self.known or frames >= FRAMES)

    def carried(self, shape: models.PreparedShape, before: models.PreparedShape) -> RestingPlate:
        """Take it over to a shape near by; what is not known yet begins again."""
        if not self.known:
            return unknown_rest(shape)
        return replace(self, mean=shape.carried(self.mean, before), frames=CARRIED)


def unknown_rest(shape: models.PreparedShape) -> RestingPlate:
    """Know nothing of a shape at rest yet."""
    return RestingPlate(np.zeros(shape.response.count))


def is_untouched(estimate: Estimate, rest: RestingPlate) -> bool:
    """Whether a frame shows the plate at rest, as far as that can be known."""
    if estimate.result is Result.NO_TOUCH:
        return True
    if rest.known:
        return False
    sigma = np.sqrt(np.diag(estimate.covariance)[2::3])
    return bool((np.abs(estimate.force) < CLEAR * sigma).all())
