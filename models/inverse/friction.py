"""What friction of a finger adds to the covariance of touches.

A force along the touched face acts half a thickness above the middle plane and turns the plate, as
the touch would that lies aside by h/2 times the force along over that into the plate. No
measurement tells the two apart: the place is as uncertain as that, and the force is not.
"""

from __future__ import annotations

from dataclasses import replace
from math import inf, sqrt

import numpy as np

import fe
from models.checks import shown
from models.estimate import Estimate


def check_friction(friction: float) -> None:
    """Refuse what is no coefficient of friction.

    Raises
    ------
    ValueError
        If it is negative or no finite number.
    """
    if not 0.0 <= friction < inf:
        raise ValueError(
            f"friction must be a finite number of 0 or more, got {shown(friction)}; it is the"
            " standard deviation of the force along the face over that into the plate, 0.2 or so"
        )


def friction_error(plate: fe.Plate, friction: float) -> float:
    """RMS distance by which friction puts a touch off where nobody asks for it, mm.

    Parameters
    ----------
    plate : fe.Plate
    friction : float
        See `with_friction`.
    """
    return friction * plate.thickness / sqrt(2.0)


def with_friction(estimate: Estimate, plate: fe.Plate, friction: float) -> Estimate:
    """Widen touches by friction, which stays the same as long as a finger rests.

    Parameters
    ----------
    estimate : Estimate
    plate : fe.Plate
    friction : float
        Standard deviation of the force along x, and along y, over that into the plate.
    """
    if not (friction and estimate.count):
        return estimate
    aside = np.zeros((estimate.count, 3))
    aside[:, :2] = (0.5 * friction * plate.material(estimate.xy)[0])[:, None]
    added = np.diag(aside.ravel() ** 2)
    known = np.zeros_like(added) if estimate.systematic is None else estimate.systematic
    return replace(estimate, covariance=estimate.covariance + added, systematic=known + added)
