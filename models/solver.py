"""Touches from a measurement: least squares on a forward model, forces free, count from the data.

Levenberg-Marquardt on x, y, F of every touch (Marquardt 1963) with the exact Jacobian; touches are
added one by one, each where it explains most of what is left, as long as χ² falls by more than
chance allows.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import chdtrc

import fe
from models.estimate import Estimate, Result
from models.forward import Forward, gauges
from models.search import Search, prepare_search

GAIN = 20.0  # fall of χ² that a touch must bring; nothing false was seen above it in 500 frames
CLEAR = 10.0  # times `GAIN`: no doubt that a touch is there
STEPS = 40  # Levenberg-Marquardt steps; five are usual
SETTLED = 1e-6  # fall of χ² below which a fit has settled: a thousandth of a standard deviation


def solve(
    strain: NDArray,
    influence: fe.Influence,
    sigma: ArrayLike,
    count: int | None = None,
    most: int = 4,
) -> Estimate:
    """Find touches from strain at gauges.

    Parameters
    ----------
    strain : (M, 3) float64, strain
        exx, eyy, exy at the gauges of `influence`; NaN for a channel that is missing.
    influence : fe.Influence
    sigma : float, (M,) or (M, 3), strain
        Standard deviation of each channel.
    count : int, optional
        Number of touches where it is known; found from the data otherwise.
    most : int
        Largest number of touches looked for.

    Raises
    ------
    ValueError
        If strain or sigma do not fit the gauges, or nothing is measured.
    """
    strain = np.asarray(strain, dtype=np.float64)
    expected = (len(influence.gauges), 3)
    if strain.shape != expected:
        raise ValueError(f"strain must be {expected} for these gauges, got shape {strain.shape}")
    spread = np.asarray(sigma, dtype=np.float64)
    spread = np.broadcast_to(spread[:, None] if spread.ndim == 1 else spread, expected)
    forward = gauges(influence, np.where(np.isnan(strain), np.inf, spread))
    return find(forward.whiten(strain), prepare_search(forward), count=count, most=most)


def find(
    measured: NDArray,
    search: Search,
    *,
    start: ArrayLike = (),
    count: int | None = None,
    most: int = 4,
) -> Estimate:
    """Find touches from a whitened measurement.

    Parameters
    ----------
    measured : (m,) float64
        In units of its noise.
    search : Search
        Forward model with its candidates.
    start : (n, 3) array, mm, mm, N
        x, y, F of the last frame's touches, where there are any: the fit begins there.
    count : int, optional
        Number of touches where it is known.
    most : int
        Largest number of touches looked for.
    """
    limit = most if count is None else count
    touches = np.array(start, dtype=np.float64).reshape(-1, 3)[:limit]
    if len(touches):
        touches = _descend(measured, search, touches)
        if count is None:
            touches = _without_idle(measured, search, touches)
    least = GAIN if count is None else 0.0
    while len(touches) < limit:
        grown = _grow(measured, search, touches, least)
        if grown is None:
            break
        touches = grown
    return _describe(measured, search, touches)


def _predict(forward: Forward, touches: NDArray) -> NDArray[np.float64]:
    return touches[:, 2] @ forward.response(touches[:, :2])


def _chi2(measured: NDArray, forward: Forward, touches: NDArray) -> float:
    residual = measured - _predict(forward, touches) if len(touches) else measured
    return float(residual @ residual)


def _jacobian(forward: Forward, touches: NDArray) -> tuple[NDArray, NDArray]:
    """Prediction (m,) and its derivative in x1, y1, F1, x2, … (m, 3n)."""
    response = forward.response(touches[:, :2])
    gradient = forward.gradient(touches[:, :2]) * touches[:, 2, None, None]
    columns = np.concatenate([gradient, response[:, :, None]], axis=2)  # (n, m, 3)
    return touches[:, 2] @ response, columns.transpose(1, 0, 2).reshape(response.shape[1], -1)


def _descend(measured: NDArray, search: Search, touches: NDArray) -> NDArray[np.float64]:
    """Levenberg-Marquardt from `touches`, kept on the plate and with forces of one sign."""
    lower, upper = search.bounds
    damping, (predicted, jacobian) = 1e-4, _jacobian(search.forward, touches)
    residual = measured - predicted
    for _ in range(STEPS):
        normal, slope = jacobian.T @ jacobian, jacobian.T @ residual
        ridge = np.diag(normal).clip(1e-300)
        step = np.linalg.solve(normal + np.diag(damping * ridge), slope).reshape(-1, 3)
        trial = touches + step
        trial[:, :2] = np.clip(trial[:, :2], lower, upper)
        trial[:, 2] = trial[:, 2].clip(0.0)
        predicted, trial_jacobian = _jacobian(search.forward, trial)
        left = measured - predicted
        fall = residual @ residual - left @ left
        if fall < 0:
            damping *= 10.0
            if damping > 1e8:
                break
            continue
        small = fall < SETTLED
        touches, residual, jacobian = trial, left, trial_jacobian
        damping = max(damping / 10.0, 1e-12)
        if small:
            break
    return touches


def _grow(
    measured: NDArray, search: Search, touches: NDArray, least: float
) -> NDArray[np.float64] | None:
    """One touch more, where it explains most of what is left; None if χ² falls by `least` or less.

    A candidate of the grid that promises less than half of that is not worth a fit: between the
    candidates a touch is worth little more than on the best of them.
    """
    if len(touches):
        predicted, tangent = _jacobian(search.forward, touches)
    else:
        predicted, tangent = np.zeros_like(measured), np.empty((len(measured), 0))
    residual = measured - predicted
    index, gain = search.best(residual, tangent)
    if gain <= 0.5 * least:
        return None
    response = search.response[index]
    force = max(residual @ response / (response @ response), 0.0)
    grown = _descend(measured, search, np.vstack([touches, [*search.xy[index], force]]))
    fall = residual @ residual - _chi2(measured, search.forward, grown)
    return grown if fall > least else None


def _without_idle(measured: NDArray, search: Search, touches: NDArray) -> NDArray[np.float64]:
    """Drop, weakest first, the touches without which χ² rises by less than `GAIN`.

    A touch whose force stands far out of its own noise needs no second fit to be kept.
    """
    while len(touches):
        variances = np.diag(covariance(search.forward, touches))[2::3]
        evidence = touches[:, 2] ** 2 / variances
        weakest = int(np.argmin(evidence))
        if evidence[weakest] > CLEAR * GAIN:
            break
        fewer = np.delete(touches, weakest, axis=0)
        if len(fewer):
            fewer = _descend(measured, search, fewer)
        rise = _chi2(measured, search.forward, fewer) - _chi2(measured, search.forward, touches)
        if rise >= GAIN:
            break
        touches = fewer
    return touches


def _describe(measured: NDArray, search: Search, touches: NDArray) -> Estimate:
    touches = touches[np.lexsort((touches[:, 1], touches[:, 0]))]
    chi2 = _chi2(measured, search.forward, touches)
    dof = max(len(measured) - 3 * len(touches), 1)
    spread = covariance(search.forward, touches)
    return Estimate(
        xy=touches[:, :2],
        force=touches[:, 2],
        covariance=spread,
        chi2=chi2,
        dof=dof,
        p_value=float(chdtrc(dof, chi2)),
        result=_judge(touches, spread),
    )


def covariance(forward: Forward, touches: NDArray) -> NDArray[np.float64]:
    """Inverse Fisher matrix; infinite variance where the measurement says nothing."""
    if not len(touches):
        return np.empty((0, 0))
    jacobian = _jacobian(forward, touches)[1]
    fisher = jacobian.T @ jacobian
    scale = np.sqrt(np.diag(fisher).clip(1e-300))
    values, vectors = np.linalg.eigh(fisher / np.outer(scale, scale))
    if values[0] < 1e-14:
        return np.diag(np.full(len(fisher), np.inf))
    return (vectors / values) @ vectors.T / np.outer(scale, scale)


def _judge(touches: NDArray, covariance: NDArray) -> Result:
    if not len(touches):
        return Result.NO_TOUCH
    if not np.isfinite(covariance).all():
        return Result.UNRESOLVABLE
    for i in range(len(touches)):
        for j in range(i):
            if not _apart(touches, covariance, i, j):
                return Result.UNRESOLVABLE
    return Result.FOUND


def _apart(touches: NDArray, covariance: NDArray, i: int, j: int) -> bool:
    """Whether the places of two touches differ by three standard deviations or more."""
    a, b = slice(3 * i, 3 * i + 2), slice(3 * j, 3 * j + 2)
    between = touches[i, :2] - touches[j, :2]
    spread = covariance[a, a] + covariance[b, b] - covariance[a, b] - covariance[b, a]
    return bool(between @ np.linalg.solve(spread, between) >= 9.0)
