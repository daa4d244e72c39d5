"""What presses scatter by: noise, what the one before left in the plate, the model's own error."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import log
from typing import NamedTuple

import numpy as np

from models.arrays import F64
from models.bench.joint import JointProblem, State, of_reference
from models.bench.marginal import own_error
from models.bench.relevance import evident_scales
from models.forward.bench_forward import BenchForward

_DISCREPANCIES = np.geomspace(2e-4, 5e-2, 25)
# Of a usual memory, all equally likely; their mean square is 1. Presses are short, and a plate that
# keeps nothing of them may keep some of a touch that lasts.
_SCALES = np.geomspace(0.1, 2.3, 13)


class Scatter(NamedTuple):
    """What a press scatters by: noise, memory, and by each unit of the model's own error."""

    noise: float
    left: F64  # (m,) of the press before, all of it
    memory: float
    own: float

    def even(self, discrepancy: float) -> float:
        """Variance of each number that was measured, for an error of the model."""
        return self.noise**2 + discrepancy**2 * self.own

    def factor(self, discrepancy: float) -> F64:
        """Lower Cholesky factor for an error of the model."""
        spread = self.even(discrepancy) * np.eye(len(self.left))
        spread += self.memory**2 * np.outer(self.left, self.left)
        return np.asarray(np.linalg.cholesky(spread), dtype=np.float64)

    def likelihood(self, residual: F64, discrepancy: float) -> float:
        """Logarithm of the likelihood of a residual (m,), but for a constant.

        For an error of the model. By the formulas of Sherman and Morrison: but for what is left in
        the plate the scatter is even.
        """
        even, left = self.even(discrepancy), self.memory * self.left
        along = even + float(left @ left)
        chi2 = (float(residual @ residual) - float(left @ residual) ** 2 / along) / even
        return -0.5 * (chi2 + log(along) + (len(left) - 1) * log(even))


def weighed(
    problem: JointProblem, seen: Sequence[BenchForward], state: State, discrepancy: float
) -> JointProblem:
    """Weigh the presses by their scatter about a state, for an error of the model.

    Each is seen by its forward model, see `views`.
    """
    factors = [each.factor(discrepancy) for each in scatters(problem, seen, state)]
    return replace(problem, factors=factors, discrepancy=discrepancy)


def scatters(problem: JointProblem, seen: Sequence[BenchForward], state: State) -> list[Scatter]:
    """Scatter of each press; the one before it may not have left the plate."""
    scatters: list[Scatter] = []
    before = np.zeros(seen[0].whitening.shape[1])
    for press, on, touch in zip(problem.presses, seen, state.touches, strict=True):
        own = own_error(on.read(touch[None])[0])
        noise = press.noise if problem.noises else press.total_noise
        scatters.append(Scatter(noise, on.whitening @ before, problem.memory, own))
        before = on.fields.seen_of(on.fields.state(touch[None]))
    return scatters


def likely_discrepancy(problem: JointProblem, seen: Sequence[BenchForward], state: State) -> float:
    """Error of the model, as a fraction, under which the residuals are likeliest.

    Each press by itself: the noise of the reference that was found fits the residuals too well.
    """
    likelihood = np.zeros(len(_DISCREPANCIES))
    found = scatters(problem.apart, seen, state)
    for press, on, touch, scatter in zip(problem.presses, seen, state.touches, found, strict=True):
        residual = press.measured - on.read(touch[None])[0]
        likelihood += [scatter.likelihood(residual, float(size)) for size in _DISCREPANCIES]
    return float(_DISCREPANCIES[np.argmax(likelihood)])


def likely_memory(
    problem: JointProblem, seen: Sequence[BenchForward], state: State, discrepancy: float
) -> float:
    """Fraction of a touch that presses show of the one before, its standard deviation.

    It is that of the prior times a scale that is not known, root mean square of all that are
    likely; what of a trace looks like the press itself says nothing.
    """
    shown, towards = list[float](), list[float]()
    found = scatters(problem, seen, state)
    given = list(zip(problem.presses, seen, state.touches, found, strict=True))
    for press, on, touch, scatter in given[1:]:
        predicted, own = on.read(touch[None])
        tangent = np.linalg.qr(own.T)[0]
        left = scatter.left - tangent @ (tangent.T @ scatter.left)
        even = scatter.even(discrepancy)
        rest = press.measured - predicted - of_reference(problem, press) @ state.noise
        shown.append(float(left @ left) / even)
        towards.append(float(left @ rest) / even)
    memories = _SCALES * problem.prior.memory
    weights = evident_scales(np.array(shown), np.array(towards), memories)
    return float(np.sqrt(weights @ np.square(memories)))
