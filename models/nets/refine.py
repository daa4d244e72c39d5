"""A net's touches made better by a few steps of the solver: the third estimator."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from models.arrays import F64
from models.forward.linear import Forward


def refine(measured: F64, forward: Forward, start: ArrayLike, steps: int = 2) -> F64:
    """Take a few Gauss-Newton steps from touches that are nearly right.

    Each costs one reading of the forward model and no search, so the time is known beforehand.
    From a start that is far off the steps may lead nowhere; `models.find` does not.

    Parameters
    ----------
    measured : (m,) float64
        In units of its noise.
    forward : Forward
    start : (n, 3) array, mm, mm, N
        x, y, F that a net reported.
    steps : int

    Returns
    -------
    (n, 3) float64, mm, mm, N

    Raises
    ------
    ValueError
        If the measurement does not fit the forward model, or a number of steps is negative.
    """
    if steps < 0:
        raise ValueError(f"number of solver steps must be 0 or more, got {steps}; use 2")
    touches = np.array(start, dtype=np.float64).reshape(-1, 3)
    for _ in range(steps):
        predicted, jacobian = forward.read(touches)
        if measured.shape != predicted.shape:
            raise ValueError(
                f"measurement must have shape {predicted.shape} as the forward model, "
                f"got {measured.shape}"
            )
        step = np.linalg.lstsq(jacobian.T, measured - predicted, rcond=None)[0]
        touches = touches + step.reshape(-1, 3)
        touches[:, :2] = np.clip(touches[:, :2], 0.0, forward.plate.size)
    return touches
