"""The bench from presses: one joint least squares over its numbers and every touch.

Each press moves the plate; its place and force are known to some part, or not at all. What all
presses share is the bench: with the touches eliminated press by press (Schur complement), damped
Gauss-Newton steps from the prior find its numbers. The scatter of a press holds what the one before
left in the plate and the model's own error, which the residuals of all presses tell.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
from scipy.linalg import cho_factor, cho_solve, solve_triangular

import fe
from models.arrays import F64, AnyArray, Mask
from models.bench.bench import MEMORY, NAMES, BenchEstimate, HeldOut
from models.bench.labels import LabelErrors, Shown, label_errors
from models.bench.marginal import own_error
from models.bench.press import Press
from models.forward.bench_forward import THICKNESS, BenchForward
from models.forward.camera_change import CameraChange

_TURNS = 3
_STEPS = 12
_JUDGED = 3  # steps of expectation maximisation on the labels, a turn
_SETTLED = 0.02  # fall of χ² below which a turn has ended
_DAMPING = 1e-3  # to begin with, in parts of the diagonal
# Error of the model in the first turn: so wide that only the large features of the presses count,
# and the descent does not end in a valley beside the right one.
_COARSE = 0.1
_DISCREPANCIES = np.geomspace(2e-4, 5e-2, 25)
_PLATE = len(fe.BENCH_PARAMETERS)


class _Term(NamedTuple):
    """What one press adds to the normal equations."""

    chi2: float
    bench: F64  # (P, P)
    mixed: F64  # (P, 3)
    own: F64  # (3, 3)
    towards: F64  # (P,)
    towards_own: F64  # (3,)
    state: fe.Pressed


@dataclass(frozen=True, eq=False)
class _Problem:
    presses: tuple[Press, ...]
    prior: BenchEstimate
    free: Mask
    scales: F64
    size: F64  # (2,) of the plate
    labels: LabelErrors
    factors: list[F64] = field(default_factory=list[F64])


class _State(NamedTuple):
    values: F64  # (39,)
    touches: F64  # (N, 3)


def identify(
    forward: BenchForward,
    presses: Sequence[Press],
    prior: BenchEstimate,
    look: CameraChange | None = None,
    free: Sequence[str] = NAMES,
    progress: Callable[[int, int], object] | None = None,
) -> BenchEstimate:
    """Find the bench that presses show.

    Parameters
    ----------
    forward : BenchForward
        On the bench that is described.
    presses : sequence of Press
        In the order in which they were made.
    prior : BenchEstimate
        What is known beforehand.
    look : CameraChange, optional
        Where the numbers of the camera are to be found too.
    free : sequence of str
        Names of the numbers to find; the others stay as the prior has them.
    progress : callable, optional
        Called with the turns done and their number.

    Returns
    -------
    BenchEstimate
        Laplace's approximation: the most likely numbers and their covariance.

    Raises
    ------
    ValueError
        There is no press, or a name is none of `BENCH`.
    """
    problem = _problem(presses, prior, look, free, np.array(forward.plate.size))
    state = _State(prior.values.copy(), np.array([press.touch for press in presses]))
    bench, terms = replace(prior, discrepancy=_COARSE), list[_Term]()
    on = _on(forward, state.values, look)
    for turn in range(_TURNS):
        factors = [each.factor(bench.discrepancy) for each in _scatters(problem, on, state)]
        problem = replace(problem, factors=factors)
        state, terms, converged = _descend(problem, on, state, terms)
        bench = replace(bench, converged=converged)
        on = _on(on, state.values, look)
        bench = replace(bench, discrepancy=_discrepancy(problem, on, state))
        for _ in range(_JUDGED):
            problem = replace(problem, labels=_labels(problem, terms, state))
        if progress is not None:
            progress(turn + 1, _TURNS)
    return _described(problem, on, bench, state, terms)


def _problem(
    presses: Sequence[Press],
    prior: BenchEstimate,
    look: CameraChange | None,
    free: Sequence[str],
    size: F64,
) -> _Problem:
    if not presses:
        raise ValueError("a bench needs presses, got none; press the plate at known places")
    unknown = set(free) - set(NAMES)
    if unknown:
        raise ValueError(f"no bench has a {min(unknown)!r}; use one of {', '.join(NAMES)}")
    chosen = np.array([name in free for name in NAMES]) & (prior.sigma > 0)
    if look is None:
        chosen[_PLATE:] = False
    stated = np.array([press.sigma for press in presses])
    labels = LabelErrors(stated, np.zeros(len(stated), dtype=bool))
    return _Problem(tuple(presses), prior, chosen, prior.sigma[chosen], size, labels)


def _on(forward: BenchForward, values: F64, look: CameraChange | None) -> BenchForward:
    if look is None:
        return forward.on(values, forward.fields.seen)
    return forward.on(values, look.at(values[_PLATE:], float(values[THICKNESS])))


class _Scatter(NamedTuple):
    """What a press scatters by: noise and memory, and by each unit of the model's own error."""

    fixed: F64  # (m, m)
    own: float

    def factor(self, discrepancy: float) -> F64:
        """Lower Cholesky factor for an error of the model."""
        spread = self.fixed + discrepancy**2 * self.own * np.eye(len(self.fixed))
        return np.asarray(np.linalg.cholesky(spread), dtype=np.float64)


