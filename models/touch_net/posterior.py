"""What a touch net says of a measurement: how many touches, and where each may be."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import ndtr, softmax

from models.arrays import F64
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
        mean = np.einsum("np,npk->nk", self.weight, self.mean)
        off = self.mean - mean[:, None]
        each = self.factor @ self.factor.transpose(0, 1, 3, 2) + off[..., None] * off[..., None, :]
        return mean, np.einsum("np,npij->nij", self.weight, each)

    def below(self, touches: F64) -> F64:
        """Probability that x, y and F of each touch lie below those of `touches` (n, 3)."""
        sigma = np.sqrt(np.square(self.factor).sum(axis=3))
        return np.einsum("np,npk->nk", self.weight, ndtr((touches[:, None] - self.mean) / sigma))

    def draw(self, rng: np.random.Generator, count: int) -> F64:
        """Draw each touch `count` times, (count, n, 3)."""
        number = len(self.weight)
        edges = np.cumsum(self.weight, axis=1)
        part = (rng.random((count, number, 1)) > edges[:, :-1]).sum(axis=2)
        row = np.arange(number)
        white = rng.standard_normal((count, number, 3, 1))
        return self.mean[row, part] + (self.factor[row, part] @ white)[..., 0]


def mixture(out: F64, fitted: F64, factors: F64) -> Mixture:
    """Read the net's numbers (n, 40) about fits (n, 3) in units of their factors (n, 3, 3)."""
    raw = out.astype(np.float64).reshape(len(out), PARTS, EACH)
    factor = np.zeros((len(out), PARTS, 3, 3))
    factor[..., (1, 2, 2), (0, 0, 1)] = raw[..., 7:]
    factor[..., (0, 1, 2), (0, 1, 2)] = np.exp(np.clip(raw[..., 4:7] + WIDTHS[:, None], -6.0, 6.0))
    mean = fitted[:, None] + np.einsum("nij,npj->npi", factors, raw[..., 1:4])
    return Mixture(softmax(raw[..., 0] + FIRST, axis=1), mean, factors[:, None] @ factor)


WIDTHS = np.log([1.0, 1.5, 4.0, 20.0])
FIRST = np.log([0.9, 0.07, 0.02, 0.01])
"""Widths of the parts over what was fitted, and their weights, before any training."""
