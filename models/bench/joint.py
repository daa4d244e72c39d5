"""All presses at once: one least squares over the numbers of the bench and every touch.

Each press moves the plate; its place and force are known to some part, or not at all. What all
presses share is the bench, and the noise of the reference that they are measured against: with the
touches eliminated press by press (Schur complement), damped Gauss-Newton steps from a start find
both.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
from scipy.linalg import block_diag, solve_triangular

import fe
from models.arrays import F64, AnyArray, Mask
from models.bench.bench import NAMES, BenchEstimate
from models.bench.deviation import deviation
from models.bench.labels import LabelErrors
from models.bench.limits import HARD, SOFT, ends, limited, pushing
from models.bench.press import Press
from models.bench.relevance import Information
from models.forward.bench_forward import THICKNESS, BenchForward
from models.forward.camera_change import Look, Seen

_STEPS = 12
_SETTLED = 0.02  # change of χ² below which a descent has ended
_DAMPING = 1e-3  # to begin with, in parts of the diagonal
_PLATE = len(fe.BENCH_PARAMETERS)
NO_LIMITS = np.empty((0, len(NAMES))), np.empty(0)
"""Rows and excess where no end of an edge counts as pushing."""


class Term(NamedTuple):
    """What one press adds to the normal equations."""

    chi2: float
    bench: F64  # (P + R, P + R)
    mixed: F64  # (P + R, 3)
    own: F64  # (3, 3)
    towards: F64  # (P + R,)
    towards_own: F64  # (3,)
    state: fe.Pressed


@dataclass(frozen=True, eq=False)
class JointProblem:
    """Presses, what is known beforehand, and which P numbers are to be found.

    The noise of the reference has R of them, as many as a press was measured by: none where its
    presses share no noise, or where it counts as that of each, see `apart`. The factors are those
    of the scatter of each press, for an error of the model of `discrepancy`.
    """

    presses: tuple[Press, ...]
    prior: BenchEstimate
    free: Mask
    scales: F64
    plate: fe.ModalPlate
    labels: LabelErrors
    memory: float
    noises: int = 0
    unwhitening: F64 | None = None
    factors: list[F64] = field(default_factory=list[F64])
    discrepancy: float = 0.0

    @property
    def apart(self) -> JointProblem:
        """The same with each press by itself, to which the reference's noise is as its own."""
        return replace(self, noises=0)


class State(NamedTuple):
    """Numbers of the bench, the touch of each press, and the noise of the reference."""

    values: F64  # (63,)
    touches: F64  # (N, 3)
    noise: F64  # (R,), in units of its standard deviation


def pose(
    presses: Sequence[Press],
    prior: BenchEstimate,
    look: Look | None,
    free: Sequence[str],
    forward: BenchForward,
) -> JointProblem:
    """Put together what is asked; refuse what makes no sense."""
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
    plate = forward.fields.bench.modal
    scales = prior.sigma[chosen]
    noises = len(forward.whitening) if any(press.reference for press in presses) else 0
    hidden = noises and any(press.whitening is not None for press in presses)
    unwhitening = np.asarray(np.linalg.pinv(forward.whitening), np.float64) if hidden else None
    known = tuple(presses), prior, chosen, scales, plate, labels, prior.memory
    return JointProblem(*known, noises, unwhitening)


def start(problem: JointProblem) -> State:
    """Begin at the prior, at the touches that presses state, and with a reference without noise."""
    touches = np.array([press.touch for press in problem.presses])
    return State(problem.prior.values.copy(), touches, np.zeros(problem.noises))


def of_reference(problem: JointProblem, press: Press) -> F64:
    """Return what a press shows of each number of the noise of the reference, (m, R)."""
    if not problem.noises:
        return np.zeros((len(press.measured), 0))
    if press.whitening is None or problem.unwhitening is None:
        return press.reference * np.eye(problem.noises)
    return press.reference * press.whitening @ problem.unwhitening


def stand(
    forward: BenchForward, values: F64, look: Look | None, *, near: Seen | None = None
) -> BenchForward:
    """Return the forward model on a bench, through what its camera sees exactly.

    A camera that stands as it stood, on a plate as thick, sees what it saw. The derivatives by its
    numbers are those of `near`, where that is given.
    """
    seen, was = forward.fields.seen, forward.fields.values
    alike = np.array_equal(values[_PLATE:], was[_PLATE:]) and values[THICKNESS] == was[THICKNESS]
    if look is None or (seen is not None and alike):
        return forward.on(values, seen)
    return forward.on(values, look.at(values[_PLATE:], float(values[THICKNESS]), near))


