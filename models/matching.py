"""Which estimated touch is which true one: matched before anything is scored."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

import fe
from models.estimate import Estimate


def match(
    estimate: Estimate, truth: tuple[fe.Touch, ...]
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Errors of the touches that can be paired, the pairing of least total distance.

    Returns
    -------
    position : (k,) float64, mm
        Distances, k = the smaller of both counts.
    force : (k,) float64, N
        Estimated less true force.
    true_force : (k,) float64, N
    """
    if not estimate.count or not truth:
        return np.empty(0), np.empty(0), np.empty(0)
    places = np.array([(touch.x, touch.y) for touch in truth])
    forces = np.array([touch.force for touch in truth])
    distance = np.linalg.norm(estimate.xy[:, None] - places[None], axis=2)
    found, true = linear_sum_assignment(distance)
    return distance[found, true], estimate.force[found] - forces[true], forces[true]
