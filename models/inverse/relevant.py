"""Touches on a bench of which nothing is known but its scene, each cause as wide as a frame shows.

A frame shows a score of the numbers of a bench beside its touches. Those that were found by the
whole prior are taken on by one step of Gauss and Newton to where causes that the frame shows to be
absent count for little; see `models.bench.relevance`.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy.linalg import solve_triangular

from models.arrays import F64
from models.bench.bench import BenchEstimate
from models.bench.marginal import MarginalForward, scatter_beside_bench
from models.bench.relevance import (
    Information,
    causes_among,
    likely_scales,
    over_scales,
    posterior,
)
from models.bench.traces import Traces
from models.estimate import Estimate
from models.inverse.prior import Prior


class _Step(NamedTuple):
    """A step from touches, and what it takes of the numbers of the bench.

    On a bench as it is most likely the touches move by `alone`, with `covariance`, by `gain` of
    what is measured; each number moves them by `by_bench`, and is measured by `seen`.
    """

    alone: F64  # (3n,)
    covariance: F64  # (3n, 3n)
    gain: F64  # (3n, m)
    by_bench: F64  # (3n, P)
    seen: F64  # (m, P), the touches eliminated
    information: Information


def by_relevance(
    estimate: Estimate,
    forward: MarginalForward,
    bench: BenchEstimate,
    measured: F64,
    left: Traces,
    prior: Prior,
) -> Estimate:
    """Return touches and their covariance with the scale of each cause inferred.

    χ², p-value and count stay those of the whole prior. Each frame infers the scales anew: from
    frame to frame touches scatter by more than the part of the covariance that is not systematic.

    Parameters
    ----------
    estimate : Estimate
        By the whole prior of the bench.
    forward : MarginalForward
        About its touches, or near by.
    bench : BenchEstimate
        Of which no press and no touch has shown anything.
    measured : (m,) float64
        In units of its noise.
    left : Traces
    prior : Prior
    """
    touches = np.column_stack([estimate.xy, estimate.force])
    free = bench.prior > 0
    lower = np.linalg.cholesky(scatter_beside_bench(forward.forward, bench, touches, left))
    predicted, own = forward.forward.read(touches)
    shared = forward.forward.by_bench(touches)[free] * bench.prior[free, None]
    rows = np.concatenate([(measured - forward.shift - predicted)[None], own, shared]).T
    white = solve_triangular(lower, rows, lower=True, check_finite=False)
    step = _step(np.asarray(white, dtype=np.float64), touches, prior)
    causes = causes_among(free)
    scales = likely_scales(step.information, causes)
    shift = over_scales(step.information, causes, scales, -step.by_bench)
    found = touches + (step.alone + shift.mean).reshape(touches.shape)
    covariance = step.covariance + shift.covariance
    known = posterior(step.information, scales).covariance
    white_gain = step.gain - step.by_bench @ known @ step.seen.T
    gain = solve_triangular(lower, white_gain.T, lower=True, trans=1, check_finite=False)
    return replace(
        estimate,
        xy=found[:, :2],
        force=found[:, 2],
        covariance=covariance,
        systematic=covariance - gain.T @ gain,
    )


def _step(white: F64, touches: F64, prior: Prior) -> _Step:
    """Work out a step from what is left (m,), and its derivatives by touches and bench, as columns.

    All in units of what scatters beside the bench.
    """
    rest, own, shared = np.split(white, [1, 1 + touches.size], axis=1)
    stated = np.tile(prior.precision, len(touches))
    covariance = np.asarray(np.linalg.inv(own.T @ own + np.diag(stated)), dtype=np.float64)
    away = np.tile(prior.mean, len(touches)) - touches.ravel()
    alone = covariance @ (own.T @ rest[:, 0] + stated * away)
    gain = covariance @ own.T
    by_bench = gain @ shared
    seen = shared - own @ by_bench
    information = Information(shared.T @ seen, shared.T @ (rest[:, 0] - own @ alone))
    return _Step(alone, covariance, gain, by_bench, seen, information)
