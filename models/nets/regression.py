"""Regressions on the strains, beside which the nets stand: figure S2 of the paper and more.

Each fit takes a data set and returns a predictor from strain (N, I) to targets (N, D). Strains are
standardised first, as for a net; those that do not vary are left out.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Literal, cast, get_args

import numpy as np

from models.arrays import F64
from models.data.dataset import Dataset
from models.nets.net import scale_strain, scaling

Predictor = Callable[[np.ndarray], np.ndarray]
Basis = Callable[[np.ndarray], np.ndarray]

Fit = Literal["linear", "quadratic", "ridge", "gaussian-process", "nearest"]

# Below this part of the largest singular value a direction of the inputs is rounding.
_ROUNDING = 1e-10

# A Gaussian process without noise on its diagonal has no Cholesky factor.
_JITTER = 1e-8


@dataclass(frozen=True)
class Regression:
    """A regression that can be run and stored: the touches that it is made from, and how.

    A Gaussian process and the nearest touches keep all of them anyway; the others are made anew
    in less time than reading their weights would take.

    Attributes
    ----------
    fit
        Which regression.
    training
        Touches to learn from.

    Raises
    ------
    ValueError
        When `fit` is unknown, or there is not one target for each strain.
    """

    fit: Fit
    training: Dataset

    def __post_init__(self) -> None:
        if self.fit not in get_args(Fit):
            raise ValueError(
                f"regression must be one of {', '.join(get_args(Fit))}, got {self.fit!r}; "
                "use 'quadratic'"
            )
        strain, targets = self.training.strain, self.training.targets
        if strain.ndim != 2 or targets.ndim != 2 or len(strain) != len(targets):
            raise ValueError(
                f"a regression needs one target a strain, got {strain.shape} and {targets.shape}"
            )
        if not (np.isfinite(strain).all() and np.isfinite(targets).all()):
            raise ValueError("a regression needs strains and targets that are finite")

    @cached_property
    def predict(self) -> Predictor:
        """The fit: from strain (N, I) to targets (N, D)."""
        return _FITS[self.fit](self.training)


def linear(training: Dataset) -> Predictor:
    """Fit a constant and a weight for each strain by least squares (figure S2, A and B)."""
    return _fit_weights(training, _with_constant)


def quadratic(training: Dataset) -> Predictor:
    """Fit a constant, each strain and each product of two strains (figure S2, C and D).

    There are more products than touches in the paper's set; of all fits through every touch this
    is the one with the smallest weights.
    """
    return _fit_weights(training, _with_products)


def ridge(training: Dataset) -> Predictor:
    """Fit weights of the strains with a penalty that leaving one touch out chooses."""
    feed = _feed(training)
    inputs, centre = feed(training.strain), training.targets.mean(axis=0)
    left, singular, right = np.linalg.svd(inputs, full_matrices=False)
    seen = left.T @ (training.targets - centre)

    def left_out(penalty: float) -> float:
        """Mean square of the errors at touches left out, from the hat matrix of all."""
        shrink = singular**2 / (singular**2 + penalty)
        hat: F64 = np.einsum("ij,j,ij->i", left, shrink, left) + 1.0 / len(left)
        error: F64 = training.targets - centre - left @ (shrink[:, None] * seen)
        return float(np.mean((error / (1.0 - hat)[:, None]) ** 2))

    penalty = min(singular[0] ** 2 * np.logspace(-14, 0, 57), key=left_out)
    weights = right.T @ ((singular / (singular**2 + penalty))[:, None] * seen)
    return lambda strain: feed(strain) @ weights + centre


def gaussian_process(training: Dataset) -> Predictor:
    """Condition a Gaussian process on the touches, its length chosen by marginal likelihood.

    The covariance is exp(-d² / 2 l²) of the distance d of two standardised inputs, with one length
    for all of them (Rasmussen and Williams 2006, equations 2.25, 2.30 and 4.9).
    """
    from scipy.linalg import cho_factor, cho_solve
    from scipy.optimize import minimize
    from scipy.spatial.distance import cdist

    feed = _feed(training)
    inputs, centre = feed(training.strain), training.targets.mean(axis=0)
    targets = training.targets - centre
    square = cdist(inputs, inputs, "sqeuclidean")

    def kernel(square: np.ndarray, log_length: float) -> np.ndarray:
        return np.exp(-0.5 * square / np.exp(2.0 * log_length))

    def condition(log_length: float) -> tuple[tuple[np.ndarray, bool], np.ndarray]:
        factor = cho_factor(kernel(square, log_length) + _JITTER * np.eye(len(square)), lower=True)
        return factor, cast(F64, cho_solve(factor, targets))

    def unlikely(log_length: np.ndarray) -> float:
        """Return minus the log likelihood, where the variance of the process is its best."""
        factor, weights = condition(log_length[0])
        energy = np.sum(targets * weights, axis=0)
        return float(0.5 * len(targets) * np.log(energy).sum()) + targets.shape[1] * float(
            np.log(np.diag(factor[0])).sum()
        )

    start = 0.5 * np.log(np.median(square))
    best = minimize(unlikely, [start], method="Nelder-Mead", options={"maxiter": 40}).x[0]
    weights = condition(best)[1]
    return lambda strain: (
        kernel(cdist(feed(strain), inputs, "sqeuclidean"), best) @ weights + centre
    )


def nearest(training: Dataset, count: int = 4) -> Predictor:
    """Average the `count` touches with the most similar strains, weighted by 1 / distance."""
    from scipy.spatial import KDTree

    feed = _feed(training)
    tree = KDTree(feed(training.strain))

    def predict(strain: np.ndarray) -> np.ndarray:
        distance, rows = tree.query(feed(strain), count)
        weights = 1.0 / (np.asarray(distance, dtype=np.float64) + 1e-12)
        weights /= weights.sum(axis=1, keepdims=True)
        return np.einsum("nk,nkd->nd", weights, training.targets[rows])

    return predict


def _fit_weights(training: Dataset, basis: Basis) -> Predictor:
    feed = _feed(training)
    weights, *_ = np.linalg.lstsq(basis(feed(training.strain)), training.targets, rcond=_ROUNDING)
    return lambda strain: basis(feed(strain)) @ weights


def _feed(training: Dataset) -> Basis:
    """Standardised strains, without those that do not vary."""
    scale = scaling(training.strain)
    spread = scale_strain(scale, training.strain).std(axis=0)
    return lambda strain: scale_strain(scale, strain)[:, spread > 0.5]


def _with_constant(inputs: np.ndarray) -> np.ndarray:
    return np.column_stack([np.ones(len(inputs)), inputs])


def _with_products(inputs: np.ndarray) -> np.ndarray:
    first, second = np.triu_indices(inputs.shape[1])
    return np.column_stack([_with_constant(inputs), inputs[:, first] * inputs[:, second]])


_FITS: dict[Fit, Callable[[Dataset], Predictor]] = {
    "linear": linear,
    "quadratic": quadratic,
    "ridge": ridge,
    "gaussian-process": gaussian_process,
    "nearest": nearest,
}
