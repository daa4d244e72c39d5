"""Which estimated touch is which true one: matched before anything is scored."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

import fe
from models.arrays import F64
from models.estimate import Estimate


def pair(reported: F64, true: F64) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Pair places reported (n, 2) with true ones (m, 2) so that the sum of distances is the least.

    Returns
    -------
    reported, true : (k,) int
        Indices of the pairs, k = the smaller of n and m.
    """
    return linear_sum_assignment(np.linalg.norm(reported[:, None] - true, axis=2))


def match(estimate: Estimate, truth: tuple[fe.Touch, ...]) -> tuple[F64, F64, F64]:
    """Errors of the touches that can be paired, the pairing of least total distance.

    Returns
    -------
    position : (k,) float64, mm
        Distances, k = the smaller of both counts.
    force : (k,) float64, N
        Estimated less true force.
    true_force : (k,) float64, N
    """
    there = np.array([(touch.x, touch.y, touch.force) for touch in truth]).reshape(-1, 3)
    found, true = pair(estimate.xy, there[:, :2])
    distance = np.linalg.norm(estimate.xy[found] - there[true, :2], axis=1)
    return distance, estimate.force[found] - there[true, 2], there[true, 2]
