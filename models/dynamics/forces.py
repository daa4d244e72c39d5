"""Forces between frames: values at knots, driven by steps of their rate.

The force of a finger is an integrated Ornstein-Uhlenbeck process: its rate changes by white noise
and is forgotten in some tenths of a second, so that a force that rests goes on resting.
"""

from __future__ import annotations

import numpy as np

from models.arrays import F64
from models.compiled import njit

_KEPT = 0.2  # s for which a force keeps its rate


@njit(cache=True, nogil=True)
def force_knots(steps: F64) -> tuple[F64, F64]:
    """Force and rate at p + 1 knots, by what they begin with and by noise between the knots.

    Parameters
    ----------
    steps : (p,) float64, s

    Returns
    -------
    forces, rates : (p + 1, 2 + p) float64
        By force and rate at the first knot, and by a unit of noise in each step: N/s per √s.
    """
    count = len(steps)
    forces, rates = np.zeros((count + 1, 2 + count)), np.zeros((count + 1, 2 + count))
    forces[0, 0] = rates[0, 1] = 1.0
    for k in range(count):
        step = steps[k]
        rates[k + 1] = np.exp(-step / _KEPT) * rates[k]
        rates[k + 1, 2 + k] += np.sqrt(step)
        forces[k + 1] = forces[k] + 0.5 * step * (rates[k] + rates[k + 1])
    return forces, rates
