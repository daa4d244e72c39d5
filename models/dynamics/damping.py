"""Damping and pitch of a plate, learned from how it rings after a tap."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from models.arrays import F64
from models.dynamics.oscillators import PlateDynamics, Span, span
from models.dynamics.seeing import Seeing

_FEWEST = 4  # frames: two numbers a mode, and something to learn from
_SOUND = 8.0  # standard deviations of a frame by which the loudest mode must ring in the first


@dataclass(frozen=True, eq=False)
class LearnedDamping:
    """How a plate rings.

    Attributes
    ----------
    dynamics : PlateDynamics
        One ratio of damping for all modes, their frequencies all higher by one factor.
    frequency, damping : float
        That factor and that ratio.
    sigma : (float, float)
        Standard deviations of the two.
    """

    dynamics: PlateDynamics
    frequency: float
    damping: float
    sigma: tuple[float, float]


def learn_damping(
    dynamics: PlateDynamics, seeing: Seeing, measured: F64, times: F64, exposure: float
) -> LearnedDamping:
    """Learn damping and frequencies from frames in which nothing touches a plate that rings.

    Amplitude and phase of every mode are free, and eliminated for each trial of the two numbers
    (variable projection, Golub & Pereyra 1973).

    Parameters
    ----------
    dynamics : PlateDynamics
        From the density and damping that are supposed.
    seeing : Seeing
    measured : (N, m) float64
        Frames in units of their noise, all after the release.
    times : (N,) float64, s
        Ends of their exposures.
    exposure : float, s

    Raises
    ------
    ValueError
        There are too few frames, or the plate hardly rings.
    """
    if len(times) < _FEWEST:
        raise ValueError(
            f"damping needs {_FEWEST} frames after a tap, got {len(times)}; record half a second"
        )
    seen = measured @ seeing.basis
    swing = np.asarray(np.linalg.solve(seeing.of_low, seen[0]), dtype=np.float64)
    first = np.abs(swing) * seeing.size
    if first.max() < _SOUND:
        raise ValueError(
            f"the plate rings by {first.max():.2g} standard deviations of a frame, and {_SOUND:g}"
            " are needed to learn its damping; tap it harder"
        )
    loud = first > 1.0

    def left(unknown: F64) -> F64:
        trial = dynamics.scaled(float(np.exp(unknown[0])), float(np.exp(unknown[1])))
        columns = _ringing(trial, seeing, times, exposure)[:, :, :, loud].reshape(seen.size, -1)
        weighed = np.vstack([columns, 1e-6 * np.eye(columns.shape[1])])
        found = np.linalg.lstsq(weighed, np.append(seen.ravel(), np.zeros(columns.shape[1])))[0]
        return seen.ravel() - columns @ found

    start = np.array([0.0, np.log(dynamics.damping[0])])
    trials = [start + np.array([0.0, shift]) for shift in (-1.0, 0.0, 1.0)]
    fits = [
        least_squares(left, trial, x_scale=(0.01, 0.3), diff_step=[1e-4, 1e-4]) for trial in trials
    ]
    fit = min(fits, key=lambda one: float(one.cost))
    frequency, damping = np.exp(np.asarray(fit.x, dtype=np.float64)).tolist()
    slope = np.asarray(fit.jac, dtype=np.float64)
    spread = np.linalg.inv(slope.T @ slope) * max(2 * fit.cost / seen.size, 1.0)
    sigma = np.sqrt(np.diag(spread)) * (frequency, damping)
    known = dynamics.scaled(frequency, damping)
    return LearnedDamping(known, frequency, damping, (float(sigma[0]), float(sigma[1])))


def _ringing(dynamics: PlateDynamics, seeing: Seeing, times: F64, exposure: float) -> F64:
    """Give what each frame shows of each mode's state before the first, (N, k, 2, k)."""
    columns: list[F64] = []
    state = np.zeros((2, 2, len(dynamics.omega)))
    state[0, 0] = state[1, 1] = 1.0
    before = float(times[0]) - exposure
    known: dict[float, Span] = {}
    for time in times.tolist():
        interval = round(time - before, 7)
        step = known.get(interval) or known.setdefault(interval, span(dynamics, interval, exposure))
        mean = np.einsum("ak,abk->bk", step.seen, state)
        columns.append(seeing.of_low[:, None, :] * mean)
        state = np.einsum("abk,bck->ack", step.carry, state)
        before = time
    return np.array(columns)
