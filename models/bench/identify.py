"""The bench from presses: what all of them show together, how sure it is, and how well it fits.

From the prior the joint least squares of `joint` goes down in turns: after each, what the residuals
say of the model's own error, and of the labels, is taken into the next.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from math import nan
from typing import NamedTuple

import numpy as np
from scipy.linalg import block_diag

from models.arrays import F64, Mask
from models.bench.bench import NAMES, BenchEstimate, HeldOut
from models.bench.deviation import deviation
from models.bench.joint import (
    NO_LIMITS,
    JointProblem,
    State,
    Term,
    build_terms,
    camera_moved,
    descend,
    information,
    pose,
    reduced,
    rescaled,
    soft_limits,
    solve_lower,
    stand,
    start,
    views,
    whiten_all,
    without_uneven,
)
from models.bench.labels import LabelErrors, Shown, common_offset, label_errors
from models.bench.marginal import own_error
from models.bench.press import Press
from models.bench.relevance import (
    Numbers,
    Posterior,
    causes_among,
    likely_scales,
    over_scales,
    posterior,
)
from models.bench.scatter import likely_discrepancy, likely_memory, weighed
from models.forward.bench_forward import BenchForward
from models.forward.camera_change import Look

COARSE = 0.1
"""Error of the model in the first turn: so wide that only the large features of the presses count,
and the descent does not end in a valley beside the right one."""

_TURNS, _LIMIT = 3, 8
# A turn whose descent has not ended is not the last: touches of unknown place take long.
# Of the prior's σ: a turn that moves a number of the camera further is not the last. In a turn the
# camera is taken to first order, and touches of unknown place lead it far.
_MOVED = 0.35
_RESCALED = 0.7  # the logarithm of a cause's scale: a turn that changes one by more is not the last
# A plate that lies beside where the camera is thought to see it has all touches beside themselves.
_PLACE = [NAMES.index("shift_x"), NAMES.index("shift_y")]
_MIN_PART = 0.1  # of a variance, that is left when the error that all presses share is counted once


def identify(
    forward: BenchForward,
    presses: Sequence[Press],
    priors: BenchEstimate,
    look: Look | None = None,
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
    priors : BenchEstimate
        What is known beforehand.
    look : Look, optional
        Where the numbers of the camera are to be found too.
    free : sequence of str
        Names of the numbers to find. The others stay as the priors have them, values and
        covariance: presses are explained by all numbers, and those found are as uncertain as the
        others leave them.
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
    asked = pose(presses, priors, look, free, forward).free
    problem = pose(presses, priors, look, NAMES, forward)
    whole = np.array_equal(asked, problem.free)
    stage = _begun(problem, look, forward)
    causes = causes_among(problem.free, priors.measured) if priors.is_prior and whole else []
    for turn in range(_LIMIT):
        weighed_causes = causes if turn else []  # the first one sees no more than large features
        stage, still = _turn(stage, presses, look, weighed_causes)
        last = turn + 1 >= _TURNS and still
        if progress is not None:
            progress(turn + 1, max(_TURNS, turn + 2 - last))
        if last:
            break
    # In the units of the last turn, which judged the priors anew, and by the camera as it stands.
    terms, _ = build_terms(stage.problem, stage.on, stage.state, stage.terms)
    stage = stage._replace(terms=terms)
    if whole:
        return _described(stage, causes, soft_limits(stage.problem, stage.state))
    return _partly(stage, priors, asked)


class _Stage(NamedTuple):
    """Where the descent stands: presses, as they are seen from a bench, what was found, and how."""

    problem: JointProblem
    on: BenchForward
    seen: list[BenchForward]
    bench: BenchEstimate
    state: State
    terms: list[Term]


def _begun(problem: JointProblem, look: Look | None, forward: BenchForward) -> _Stage:
    state = start(problem)
    on = stand(forward, state.values, look)
    seen = views(on, problem)
    problem = without_uneven(problem, problem.presses, on)
    return _Stage(problem, on, seen, replace(problem.prior, discrepancy=COARSE), state, [])


def _turn(
    stage: _Stage, presses: Sequence[Press], look: Look | None, causes: list[Numbers]
) -> tuple[_Stage, bool]:
    """Go down once, and take what is left into the next turn; whether another would change little.

    Presses are as they were measured. The scales of `causes` are judged anew.
    """
    problem, on, seen, bench, before, terms = stage
    problem = weighed(problem, seen, before, bench.discrepancy)
    state, terms, converged = descend(problem, on, before, terms)
    still = camera_moved(problem, before.values, state.values) < _MOVED
    on = stand(on, state.values, look, near=on.fields.seen if still else None)
    problem = without_uneven(problem, presses, on)
    seen = views(on, problem, terms)
    discrepancy = likely_discrepancy(problem, seen, state)
    memory = likely_memory(problem, seen, state, discrepancy)
    problem = replace(problem, memory=memory)
    problem = replace(problem, labels=_labels(problem, terms, state))
    bench = replace(bench, converged=converged, discrepancy=discrepancy, memory=memory)
    still = still and converged
    if causes:
        scales = likely_scales(information(problem, state, terms), causes)
        still = still and _settled(problem, scales)
        problem = rescaled(problem, scales)
    return _Stage(problem, on, seen, bench, state, terms), still


def _settled(problem: JointProblem, scales: F64) -> bool:
    """Whether the prior is about as many times (P,) as wide as it is taken already."""
    taken = problem.scales / problem.prior.prior[problem.free]
    return bool(np.abs(np.log(scales / taken)).max() < _RESCALED)


def _labels(problem: JointProblem, terms: list[Term], state: State) -> LabelErrors:
    """Judge the labels by what the presses show."""
    stated = np.array([press.sigma for press in problem.presses])
    return label_errors(stated, problem.labels.sigmas, _shown(problem, terms, state))


def _shown(problem: JointProblem, terms: list[Term], state: State) -> Shown:
    normal, _, blocks = reduced(problem, state, terms, limits=soft_limits(problem, state))
    off, spread = np.empty((len(terms), 3)), np.empty((len(terms), 3))
    along = list[F64]()
    for i, (term, (inverse, _)) in enumerate(zip(terms, blocks, strict=True)):
        alone = np.linalg.inv(term.own)
        off[i], spread[i] = alone @ term.towards_own, np.sqrt(np.diag(alone))
        along.append(term.mixed @ inverse)
    by_bench = np.concatenate(along, axis=1)
    covariance = block_diag(*(inverse for inverse, _ in blocks))
    covariance += by_bench.T @ np.linalg.solve(normal, by_bench)
    left = state.touches - [press.touch for press in problem.presses]
    return Shown(off + left, spread, left, covariance)


def _partly(stage: _Stage, prior: BenchEstimate, asked: Mask) -> BenchEstimate:
    """Take over the numbers that were asked for.

    No end of an edge counts as pushing: a number at that limit is not known by it to the limit's
    width, it may lie anywhere beyond.
    """
    shown = _described(stage, [], NO_LIMITS)
    return replace(
        shown,
        values=np.where(asked, shown.values, prior.values),
        covariance=considered(shown.covariance, prior.covariance, asked),
        held_out=_held_out(stage.problem, stage.state, stage.terms, prior, asked),
        shown=shown,
    )


def _described(stage: _Stage, causes: list[Numbers], limits: tuple[F64, F64]) -> BenchEstimate:
    problem, _, seen, bench, state, terms = stage
    numbers = len(problem.scales)
    normal, _, _ = reduced(problem, state, terms, limits=limits)
    slope = _shared_slope(problem, seen, state, bench.discrepancy)
    spread = widened(normal, slope)[:numbers, :numbers]
    index = np.flatnonzero(problem.free)
    values, covariance = state.values.copy(), problem.prior.covariance.copy()
    covariance[index] = covariance[:, index] = 0.0
    covariance[np.ix_(index, index)] = problem.scales[:, None] * spread * problem.scales
    if causes:
        change = _of_scales(problem, state, terms, causes)
        values[index] += change.mean
        covariance[np.ix_(index, index)] += change.covariance
    offset = np.zeros(2)
    if problem.free[_PLACE].all():
        sure = np.sqrt(np.diag(covariance)[_PLACE])
        offset = common_offset(problem.labels.sigmas, _shown(problem, terms, state), sure)
        covariance[_PLACE, _PLACE] += offset**2
    outliers = np.flatnonzero(problem.labels.outliers)
    return replace(
        bench,
        values=values,
        covariance=covariance,
        held_out=_held_out(problem, state, terms, problem.prior, problem.free),
        outliers=tuple(int(i) for i in outliers),
        label_offset=(float(offset[0]), float(offset[1])),
        label_sigma=_label_sigma(problem),
        touches=state.touches,
    )


def _of_scales(
    problem: JointProblem, state: State, terms: list[Term], causes: list[Numbers]
) -> Posterior:
    """Work out what the free numbers change by since the scales of causes are not known."""
    beside, by_numbers = deviation(state.values, problem.prior, problem.free)
    scales = problem.scales / problem.prior.prior[problem.free]
    known = information(problem, state, terms)
    whole = over_scales(known, causes, scales, np.eye(len(scales)))
    more = whole.covariance - posterior(known, scales).covariance
    back = problem.scales[:, None] * np.linalg.inv(by_numbers)
    to_numbers = back / scales
    return Posterior(to_numbers @ whole.mean - back @ beside, to_numbers @ more @ to_numbers.T)


def _label_sigma(problem: JointProblem) -> tuple[float, float]:
    """Typical σ of places, mm, and of forces, as a fraction; NaN where none is known."""
    forces = np.array([press.touch[2] for press in problem.presses])
    sigmas = problem.labels.sigmas[~problem.labels.outliers]
    place, force = sigmas[:, :2], sigmas[:, 2] / forces[~problem.labels.outliers]
    return _typical(place[np.isfinite(place)]), _typical(force[np.isfinite(force)])


def _typical(sigmas: F64) -> float:
    return float(np.median(sigmas)) if sigmas.size else nan


def widened(normal: F64, slope: F64) -> F64:
    """Covariance of numbers with a normal matrix whose slope has a further covariance, (P, P).

    That may take off a part, but no more than leaves `_MIN_PART`: touches that have moved since the
    presses were weighed would take off more than there was.
    """
    root = np.linalg.inv(np.linalg.cholesky(normal)).T
    parts, turned = np.linalg.eigh(root.T @ slope @ root)
    along = root @ turned
    spread = (along * np.maximum(1.0 + parts, _MIN_PART)) @ along.T
    return np.asarray(spread, dtype=np.float64)


def _shared_slope(
    problem: JointProblem, seen: Sequence[BenchForward], state: State, discrepancy: float
) -> F64:
    """Covariance (P + R, P + R) that an error of the model shared by all presses gives the slope.

    What a model leaves out it leaves out of every press: such an error does not average as noise
    does, and moves the bench as far as the presses are alike. In the scatter of the presses it
    counts as that of each; that part is taken off, or it would count twice. What a touch of unknown
    force takes of Young's modulus it takes here to the last digit: the error of a strong touch is
    many times its noise.
    """
    size = len(problem.scales) + problem.noises
    shared_by_all = np.zeros((size, len(seen[0].whitening)))
    of_each = np.zeros((size, size))
    sigmas = problem.labels.sigmas
    given = zip(problem.factors, problem.presses, seen, state.touches, sigmas, strict=True)
    for factor, press, on, touch, sigma in given:
        _, own, shared = whiten_all(problem, on, factor, press, touch)
        along = np.linalg.solve(own.T @ own + np.diag(sigma**-2.0), own.T @ shared)
        error = np.sqrt(own_error(on.read(touch[None])[0]))
        slope = error * (shared - own @ along).T @ solve_lower(factor, np.eye(len(factor)))
        shared_by_all += slope
        of_each += slope @ slope.T
    whole = discrepancy**2 * shared_by_all @ shared_by_all.T
    return whole - problem.discrepancy**2 * of_each


def considered(found: F64, prior: F64, asked: Mask) -> F64:
    """Covariance of a bench of which the numbers asked for are found, and the others stay.

    As in a Schmidt-Kalman filter: what is not asked for is as uncertain as it was, or more where
    presses say so, and what is found is uncertain with it.

    Parameters
    ----------
    found, prior : (63, 63) float64
        Covariance with all numbers found, and before.
    asked : (63,) bool
    """
    kept = np.flatnonzero(~asked & (np.diag(prior) > 0))
    square = np.ix_(kept, kept)
    root = np.linalg.cholesky(prior[square])
    half = solve_lower(root, solve_lower(root, found[square]).T)
    parts, turned = np.linalg.eigh(half)
    along = root @ turned
    covariance = found.copy()
    covariance[square] = prior[square] + (along * np.maximum(parts - 1.0, 0.0)) @ along.T
    return covariance


def _held_out(
    problem: JointProblem, state: State, terms: list[Term], prior: BenchEstimate, asked: Mask
) -> HeldOut | None:
    """Errors of presses that are taken out of the bench, to first order; not of outliers."""
    normal, slope, blocks = reduced(problem, state, terms, limits=soft_limits(problem, state))
    places: list[float] = []
    forces: list[float] = []
    for i, (term, press) in enumerate(zip(terms, problem.presses, strict=True)):
        if problem.labels.outliers[i]:
            continue
        inverse, towards = blocks[i]
        along = term.mixed @ inverse
        others = normal - (term.bench - along @ term.mixed.T)
        slope_of_others = slope - (term.towards - along @ towards)
        if not asked[problem.free].all():
            others, slope_of_others = _as_kept(
                problem, state, others, slope_of_others, prior, asked
            )
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


def _as_kept(
    problem: JointProblem,
    state: State,
    normal: F64,
    slope: F64,
    prior: BenchEstimate,
    asked: Mask,
) -> tuple[F64, F64]:
    """Return normal matrix and slope of a bench whose numbers that nobody asked for stay."""
    free, scales, numbers = problem.free, problem.scales, len(problem.scales)
    found = np.asarray(np.linalg.inv(normal), dtype=np.float64)
    step, before = found @ slope, found.copy()
    before[:numbers, :numbers] = prior.covariance[np.ix_(free, free)] / np.outer(scales, scales)
    noises = np.ones(problem.noises, dtype=bool)
    chosen = np.concatenate([asked[free], noises])
    step[~chosen] = ((prior.values - state.values)[free] / scales)[~asked[free]]
    precision = np.linalg.inv(considered(found, before, chosen))
    return np.asarray(precision, dtype=np.float64), precision @ step


def _rms(values: list[float]) -> float:
    return float(np.sqrt(np.mean(np.square(values))))