def _scatters(problem: _Problem, on: BenchForward, state: _State) -> list[_Scatter]:
    """Scatter of each press; the one before it may not have left the plate."""
    scatters: list[_Scatter] = []
    before = np.zeros(on.whitening.shape[1])
    for press, touch in zip(problem.presses, state.touches, strict=True):
        seen = _through(on, press)
        left = seen.whitening @ before
        fixed = press.noise**2 * np.eye(len(left)) + MEMORY**2 * np.outer(left, left)
        scatters.append(_Scatter(fixed, own_error(seen.read(touch[None])[0])))
        before = on.fields.seen_of(seen.state(touch[None]))
    return scatters


def _descend(
    problem: _Problem, on: BenchForward, state: _State, near: list[_Term]
) -> tuple[_State, list[_Term], bool]:
    """Gauss-Newton steps, damped where they fail; and whether the last one brought nothing more."""
    terms, cost = _terms(problem, on, state, near)
    damping = _DAMPING
    for _ in range(_STEPS):
        trial = _stepped(problem, state, terms, damping)
        found, trial_cost = _terms(problem, on, trial, terms)
        if trial_cost > cost:
            damping *= 10.0
            continue
        fall, state, terms, cost = cost - trial_cost, trial, found, trial_cost
        if fall < _SETTLED and damping <= _DAMPING:
            return state, terms, True
        damping *= 0.1
    return state, terms, False


def _terms(
    problem: _Problem, on: BenchForward, state: _State, near: list[_Term]
) -> tuple[list[_Term], float]:
    """Build normal equations of all presses, and χ² with the priors; `near` are those before."""
    bench = on.moved(state.values)
    starts = [bench.near(term.state) for term in near] or [bench] * len(problem.presses)
    given = zip(starts, problem.factors, problem.presses, state.touches, strict=True)
    terms = [_term(problem, *each) for each in given]
    labels = (state.touches - [press.touch for press in problem.presses]) / problem.labels.sigmas
    beside = (state.values - problem.prior.values)[problem.free] / problem.scales
    cost = sum(term.chi2 for term in terms) + float(np.sum(labels**2) + beside @ beside)
    return terms, cost


def _term(problem: _Problem, on: BenchForward, factor: F64, press: Press, touch: F64) -> _Term:
    on = _through(on, press)
    residual, own, shared = _white(problem, on, factor, press, touch)
    return _Term(
        chi2=float(residual @ residual),
        bench=shared.T @ shared,
        mixed=shared.T @ own,
        own=own.T @ own,
        towards=shared.T @ residual,
        towards_own=own.T @ residual,
        state=on.state(touch[None]),
    )


