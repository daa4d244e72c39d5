"""How many touches, and where: greedy forward selection and backward elimination.

Touches are added one by one, each where it explains most of what is left, as long as χ² falls by
more than noise allows. Greed can end beside the best fit: what does not explain the measurement is
looked for again, pair by pair, and a fit that followed the last frame is then begun afresh.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import combinations
from math import sqrt

import numpy as np

from models.arrays import F64
from models.estimate import SolverStats
from models.forward.linear import LinearForward
from models.inverse.candidates import CandidateGrid, unexplained
from models.inverse.descent_kernel import weak_or_close
from models.inverse.levenberg_marquardt import Fit, LevenbergMarquardt
from models.inverse.prior import Prior

# Fall of χ² that a touch must bring. Noise alone brought 19 at most in 3000 measurements; rendered
# frames, whose model is right to half a percent, 22 in 200.
GAIN = 25.0
COARSE = 0.01  # of χ², which a step must gain while touches are still missing
HOPE = 0.5  # of the fall of χ² wanted, which a candidate of the grid must promise
CLEAR = 10.0  # times `GAIN`: a touch is there for sure
SCORED = 4.0  # times `GAIN`, by which a score must rule fewer touches out: models are not linear
UNUSUAL = 6.0  # standard deviations of χ² above its mean: the fit does not explain the measurement


@dataclass(frozen=True, eq=False)
class CountProblem:
    """What is to be explained, by what, and by how many touches.

    Attributes
    ----------
    measured : (m,) float64
        In units of its noise.
    candidates : CandidateGrid
    prior : Prior
    solver : LevenbergMarquardt
    max_touches : int
    exact : bool
        Whether there are just so many touches.
    effort : list of (int, int)
        Steps and evaluations of every descent so far.
    """

    measured: F64
    candidates: CandidateGrid
    prior: Prior
    solver: LevenbergMarquardt
    max_touches: int
    exact: bool
    effort: list[tuple[int, int]] = field(default_factory=list[tuple[int, int]])

    @cached_property
    def gain(self) -> float:
        """Fall of χ² that a touch must bring: more than noise and the model's own errors do."""
        error = self.candidates.forward.model_error
        return GAIN + float(error**2 * (self.measured @ self.measured))

    @property
    def superposed(self) -> bool:
        """Whether what touches do adds up."""
        return isinstance(self.candidates.forward, LinearForward)

    @property
    def min_fall(self) -> float:
        """Fall of χ² that a further touch must bring."""
        return 0.0 if self.exact else self.gain

    def cost(self, fit: Fit) -> float:
        """χ², and `gain` for every touch, which must earn its place."""
        return fit.chi2 + self.gain * len(fit.touches)

    def fit(self, touches: F64, relative_tolerance: float = 0.0) -> Fit:
        """Touches of least χ² downhill of some; see `LevenbergMarquardt.descend`."""
        if not len(touches):
            return _without_touch(self.measured)
        fit = self.solver.descend(
            self.candidates.forward,
            self.measured,
            touches,
            bounds=self.candidates.bounds,
            prior=self.prior,
            relative_tolerance=relative_tolerance,
        )
        self.effort.append((fit.steps, fit.evaluations))
        return fit

    def ruled_out(self, touches: F64, fit: Fit) -> bool:
        """Whether other touches explain less than a fit, whatever their descent would find.

        By the score (Rao 1948): what one linear step from where they are cannot take away. It costs
        a reading of the forward model, a descent several.
        """
        if not len(touches):
            return False
        predicted, tangent = self.candidates.forward.read(touches)
        return unexplained(self.measured - predicted, tangent) > fit.chi2 + SCORED * self.gain

    def stats(self, fit: Fit) -> SolverStats:
        """State what it took so far, and whether the fit that is kept converged."""
        steps, evaluations = (sum(each) for each in zip((0, 0), *self.effort, strict=True))
        return SolverStats(len(self.effort), steps, evaluations, fit.converged)

    def freedom(self, fit: Fit) -> int:
        """Numbers measured, or known beforehand, less unknowns; 1 at least."""
        unknowns = (3 - self.prior.known) * len(fit.touches)
        return max(self.candidates.forward.freedom - unknowns, 1)

    def explained(self, fit: Fit) -> bool:
        """Whether touches leave no more than noise; else the fit may be a local minimum."""
        freedom = self.freedom(fit)
        if fit.chi2 > freedom + UNUSUAL * sqrt(2.0 * freedom) + self.gain - GAIN:
            return False
        return self.candidates.best(fit.residual, fit.jacobian)[1] <= HOPE * self.gain


def _without_touch(measured: F64) -> Fit:
    """Fit of nothing."""
    chi2, nothing = float(measured @ measured), np.empty((0, 3))
    return Fit(nothing, measured, np.empty((0, len(measured))), chi2, True, 0, 0, nothing[:, :0])


