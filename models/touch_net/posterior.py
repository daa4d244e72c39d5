"""What a touch net says of a measurement: how many touches, and where each may be."""

# SciPy states its types in part.
# pyright: reportUnknownArgumentType=false, reportUnknownVariableType=false

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import ndtr

from models.arrays import F32, F64, I64
from models.compiled import njit
from models.touch_net.network import EACH, PARTS


@dataclass(frozen=True, eq=False)
class Mixture:
    """Normal distributions that are mixed, for x, y, F of each of n touches.

    Attributes
    ----------
    weight : (n, P) float64
    mean : (n, P, 3) float64, mm, mm, N
    factor : (n, P, 3, 3) float64, mm and N
        Lower Cholesky factors of their covariances.
    """

    weight: F64
    mean: F64
    factor: F64

    def moments(self) -> tuple[F64, F64]:
        """Mean (n, 3) and covariance (n, 3, 3) of each touch."""
        return _moments(self.weight, self.mean, self.factor)

    def joint(self, spread: F64) -> tuple[I64, F64, F64]:
        """Order of the touches by x, and in it their mean (n, 3) and covariance (3n, 3n).

        Parameters
        ----------
        spread : (3n, 3n) float64
            Covariance of the touches as they were fitted, in the order of the mixture.
        """
        return _joint(self.weight, self.mean, self.factor, spread)

    def below(self, touches: F64) -> F64:
        """Probability that x, y and F of each touch lie below those of `touches` (n, 3)."""
        sigma = np.sqrt(np.square(self.factor).sum(axis=3))
        lower: F64 = ndtr((touches[:, None] - self.mean) / sigma)
        return np.einsum("np,npk->nk", self.weight, lower)

    def draw(self, rng: np.random.Generator, count: int) -> F64:
        """Draw each touch `count` times, (count, n, 3)."""
        number = len(self.weight)
        edges = np.cumsum(self.weight, axis=1)
        part = (rng.random((count, number, 1)) > edges[:, :-1]).sum(axis=2)
        row = np.arange(number)
        white = rng.standard_normal((count, number, 3, 1))
        return self.mean[row, part] + (self.factor[row, part] @ white)[..., 0]


def mixture(out: F32 | F64, fitted: F64, factors: F64) -> Mixture:
    """Read the net's numbers (n, 40) about fits (n, 3) in units of their factors (n, 3, 3)."""
    raw = out.astype(np.float64).reshape(len(out), PARTS, EACH)
    return Mixture(*_mixed(raw, fitted, factors, WIDTHS, FIRST))


WIDTHS = np.log([1.0, 1.5, 4.0, 20.0])
FIRST = np.log([0.9, 0.07, 0.02, 0.01])
"""Widths of the parts over what was fitted, and their weights, before any training."""


@njit(cache=True, nogil=True)
def _mixed(raw: F64, fitted: F64, factors: F64, widths: F64, first: F64) -> tuple[F64, F64, F64]:
    """Weights (n, P), means (n, P, 3) and factors (n, P, 3, 3) of numbers (n, P, 10)."""
    number, parts = raw.shape[:2]
    weight, mean = np.empty((number, parts)), np.empty((number, parts, 3))
    factor = np.empty((number, parts, 3, 3))
    for i in range(number):
        own = raw[i, :, 0] + first
        weight[i] = np.exp(own - own.max())
        weight[i] /= weight[i].sum()
        for p in range(parts):
            numbers, lower = raw[i, p], np.zeros((3, 3))
            for k in range(3):
                lower[k, k] = np.exp(min(max(numbers[4 + k] + widths[p], -6.0), 6.0))
            lower[1, 0], lower[2, 0], lower[2, 1] = numbers[7], numbers[8], numbers[9]
            mean[i, p] = fitted[i] + factors[i] @ numbers[1:4]
            factor[i, p] = factors[i] @ lower
    return weight, mean, factor


@njit(cache=True, nogil=True)
def _moments(weight: F64, mean: F64, factor: F64) -> tuple[F64, F64]:
    """Mean (n, 3) and covariance (n, 3, 3)."""
    number = len(weight)
    middle, spread = np.zeros((number, 3)), np.zeros((number, 3, 3))
    for i in range(number):
        for p in range(weight.shape[1]):
            middle[i] += weight[i, p] * mean[i, p]
        for p in range(weight.shape[1]):
            off = mean[i, p] - middle[i]
            spread[i] += weight[i, p] * (factor[i, p] @ factor[i, p].T + np.outer(off, off))
    return middle, spread


@njit(cache=True, nogil=True)
def _joint(weight: F64, mean: F64, factor: F64, spread: F64) -> tuple[I64, F64, F64]:
    middle, each = _moments(weight, mean, factor)
    whole = _with_blocks(np.ascontiguousarray(spread), each)
    order = np.argsort(middle[:, 0])
    sorted_middle, covariance = np.empty_like(middle), np.empty_like(whole)
    for i, a in enumerate(order):
        sorted_middle[i] = middle[a]
        for j, b in enumerate(order):
            covariance[3 * i : 3 * i + 3, 3 * j : 3 * j + 3] = whole[
                3 * a : 3 * a + 3, 3 * b : 3 * b + 3
            ]
    return order, sorted_middle, covariance


@njit(cache=True, nogil=True)
def _with_blocks(spread: F64, each: F64) -> F64:
    """Scale a covariance (3n, 3n) so that the touches have their own (n, 3, 3) on its diagonal."""
    scale = np.zeros_like(spread)
    for i in range(len(each)):
        block = slice(3 * i, 3 * i + 3)
        own = np.linalg.cholesky(np.ascontiguousarray(spread[block, block]))
        scale[block, block] = np.linalg.cholesky(each[i]) @ np.linalg.inv(own)
    return scale @ spread @ scale.T