def _white(
    problem: _Problem, on: BenchForward, factor: F64, press: Press, touch: F64
) -> tuple[F64, F64, F64]:
    """Whiten the residual (m,) of a press, its derivatives by the touch (m, 3) and bench (m, P)."""
    predicted, own = on.read(touch[None])
    shared = on.by_bench(touch[None])[problem.free] * problem.scales[:, None]
    rows = np.concatenate([(press.measured - predicted)[None], own, shared]).T
    white = _solve_lower(factor, rows)
    return white[:, 0], white[:, 1:4], white[:, 4:]


def _through(on: BenchForward, press: Press) -> BenchForward:
    """Return the forward model of a press, by the part of the pattern that it showed."""
    return on if press.whitening is None else replace(on, whitening=press.whitening)


def _solve_lower(factor: AnyArray, rows: F64) -> F64:
    white = solve_triangular(factor, rows, lower=True, check_finite=False)
    return np.asarray(white, dtype=np.float64)


def _stepped(problem: _Problem, state: _State, terms: list[_Term], damping: float) -> _State:
    """State after a step of the damped normal equations, touches eliminated."""
    normal, slope, blocks = _reduced(problem, state, terms, damping)
    step = cho_solve(cho_factor(normal), slope)
    values = state.values.copy()
    values[problem.free] += problem.scales * step
    touches = state.touches.copy()
    for i, (inverse, towards) in enumerate(blocks):
        touches[i] += inverse @ (towards - terms[i].mixed.T @ step)
    return _State(values, _inside(touches, problem.size))


def _inside(touches: F64, size: F64) -> F64:
    """Touches on the plate that push."""
    places = np.clip(touches[:, :2], 0.01 * size, 0.99 * size)
    return np.column_stack([places, np.maximum(touches[:, 2], 1e-3)])


def _reduced(
    problem: _Problem, state: _State, terms: list[_Term], damping: float
) -> tuple[F64, F64, list[tuple[F64, F64]]]:
    """Build normal matrix and slope of the bench, and the inverse block and slope of each touch."""
    normal = np.eye(len(problem.scales))
    slope = -(state.values - problem.prior.values)[problem.free] / problem.scales
    blocks: list[tuple[F64, F64]] = []
    for term, touch, press, sigma in zip(
        terms, state.touches, problem.presses, problem.labels.sigmas, strict=True
    ):
        towards = term.towards_own + (press.touch - touch) / sigma**2
        own = term.own + np.diag(sigma**-2.0)
        damped = own + damping * np.diag(np.diag(own))
        inverse = np.asarray(np.linalg.inv(damped), dtype=np.float64)
        along = term.mixed @ inverse
        normal += term.bench - along @ term.mixed.T
        slope += term.towards - along @ towards
        blocks.append((inverse, towards))
    return normal + damping * np.diag(np.diag(normal)), slope, blocks


def _discrepancy(problem: _Problem, on: BenchForward, state: _State) -> float:
    """Error of the model, as a fraction, under which the residuals are likeliest."""
    likelihood = np.zeros(len(_DISCREPANCIES))
    scatters = _scatters(problem, on, state)
    for press, touch, scatter in zip(problem.presses, state.touches, scatters, strict=True):
        residual = press.measured - _through(on, press).read(touch[None])[0]
        for k, size in enumerate(_DISCREPANCIES):
            lower = scatter.factor(float(size))
            white = _solve_lower(lower, residual)
            likelihood[k] -= 0.5 * float(white @ white) + float(np.log(np.diag(lower)).sum())
    return float(_DISCREPANCIES[np.argmax(likelihood)])


