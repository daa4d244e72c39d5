"""What of a bench is not as described: the causes tried one by one, and named by what they explain.

A few touches of unknown place and force are fitted on the bench as it is described. Where the
slopes of χ² by the numbers of some cause accuse it, see `score_test`, they are fitted once more for
each cause with its numbers free. What explains the touches best is named with its size; where
others explain them nearly as well, they are named with it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from math import sqrt
from typing import NamedTuple

import numpy as np

import fe
from models.arrays import F64, Mask
from models.bench.bench import NAMES, UNITS, BenchEstimate, prior_sigma
from models.bench.causes import CAUSES
from models.bench.deviation import deviation
from models.bench.identify import COARSE
from models.bench.joint import (
    JointProblem,
    State,
    Term,
    descend,
    pose,
    stand,
    start,
    through,
    views,
)
from models.bench.press import Press
from models.bench.scatter import weighed
from models.bench.score_test import FALSE_ALARM, Slopes, slopes
from models.bench.words import in_words
from models.forward.bench_forward import BenchForward
from models.forward.camera_change import Look

_PLATE = {name for name, _ in fe.BENCH_PARAMETERS}
# Standard deviations of χ² above its mean: one cause does not explain all.
_UNUSUAL = 6.0
NO_CAUSE = (
    "touches are other than the theory has them, or what hides the pattern is too small to be seen;"
    " press with one finger, or calibrate the bench"
)
"""What may be wrong where nothing of the bench explains it."""
# χ² by which another cause may explain less than the best and be named with it.
_ALIKE = 12.0
# Of the fall of χ² of the best, by which a cause may look worse with a camera to first order: a
# turn of 1° moves what it does by 1e-2 of itself.
_SECOND_ORDER = 0.02


@dataclass(frozen=True)
class Cause:
    """One cause, and what it explains.

    Attributes
    ----------
    name : str
        One of `CAUSES`.
    chi2 : float
        With its numbers free; to first order where the bench is as described.
    size : dict of str to float
        Its numbers, in the units of `BENCH`.
    p_value : float
        Probability that a bench as described looks as much like it, see `score_test`.
    """

    name: str
    chi2: float
    size: dict[str, float]
    p_value: float

    @property
    def largest(self) -> str:
        """The number that is largest in parts of what a usual bench has, with value and unit."""
        name, value = next(iter(self.size.items()))
        return f"{name} = {value:.3g} {UNITS[name]}".removesuffix(" 1")


@dataclass(frozen=True)
class Diagnosis:
    """Whether a bench is as described, and what explains it if it is not.

    Attributes
    ----------
    chi2 : float
        Of the touches on the bench as it is described.
    freedom : int
        Numbers measured less unknowns.
    causes : tuple of Cause
        All that were tried, the best first.
    prior : BenchEstimate
        The bench as it is described: by its scene, or by a calibration.
    plate : fe.Plate
        Of the scene.
    """

    chi2: float
    freedom: int
    causes: tuple[Cause, ...]
    prior: BenchEstimate
    plate: fe.Plate

    @property
    def p_value(self) -> float:
        """Probability that a bench as described looks as much like any cause."""
        return min(1.0, len(self.causes) * min(cause.p_value for cause in self.causes))

    @property
    def named(self) -> tuple[Cause, ...]:
        """The causes that explain the touches; none where the bench is as described."""
        if self.p_value >= FALSE_ALARM:
            return ()
        limit = self.causes[0].chi2 + _ALIKE
        return tuple(each for each in self.causes if each.chi2 - len(each.size) < limit)

    @property
    def explained(self) -> bool:
        """Whether the best cause leaves no more than noise."""
        left = min(self.chi2, self.causes[0].chi2) - self.freedom
        return left <= _UNUSUAL * sqrt(2.0 * self.freedom)

    @property
    def sentence(self) -> str:
        """State it for the user."""
        described = "the scene says" if self.prior.is_prior else "calibrated"
        if self.named:
            what = " or ".join(f"{each.name} ({self._in_words(each)})" for each in self.named)
            more = "" if self.explained else ", and more than that"
            return f"Not as {described}: {what}{more}; calibrate the bench."
        if self.explained:
            return f"The bench is as {described}, as far as these touches tell."
        return f"The bench may be as {described}, and the images do not fit it: {NO_CAUSE}."

    def _in_words(self, cause: Cause) -> str:
        """State the largest number of a cause, beside what is described."""
        name, value = next(iter(cause.size.items()))
        return in_words(name, value - self.prior[name][0], self.plate)


def diagnose(
    forward: BenchForward,
    presses: Sequence[Press],
    prior: BenchEstimate,
    look: Look | None = None,
    progress: Callable[[int, int], object] | None = None,
) -> Diagnosis:
    """Find what of the bench touches show to be otherwise than described.

    Where they accuse no cause beyond the rate of false alarms, causes are tried to first order;
    where they do, each is fitted. Of a bench that was calibrated, that is what has changed since,
    by as much as a bench may differ from its scene; what the calibration is not sure of accuses
    nothing.

    Parameters
    ----------
    forward, presses, prior, look
        As for `identify`; eight touches of unknown place and force are enough.
    progress : callable, optional
        Called with the causes tried and their number.
    """
    known, prior = prior, _usual(prior, forward.plate)
    causes = {name: free for name, free in CAUSES.items() if look or free[0] in _PLATE}
    on = stand(forward, prior.values, look)

    def asked(free: Sequence[str]) -> JointProblem:
        return pose(presses, prior, look, free, forward).apart

    problem = asked(sum(causes.values(), ()))
    described = _fitted(replace(problem, free=_NONE, scales=np.empty(0)), on)
    near = slopes(replace(problem, factors=described.problem.factors), on, described.state)
    near = near.less_sure(_unsure(known, prior, near.free))
    tried = [_first_order(each, near.of(free), prior, described) for each, free in causes.items()]
    freedom = sum(through(forward, press).freedom - 3 for press in presses)
    ordered = tuple(sorted(tried, key=_explained))
    found = Diagnosis(described.chi2, freedom, ordered, known, forward.plate)
    if found.named:
        fits = _each(causes, asked, on, progress)
        fits = _looked_at_closely(fits, described.chi2, look)
        tried = [_as_fitted(each, fits[each.name]) for each in tried]
        found = replace(found, causes=tuple(sorted(tried, key=_explained)))
    if progress is not None:
        progress(len(causes), len(causes))
    return found


_NONE = np.zeros(len(NAMES), dtype=bool)


class _Fit(NamedTuple):
    """Presses as weighed, touches and free numbers as they fit best, χ² with the priors of both."""

    problem: JointProblem
    on: BenchForward
    state: State
    chi2: float


def _fitted(problem: JointProblem, on: BenchForward, state: State | None = None) -> _Fit:
    """Fit touches and free numbers, through a camera to first order about that of `on`."""
    if state is None:
        state = start(problem)
    terms = list[Term]()
    for discrepancy in (COARSE, problem.prior.discrepancy):
        here = on.moved(state.values)
        problem = weighed(problem, views(here, problem, terms), state, discrepancy)
        state, terms, _ = descend(problem, on, state, terms)
    beside = deviation(state.values, problem.prior, problem.free)[0]
    chi2 = sum(term.chi2 for term in terms) + float(beside @ beside)
    return _Fit(problem, on, state, chi2)


def _each(
    causes: Mapping[str, tuple[str, ...]],
    asked: Callable[[Sequence[str]], JointProblem],
    on: BenchForward,
    progress: Callable[[int, int], object] | None,
) -> dict[str, _Fit]:
    """Fit the numbers of each cause, the camera's to first order."""
    fits: dict[str, _Fit] = {}
    for name, free in causes.items():
        fits[name] = _fitted(asked(free), on)
        if progress is not None:
            progress(len(fits), len(causes) + 1)
    return fits


