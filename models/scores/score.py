"""Scores: how far predicted touches lie from the true ones."""

from dataclasses import dataclass
from itertools import permutations

import numpy as np


@dataclass(frozen=True)
class Score:
    """Position error over a data set.

    Attributes
    ----------
    count
        Number of touches.
    mean, p50, p95, max
        Mean, median, 95th percentile and largest error, mm; the mean is the loss of equation 1.
    fraction
        Part of the touches, 0 to 1, whose error is below `limit`.
    limit
        mm.
    """

    count: int
    mean: float
    p50: float
    p95: float
    max: float
    fraction: float
    limit: float


def position_error(true: np.ndarray, predicted: np.ndarray) -> np.ndarray:
    """Return the distance of each predicted place from the true one.

    Parameters
    ----------
    true, predicted
        (N, 2), mm, in the same order.

    Returns
    -------
    (N,) float64, mm: the local loss of the paper; its mean is equation 1.

    Raises
    ------
    ValueError
        When the shapes differ or are not (N, 2).
    """
    true, predicted = np.asarray(true, dtype=float), np.asarray(predicted, dtype=float)
    if true.ndim != 2 or true.shape[1] != 2 or true.shape != predicted.shape:
        raise ValueError(
            f"true and predicted places must both be (N, 2), got {true.shape} and "
            f"{predicted.shape}; pair them first"
        )
    return np.hypot(*(predicted - true).T)


def matched_error(true: np.ndarray, predicted: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the distances of several touches, paired so that their sum is the least.

    Parameters
    ----------
    true, predicted
        (N, k, 2), mm.

    Returns
    -------
    error
        (N, k) float64, mm, of each true touch.
    order
        (N, k) int, which predicted touch was paired with each true one.

    Raises
    ------
    ValueError
        When the shapes differ or are not (N, k, 2).
    """
    true, predicted = np.asarray(true, dtype=float), np.asarray(predicted, dtype=float)
    if true.ndim != 3 or true.shape[2] != 2 or true.shape != predicted.shape:
        raise ValueError(
            f"true and predicted touches must both be (N, k, 2), got {true.shape} and "
            f"{predicted.shape}; give x and y of as many touches"
        )
    orders = np.array(list(permutations(range(true.shape[1]))))
    errors = np.linalg.norm(predicted[:, orders] - true[:, None], axis=3)
    best = errors.sum(axis=2).argmin(axis=1)
    return errors[np.arange(len(true)), best], orders[best]


def score_positions(error: np.ndarray, limit: float = 0.5) -> Score:
    """Return the figures of `error` (N,) mm; `limit` 0.5 mm is the paper's, below its figure 3B.

    Raises
    ------
    ValueError
        When there is no error to score.
    """
    if len(error) == 0:
        raise ValueError("a score needs at least 1 touch, got 0; give a data set that is not empty")
    p50, p95 = np.percentile(error, [50, 95])
    return Score(
        count=len(error),
        mean=float(np.mean(error)),
        p50=float(p50),
        p95=float(p95),
        max=float(np.max(error)),
        fraction=float(np.mean(error < limit)),
        limit=limit,
    )