def _labels(problem: _Problem, terms: list[_Term], state: _State) -> LabelErrors:
    """Judge the labels by what the presses show."""
    normal, _, blocks = _reduced(problem, state, terms, 0.0)
    bench = np.linalg.inv(normal)
    off, spread, variance = (np.empty((len(terms), 3)) for _ in range(3))
    for i, (term, (inverse, _)) in enumerate(zip(terms, blocks, strict=True)):
        alone, along = np.linalg.inv(term.own), term.mixed @ inverse
        off[i], spread[i] = alone @ term.towards_own, np.sqrt(np.diag(alone))
        variance[i] = np.diag(inverse + along.T @ bench @ along)
    left = state.touches - [press.touch for press in problem.presses]
    stated = np.array([press.sigma for press in problem.presses])
    return label_errors(stated, Shown(off + left, spread, left, variance))


def _described(
    problem: _Problem, on: BenchForward, bench: BenchEstimate, state: _State, terms: list[_Term]
) -> BenchEstimate:
    normal, _, _ = _reduced(problem, state, terms, 0.0)
    inverse = np.asarray(np.linalg.inv(normal), dtype=np.float64)
    moved = bench.discrepancy * inverse @ _led_astray(problem, on, state, terms)
    covariance = problem.prior.covariance.copy()
    index = np.flatnonzero(problem.free)
    covariance[index] = covariance[:, index] = 0.0
    found = problem.scales[:, None] * (inverse + moved @ moved.T) * problem.scales
    covariance[np.ix_(index, index)] = found
    outliers = np.flatnonzero(problem.labels.outliers)
    return replace(
        bench,
        values=state.values,
        covariance=covariance,
        held_out=_held_out(problem, state, terms),
        outliers=tuple(int(i) for i in outliers),
    )


def _led_astray(problem: _Problem, on: BenchForward, state: _State, terms: list[_Term]) -> F64:
    """Slope of the bench (P, m) by a unit of an error of the model that all presses share.

    What a model leaves out it leaves out of every press: such an error does not average as noise
    does, and moves the bench as far as the presses are alike.
    """
    total = np.zeros((len(problem.scales), len(on.whitening)))
    given = zip(
        terms, problem.factors, problem.presses, state.touches, problem.labels.sigmas, strict=True
    )
    for term, factor, press, touch, sigma in given:
        seen = _through(on, press)
        _, own, shared = _white(problem, seen, factor, press, touch)
        along = np.linalg.solve(term.own + np.diag(sigma**-2.0), term.mixed.T)
        size = np.sqrt(own_error(seen.read(touch[None])[0]))
        total += size * (shared - own @ along).T @ _solve_lower(factor, np.eye(len(factor)))
    return total


def _held_out(problem: _Problem, state: _State, terms: list[_Term]) -> HeldOut | None:
    """Errors of presses that are taken out of the bench, to first order."""
    normal, slope, blocks = _reduced(problem, state, terms, 0.0)
    places: list[float] = []
    forces: list[float] = []
    for i, (term, press) in enumerate(zip(terms, problem.presses, strict=True)):
        inverse, towards = blocks[i]
        along = term.mixed @ inverse
        others = normal - (term.bench - along @ term.mixed.T)
        slope_of_others = slope - (term.towards - along @ towards)
        joint = np.block([[others + term.bench, term.mixed], [term.mixed.T, term.own]])
        right = np.concatenate([slope_of_others + term.towards, term.towards_own])
        off = state.touches[i] + np.linalg.solve(joint, right)[-3:] - press.touch
        if np.isfinite(problem.labels.sigmas[i, :2]).all():
            places.append(float(np.hypot(*off[:2])))
        if np.isfinite(problem.labels.sigmas[i, 2]):
            forces.append(float(off[2] / press.touch[2]))
    if not places:
        return None
    return HeldOut(_rms(places), _rms(forces) if forces else float("nan"), len(places))


def _rms(values: list[float]) -> float:
    return float(np.sqrt(np.mean(np.square(values))))