def without_uneven(
    problem: JointProblem, presses: Sequence[Press], on: BenchForward
) -> JointProblem:
    """Take what a camera that moved has left off the presses as they were measured.

    What it leaves follows from how the camera of the bench stands; see `Seen.uneven`.
    """
    uneven = None if on.fields.seen is None else on.fields.seen.uneven
    if uneven is None:
        return problem

    def even(press: Press) -> Press:
        if press.moved is None:
            return press
        whitening = on.whitening if press.whitening is None else press.whitening
        return replace(press, measured=press.measured - whitening @ (uneven @ press.moved))

    return replace(problem, presses=tuple(even(press) for press in presses))


def camera_moved(problem: JointProblem, before: F64, after: F64) -> float:
    """By how much of the prior's σ a number of the camera changed most."""
    change = np.abs(after - before)[problem.free] / problem.prior.prior[problem.free]
    return float(np.max(change[np.flatnonzero(problem.free) >= _PLATE], initial=0.0))


def views(
    on: BenchForward, problem: JointProblem, terms: Sequence[Term] = ()
) -> list[BenchForward]:
    """Forward model of each press, by what it showed; each keeps its own state.

    States begin at those of `terms`, where a descent has ended near by.
    """
    starts = [on.near(term.state) for term in terms] or [on.apart() for _ in problem.presses]
    return [through(one, press) for one, press in zip(starts, problem.presses, strict=True)]


def descend(
    problem: JointProblem, on: BenchForward, state: State, near: list[Term]
) -> tuple[State, list[Term], bool]:
    """Gauss-Newton steps, damped where they fail; and whether the last one brought nothing more."""
    terms, cost = build_terms(problem, on, state, near)
    damping = _DAMPING
    for _ in range(_STEPS):
        trial = _stepped(problem, state, terms, damping)
        found, trial_cost = build_terms(problem, on, trial, terms)
        fall = cost - trial_cost
        if fall > 0.0:
            state, terms, cost = trial, found, trial_cost
        if abs(fall) < _SETTLED and damping <= _DAMPING:
            return state, terms, True
        damping *= 0.1 if fall > 0.0 else 10.0
    return state, terms, False


def build_terms(
    problem: JointProblem, on: BenchForward, state: State, near: list[Term]
) -> tuple[list[Term], float]:
    """Build normal equations of all presses, and χ² with the priors; `near` are those before."""
    bench = on.moved(state.values)
    seen = views(bench, problem, near)
    given = zip(seen, problem.factors, problem.presses, state.touches, strict=True)
    terms = [_term(problem, state.noise, *each) for each in given]
    labels = (state.touches - [press.touch for press in problem.presses]) / problem.labels.sigmas
    beside = deviation(state.values, problem.prior, problem.free)[0]
    excess = pushing(state.values, problem.plate.described, problem.prior, HARD)[1]
    priors = float(np.sum(labels**2) + beside @ beside + excess @ excess)
    priors += float(state.noise @ state.noise)
    return terms, sum(term.chi2 for term in terms) + priors


def _term(
    problem: JointProblem, noise: F64, on: BenchForward, factor: F64, press: Press, touch: F64
) -> Term:
    residual, own, shared = whiten_all(problem, on, factor, press, touch)
    residual = residual - shared[:, shared.shape[1] - problem.noises :] @ noise
    return Term(
        chi2=float(residual @ residual),
        bench=shared.T @ shared,
        mixed=shared.T @ own,
        own=own.T @ own,
        towards=shared.T @ residual,
        towards_own=own.T @ residual,
        state=on.fields.state(touch[None]),
    )


def whiten(
    problem: JointProblem, on: BenchForward, factor: F64, press: Press, touch: F64
) -> tuple[F64, F64, F64]:
    """Whiten the residual (m,) of a press, its derivatives by the touch (m, 3) and bench (m, P)."""
    predicted, own = on.read(touch[None])
    shared = on.by_bench(touch[None])[problem.free] * problem.scales[:, None]
    rows = np.concatenate([(press.measured - predicted)[None], own, shared]).T
    white = solve_lower(factor, rows)
    return white[:, 0], white[:, 1:4], white[:, 4:]


def whiten_all(
    problem: JointProblem, on: BenchForward, factor: F64, press: Press, touch: F64
) -> tuple[F64, F64, F64]:
    """Whiten the same, with the derivatives by the noise of the reference: the last (m, P + R)."""
    residual, own, shared = whiten(problem, on, factor, press, touch)
    if problem.noises:
        common = solve_lower(factor, of_reference(problem, press))
        shared = np.concatenate([shared, common], axis=1)
    return residual, own, shared


