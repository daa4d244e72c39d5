"""What a demo takes of a frame: its time, its touches, and what presses in all."""

from __future__ import annotations

from dataclasses import dataclass
from math import hypot, isfinite, sqrt

import numpy as np

from models import Result
from rig.live.snapshot import Mark, Snapshot


@dataclass(frozen=True)
class Load:
    """What presses on the plate in all, or why that is not known.

    Attributes
    ----------
    force, sigma : float, N
        Sum of all forces and its standard deviation; NaN where it is not known.
    reason : str
        Why it is not known, as a sentence; empty where it is.
    """

    force: float
    sigma: float
    reason: str = ""

    def above(self, zero: Load) -> Load:
        """Return what is more than at `zero`, measured apart."""
        return Load(self.force - zero.force, hypot(self.sigma, zero.sigma), self.reason)


NO_LOAD = Load(0.0, 0.0)


@dataclass(frozen=True)
class Moment:
    """One frame as demos see it.

    Attributes
    ----------
    time : float, s
        Capture time on the clock of the loop.
    touches : tuple of Mark
        Where they will be when the light arrives.
    load : Load
    """

    time: float
    touches: tuple[Mark, ...] = ()
    load: Load = NO_LOAD


def load_of(snapshot: Snapshot) -> Load:
    """Sum of the forces of a frame, with the σ that follows from their whole covariance."""
    estimate = snapshot.estimate
    if not snapshot.fresh or estimate is None:
        return Load(np.nan, np.nan, "no frames come")
    if estimate.result is Result.UNRESOLVABLE:
        return Load(np.nan, np.nan, estimate.result.value)
    of_forces = estimate.covariance[2::3, 2::3]
    variance = float(of_forces.sum())
    if not (isfinite(variance) and variance >= 0.0):
        return Load(np.nan, np.nan, "the uncertainty of the forces is not known")
    return Load(float(estimate.force.sum()), sqrt(variance))