def _looked_at_closely(
    fits: dict[str, _Fit], described: float, look: Look | None
) -> dict[str, _Fit]:
    """Fit those once more that may be the best, about where the camera was found to stand."""
    best = min(fit.chi2 for fit in fits.values())
    limit = best + _ALIKE + _SECOND_ORDER * (described - best)
    closely = {
        name: _fitted(fit.problem, stand(fit.on, fit.state.values, look), fit.state)
        for name, fit in fits.items()
        if fit.chi2 - len(fit.problem.scales) < limit
    }
    return fits | closely


def _as_fitted(cause: Cause, fit: _Fit) -> Cause:
    size = _by_size(fit.problem.free, fit.state.values, fit.problem.prior)
    return replace(cause, chi2=fit.chi2, size=size)


def _usual(known: BenchEstimate, plate: fe.Plate) -> BenchEstimate:
    """Return how far a bench may be from what is known of it: as far as a usual one from its scene.

    A camera that boards were seen by may have been knocked since.
    """
    sigma = known.prior.copy()
    measured = [name in known.measured for name in NAMES]
    sigma[measured] = prior_sigma(plate)[measured]
    return replace(known, covariance=np.diag(sigma**2), prior=sigma, measured=())


def _unsure(known: BenchEstimate, usual: BenchEstimate, free: Mask) -> F64:
    """Return what is not known and accuses nothing, in parts of each usual σ, (P, P).

    Before any press that is what boards leave of a camera alone.
    """
    counts = [not known.is_prior or name in known.measured for name in NAMES]
    unsure = np.where(np.outer(counts, counts), known.covariance, 0.0)
    scales = usual.prior[free]
    return unsure[np.ix_(free, free)] / np.outer(scales, scales)


def _explained(cause: Cause) -> float:
    return cause.chi2


def _first_order(name: str, near: Slopes, prior: BenchEstimate, described: _Fit) -> Cause:
    """Return a cause by what it promises about the bench as described."""
    values = prior.values.copy()
    values[near.free] += prior.sigma[near.free] * near.step
    size = _by_size(near.free, values, prior)
    return Cause(name, described.chi2 - near.fall, size, near.p_value)


def _by_size(free: Mask, values: F64, prior: BenchEstimate) -> dict[str, float]:
    """Numbers that were free, that which is largest in parts of its prior first."""
    off = np.abs(values - prior.values) / np.maximum(prior.prior, 1e-300)
    names = [name for name, one in zip(NAMES, free, strict=True) if one]
    names.sort(key=lambda name: -off[NAMES.index(name)])
    return {name: float(values[NAMES.index(name)]) for name in names}
