"""Touches on a bench of which nothing is known but its scene, each cause as wide as a frame shows.

A frame shows a score of the numbers of a bench beside its touches. Those that were found by the
whole prior are taken on, by a step of Gauss and Newton over touches and bench, to where causes that
the frame shows to be absent count for little; see `models.bench.relevance`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import solve_triangular

from models.arrays import F64, Mask
from models.bench.bench import BenchEstimate, correlation_root
from models.bench.marginal import likely_shift, scatter_beside_bench
from models.bench.relevance import (
    Information,
    causes_among,
    likely_scales,
    over_scales,
    posterior,
)
from models.bench.traces import Traces
from models.estimate import Estimate
from models.forward.bench_forward import BenchForward
from models.inverse.prior import Prior

_FURTHEST = 4.0  # standard deviations by the whole prior, beyond which a step leads astray


@dataclass(frozen=True)
class _Frame:
    """What is measured (m,) beside traces, in units of noise, and what is known beforehand."""

    measured: F64
    bench: BenchEstimate
    prior: Prior
    lower: F64  # Cholesky factor of what scatters beside the bench

    @property
    def free(self) -> Mask:
        """Numbers of the bench of which something is not known, (63,)."""
        return self.bench.prior > 0

    def whiten(self, rows: F64) -> F64:
        """Put columns (m, k) into units of what scatters beside the bench."""
        white = solve_triangular(self.lower, rows, lower=True, check_finite=False)
        return np.asarray(white, dtype=np.float64)


@dataclass(frozen=True)
class _Step:
    """A step from touches: on the likeliest bench, and what each number of a bench takes of it.

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
    forward: BenchForward,
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
    forward : BenchForward
        On any bench near by.
    bench : BenchEstimate
        Of which no press and no touch has shown anything.
    measured : (m,) float64
        In units of its noise.
    left : Traces
    prior : Prior

    Returns
    -------
    Estimate
        The same where the step leads astray.
    """
    touches = np.column_stack([estimate.xy, estimate.force])
    lower = np.linalg.cholesky(scatter_beside_bench(forward, bench, touches, left))
    if len(left):
        measured = measured - left.shown(forward, bench)[0]
    frame = _Frame(measured, bench, prior, np.asarray(lower, dtype=np.float64))
    step, causes = _step(frame, forward, touches), causes_among(frame.free, bench.measured)
    scales = likely_scales(step.information, causes)
    shift = over_scales(step.information, causes, scales, -step.by_bench)
    away = step.alone + shift.mean
    if not (np.abs(away) < _FURTHEST * np.sqrt(np.diag(estimate.covariance))).all():
        return estimate
    found, covariance = touches + away.reshape(touches.shape), step.covariance + shift.covariance
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


def _step(frame: _Frame, on: BenchForward, touches: F64) -> _Step:
    """Work out a step from touches on a bench."""
    predicted, own = on.read(touches)
    rest = frame.measured - predicted - likely_shift(on, frame.bench, touches)
    shared = on.by_bench(touches)[frame.free] * frame.bench.prior[frame.free, None]
    if frame.bench.measured:
        shared = correlation_root(frame.bench, frame.free).T @ shared
    white = frame.whiten(np.concatenate([rest[None], own, shared]).T)
    rest, own, shared = np.split(white, [1, 1 + touches.size], axis=1)
    stated = np.tile(frame.prior.precision, len(touches))
    covariance = np.asarray(np.linalg.inv(own.T @ own + np.diag(stated)), dtype=np.float64)
    away = np.tile(frame.prior.mean, len(touches)) - touches.ravel()
    alone = covariance @ (own.T @ rest[:, 0] + stated * away)
    gain = covariance @ own.T
    by_bench = gain @ shared
    seen = shared - own @ by_bench
    information = Information(shared.T @ seen, shared.T @ (rest[:, 0] - own @ alone))
    return _Step(alone, covariance, gain, by_bench, seen, information)
