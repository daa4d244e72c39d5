"""A bench that is learned on while it is used: each touch, of which little is known, says a little.

One step of an iterated, extended Kalman filter over all numbers of the bench: what they may have
wandered by since the last touch is added, the place and the force of the touch are eliminated, and
what is left of the measurement moves the bench, as far as its covariance allows.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy.stats import chi2

from models.arrays import F64
from models.bench.bench import NAMES, BenchEstimate
from models.bench.joint import solve_lower, through
from models.bench.limits import HARD, SOFT, ends, limited, pushing
from models.bench.marginal import own_error
from models.bench.press import Press
from models.bench.traces import NO_TRACES, Traces
from models.forward.bench_forward import BenchForward

_STEPS = 5
# Of the prior's σ: a step goes no further in any number, and a shorter one is the last.
_FURTHEST, _SETTLED = 0.7, 0.01
_LIGHTEST = 1e-3  # N
_STRANGE = 1e-3
"""Probability below which a touch says nothing of the bench: something else is the matter."""
_HOUR = 3600.0
_ANYTHING = 0.1
"""Of the prior's σ, by which any number wanders in an hour: frames move, glue creeps."""
_WARMING = 0.5
"""The same of the tension, in a minute: a kelvin in ten minutes (PVC of 1 mm in a stiff frame)."""


def wandered(bench: BenchEstimate, seconds: float) -> BenchEstimate:
    """Let the numbers of a bench be less sure after some time.

    Each is a random walk that ends where nothing is known but the prior. What the tension follows,
    the temperature of a plate in its frame, changes in minutes; all others in days.

    Parameters
    ----------
    bench : BenchEstimate
    seconds : float
        Since its covariance was that.

    Raises
    ------
    ValueError
        If the time is negative.
    """
    if seconds < 0:
        raise ValueError(
            f"time since a bench was known must not be negative, got {seconds:g} s; give frames in"
            " their order"
        )
    rate = bench.prior**2 * _ANYTHING**2 / _HOUR
    warming = [k for k, name in enumerate(NAMES) if name.startswith("tension")]
    rate[warming] = bench.prior[warming] ** 2 * _WARMING**2 / 60.0
    free = 1.0 - (bench.sigma / np.where(bench.prior > 0, bench.prior, np.inf)) ** 2
    added = np.minimum(rate * seconds, bench.prior**2) * np.clip(free, 0.0, 1.0)
    return replace(bench, covariance=bench.covariance + np.diag(added))


def learn(
    forward: BenchForward, bench: BenchEstimate, press: Press, left: Traces = NO_TRACES
) -> BenchEstimate | None:
    """Learn on a bench from a touch of which little is known.

    A known weight laid anywhere is a touch of known force at an unknown place: it sets the newton,
    which touches of unknown force cannot.

    Parameters
    ----------
    forward : BenchForward
        On any bench near by.
    bench : BenchEstimate
        What is known before the touch.
    press : Press
        Mean of its frames, a start, and what is known of place and force: each number whose σ is
        finite counts as one more that was measured.
    left : Traces
        What the plate may still show of touches that ended.

    Returns
    -------
    BenchEstimate or None
        None where the touch fits no bench that is likely: it says nothing.
    """
    fit = _fitted(through(forward, press), bench, press.touch[None], press, left)
    if fit is None:
        return None
    on, step = fit
    limits = pushing(on.fields.values, on.fields.bench.modal.described, bench, SOFT)[0]
    seen = np.concatenate([step.seen, limits])
    gain = _gain(_spread(seen, bench.covariance), seen, bench.covariance)
    kept = np.eye(len(bench.values)) - gain @ seen
    # Joseph's form stays positive.
    covariance = kept @ bench.covariance @ kept.T + gain @ gain.T
    return replace(bench, values=on.fields.values, covariance=covariance)


def likeliest(
    forward: BenchForward,
    bench: BenchEstimate,
    measured: F64,
    touches: F64,
    left: Traces = NO_TRACES,
) -> BenchForward | None:
    """Move a forward model to the bench that a frame itself makes likeliest, its touches near some.

    What is not known of a bench is not small where nothing is known but its scene: what tension
    does to a plate, for instance, is far from linear over all that it may be.

    Parameters
    ----------
    forward : BenchForward
        On any bench near by.
    bench : BenchEstimate
        What is known.
    measured : (m,) float64
        In units of its noise.
    touches : (n, 3) float64, mm, mm, N
    left : Traces
        What the plate may still show of touches that ended.

    Returns
    -------
    BenchForward or None
        None where the frame fits no bench that is likely.
    """
    unknown = Press(measured, np.zeros(3), np.full(3, np.inf))
    fit = _fitted(forward, bench, touches, unknown, left)
    return None if fit is None else fit[0]