def search_count(problem: CountProblem, begun: Fit) -> Fit:
    """Find touches from those of the last frame on, and afresh where these mislead."""
    fit = _follow(problem, begun if problem.exact else pruned(problem, begun))
    if not len(begun.touches):
        return fit
    if problem.explained(fit):
        if len(fit.touches) == len(begun.touches):
            return fit
    elif len(fit.touches) == problem.max_touches == 2 and problem.superposed:
        return fit  # the best of all pairs of candidates, see `_too_many`
    return min(fit, _follow(problem, problem.fit(begun.touches[:0])), key=problem.cost)


def _follow(problem: CountProblem, fit: Fit) -> Fit:
    """Add touches that are missing: greedily, then with more effort if these explain too little.

    What a pair does is the sum of what two touches do where forces superpose, and only there.
    """
    larger = _add_touch(problem, fit, lambda fit: fit)
    if not problem.superposed or problem.explained(larger):
        return larger
    larger = min(
        larger, _add_touch(problem, fit, lambda fit: _pairs_anew(problem, fit)), key=problem.cost
    )
    if problem.explained(larger):
        return larger
    return min(larger, _too_many(problem, larger), key=problem.cost)


def _too_many(problem: CountProblem, fit: Fit) -> Fit:
    """Add two touches more than allowed and leave out those that are needed least.

    It frees touches that explain between them what others should.
    """
    allowed = len(fit.touches)
    richer = replace(problem, max_touches=allowed + 2, exact=True)
    fit = _add_touch(richer, fit, lambda fit: fit)
    while len(fit.touches) > allowed:
        fewer = (np.delete(fit.touches, i, axis=0) for i in range(len(fit.touches)))
        fit = min((problem.fit(touches, COARSE) for touches in fewer), key=problem.cost)
    return _pairs_anew(problem, problem.fit(fit.touches))


def _add_touch(problem: CountProblem, fit: Fit, improve: Callable[[Fit], Fit]) -> Fit:
    """Add touches one by one, improving all after each, while χ² falls by more than it must."""
    while len(fit.touches) < problem.max_touches:
        larger = _one_more(problem, fit)
        if larger is None:
            break
        fit = improve(larger)
    return problem.fit(fit.touches)


def _one_more(problem: CountProblem, fit: Fit) -> Fit | None:
    """One touch more, where it explains most of what is left; None if χ² falls by too little.

    A candidate of the grid that promises less than `HOPE` of that is not worth a fit: between the
    candidates a touch is worth little more than on the best of them. It begins with the force that
    it would have if the others gave way; where that leads no further, with what it would explain
    alone: next to nothing where others have taken its part, and so free to slide.
    """
    index, gain, force = problem.candidates.best(fit.residual, fit.jacobian)
    if gain <= HOPE * problem.min_fall:
        return None
    response = problem.candidates.response[index]
    alone = max(fit.residual @ response / (response @ response), 0.0)
    for begun, tolerance in ((force, COARSE), (alone, COARSE), (alone, 0.0)):
        larger = problem.fit(
            np.vstack([fit.touches, [*problem.candidates.xy[index], begun]]), tolerance
        )
        if fit.chi2 - larger.chi2 > problem.min_fall:
            return larger
    return None


def _pairs_anew(problem: CountProblem, fit: Fit) -> Fit:
    """Look for each pair of touches again among all pairs of candidates, until all is explained.

    Twice, since a pair that moved makes way for others.
    """
    for pair in 2 * list(combinations(range(len(fit.touches)), 2)):
        if problem.explained(fit):
            break
        others = np.delete(fit.touches, pair, axis=0)
        predicted, tangent = problem.candidates.forward.read(others)
        places, force = problem.candidates.best_pair(problem.measured - predicted, tangent)
        again = np.vstack([others, np.column_stack([problem.candidates.xy[places], force])])
        fit = min(fit, problem.fit(again, COARSE), key=problem.cost)
    return fit


def pruned(problem: CountProblem, fit: Fit) -> Fit:
    """Leave out touches, one by one, without which χ² rises by less than a touch must bring."""
    while len(fit.touches):
        tried = [
            problem.fit(fewer)
            for fewer in _with_one_less(fit, problem.gain)
            if not problem.ruled_out(fewer, fit)
        ]
        fewer = min(tried, key=problem.cost, default=fit)
        if problem.cost(fewer) >= problem.cost(fit):
            break
        fit = fewer
    return fit


def _with_one_less(fit: Fit, gain: float) -> Iterator[F64]:
    """Touches without the weakest, or with the two merged that are least apart.

    A touch whose force stands far out of its own noise, and two that stand well apart, need no
    second fit to be kept.
    """
    touches = fit.touches
    weakest, evidence, i, j, apart = weak_or_close(touches, fit.covariance)
    if evidence <= CLEAR * gain:
        yield np.delete(touches, weakest, axis=0)
    if apart <= CLEAR * gain:
        merged = np.delete(touches, j, axis=0)
        force = touches[i, 2] + touches[j, 2]
        if force > 0:
            merged[i] = (touches[i] * touches[i, 2] + touches[j] * touches[j, 2]) / force
        merged[i, 2] = force
        yield merged