def through(on: BenchForward, press: Press) -> BenchForward:
    """Return the forward model of a press, by the part of the pattern that it showed."""
    return on if press.whitening is None else on.through(press.whitening)


def solve_lower(factor: AnyArray, rows: F64) -> F64:
    """Solve with a lower triangular factor."""
    white = solve_triangular(factor, rows, lower=True, check_finite=False)
    return np.asarray(white, dtype=np.float64)


def _stepped(problem: JointProblem, state: State, terms: list[Term], damping: float) -> State:
    """State after a step of the damped normal equations, touches eliminated.

    Edges that would push after it do not: see `limited`.
    """
    numbers = len(problem.scales)
    normal, slope, blocks = reduced(problem, state, terms, damping)
    rows, room = ends(state.values, problem.plate.described, problem.prior, HARD)
    rows = np.pad(rows[:, problem.free] * problem.scales, ((0, 0), (0, problem.noises)))
    covariance = np.asarray(np.linalg.inv(normal), dtype=np.float64)
    step = limited(covariance @ slope, covariance, rows, room).step
    values = state.values.copy()
    values[problem.free] += problem.scales * step[:numbers]
    touches = state.touches.copy()
    for i, (inverse, towards) in enumerate(blocks):
        touches[i] += inverse @ (towards - terms[i].mixed.T @ step)
    inside = _inside(touches, np.array(problem.plate.plate.size))
    return State(values, inside, state.noise + step[numbers:])


def information(problem: JointProblem, state: State, terms: list[Term]) -> Information:
    """Say what the presses alone show of deviations from the prior, in their stated σ.

    Compliances and tension deviate in parts of the plate's own stiffness, see `deviation`.
    """
    normal, slope, _ = reduced(problem, state, terms, limits=soft_limits(problem, state))
    numbers = len(problem.scales)
    common = np.linalg.solve(normal[numbers:, numbers:], normal[numbers:]).T
    matrix = normal[:numbers, :numbers] - common[:numbers] @ normal[numbers:, :numbers]
    towards = slope[:numbers] - common[:numbers] @ slope[numbers:]
    beside, by_numbers = deviation(state.values, problem.prior, problem.free)
    back = np.linalg.inv(by_numbers)
    matrix = back.T @ matrix @ back - np.eye(numbers)
    towards = back.T @ towards + beside + matrix @ beside
    scales = problem.scales / problem.prior.prior[problem.free]
    return Information(matrix / np.outer(scales, scales), towards / scales)


def rescaled(problem: JointProblem, scales: F64) -> JointProblem:
    """Take the prior as so many times (P,) as wide as it was stated."""
    stated, sigma = problem.prior, problem.prior.prior.copy()
    sigma[problem.free] *= scales
    covariance = np.diag(sigma**2)
    together = np.flatnonzero([name in stated.measured for name in NAMES])  # their scale is 1
    covariance[np.ix_(together, together)] = stated.covariance[np.ix_(together, together)]
    prior = replace(stated, covariance=covariance)
    return replace(problem, prior=prior, scales=sigma[problem.free])


def _inside(touches: F64, size: F64) -> F64:
    """Touches on the plate that push."""
    places = np.clip(touches[:, :2], 0.01 * size, 0.99 * size)
    return np.column_stack([places, np.maximum(touches[:, 2], 1e-3)])


def soft_limits(problem: JointProblem, state: State) -> tuple[F64, F64]:
    """Rows and excess of the ends of edges that push, as a covariance has them; see `pushing`."""
    return pushing(state.values, problem.plate.described, problem.prior, SOFT)


def reduced(
    problem: JointProblem,
    state: State,
    terms: list[Term],
    damping: float = 0.0,
    limits: tuple[F64, F64] = NO_LIMITS,
) -> tuple[F64, F64, list[tuple[F64, F64]]]:
    """Build normal matrix and slope of what is shared, and inverse block and slope of each touch.

    What is shared are the numbers of the bench that are free, then the noise of the reference.
    Limits are rows and excess of the ends of edges that push, see `soft_limits`.
    """
    rows, excess = limits
    beside, by_numbers = deviation(state.values, problem.prior, problem.free)
    rows = np.concatenate([rows[:, problem.free] * problem.scales, by_numbers])
    normal = block_diag(rows.T @ rows, np.eye(problem.noises))
    slope = -np.concatenate([np.concatenate([excess, beside]) @ rows, state.noise])
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