def _spread(seen: F64, covariance: F64) -> F64:
    """Covariance (m, m) of a measurement of derivative (m, 63) and noise 1."""
    return np.eye(len(seen)) + seen @ covariance @ seen.T


def _gain(spread: F64, seen: F64, covariance: F64) -> F64:
    """Gain (63, m) of that measurement."""
    return np.asarray(np.linalg.solve(spread, seen @ covariance).T, dtype=np.float64)


class _Step(NamedTuple):
    """Change of bench (63,) and touches (n, 3), what showed it, χ², and how far it goes."""

    change: F64
    touches: F64
    seen: F64
    chi2: float
    far: float


def _fitted(
    forward: BenchForward, bench: BenchEstimate, touches: F64, press: Press, left: Traces
) -> tuple[BenchForward, _Step] | None:
    """Move to the likeliest bench and touches; None where that is not likely."""
    step = None
    for _ in range(_STEPS):
        step = _step(forward, bench, press, touches, left)
        part = min(1.0, _FURTHEST / step.far)
        near = forward.fields.state(touches)
        forward = forward.moved(forward.fields.values + part * step.change).near(near)
        moved = touches + part * step.touches
        touches = np.column_stack([moved[:, :2], np.maximum(moved[:, 2], _LIGHTEST)])
        if step.far < _SETTLED:
            break
    seen = len(press.measured) + np.isfinite(press.sigma).sum() - touches.size
    if step is None or not chi2.sf(step.chi2, seen) >= _STRANGE:
        return None
    return forward, step


def _step(
    on: BenchForward, bench: BenchEstimate, press: Press, touches: F64, left: Traces
) -> _Step:
    """Take a step of Gauss and Newton from a bench and touches."""
    values = on.fields.values
    residual, own, shared = _whitened(on, bench, press, touches, left)
    basis = np.linalg.qr(own)[0]
    freed, seen = (part - basis @ (basis.T @ part) for part in (residual, shared))
    spread = _spread(seen, bench.covariance)
    gain = _gain(spread, seen, bench.covariance)
    left_over = freed + seen @ (values - bench.values)
    change = bench.values + gain @ left_over - values
    covariance = bench.covariance - gain @ (seen @ bench.covariance)
    described = on.fields.bench.modal.described
    change, cost = limited(change, covariance, *ends(values, described, bench, HARD))
    moved = np.empty(touches.size)
    moved[:] = np.linalg.lstsq(own, residual - shared @ change, rcond=None)[0]
    size = float(left_over @ np.linalg.solve(spread, left_over)) + cost
    free = bench.prior > 0
    far = float(np.max(np.abs(change[free]) / bench.prior[free], initial=np.finfo(float).tiny))
    return _Step(change, moved.reshape(touches.shape), seen, size, far)


def _whitened(
    on: BenchForward, bench: BenchEstimate, press: Press, touches: F64, left: Traces
) -> tuple[F64, F64, F64]:
    """Whiten what touches leave (m,), its derivatives by them (m, 3n) and by the bench (m, 63)."""
    predicted, own = on.read(touches)
    variance = press.total_noise**2 + bench.discrepancy**2 * own_error(predicted)
    spread = variance * np.eye(len(predicted))
    if len(left):
        likely, shown = left.shown(on, bench)
        predicted = predicted + likely
        spread += shown.T @ shown + left.misshapen(on, bench)
    rows = np.concatenate([(press.measured - predicted)[None], own, on.by_bench(touches)]).T
    white = solve_lower(np.asarray(np.linalg.cholesky(spread), dtype=np.float64), rows)
    white = np.concatenate([white, _known(press, touches)])
    free = 1 + touches.size
    return white[:, 0], white[:, 1:free], white[:, free:]


def _known(press: Press, touches: F64) -> F64:
    """Write what is known of the first touch as further rows, (0 to 3, 1 + 3n + 50)."""
    known = np.flatnonzero(np.isfinite(press.sigma))
    rows = np.zeros((len(known), 1 + touches.size + len(NAMES)))
    rows[:, 0] = ((press.touch - touches[0]) / press.sigma)[known]
    rows[np.arange(len(known)), 1 + known] = 1.0 / press.sigma[known]
    return rows


def force_sigma(forward: BenchForward, bench: BenchEstimate, touch: F64) -> float:
    """Compute how well the force of a touch (3,) is known, by what is not known of the bench alone.

    Returns
    -------
    float
        Standard deviation as a fraction of the force.
    """
    on = forward.moved(bench.values)
    _, own = on.read(touch[None])
    root = np.linalg.cholesky(bench.covariance + 1e-12 * np.diag(bench.prior**2 + 1e-12))
    moved = np.linalg.lstsq(own.T, on.by_bench(touch[None]).T @ root, rcond=None)[0]
    return float(np.linalg.norm(moved[2]) / touch[2])
