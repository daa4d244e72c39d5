"""How many touches, and where: growing and thinning a set of touches until it explains.

Touches are added one by one, each where it explains most of what is left, as long as χ² falls by
more than chance allows. Greed can end beside the best fit: what does not explain the measurement is
looked for again, pair by pair, and a fit that followed the last frame is then begun afresh.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations
from math import sqrt

import numpy as np
from numpy.typing import NDArray

from models.forward.linear import LinearForward
from models.inverse.candidates import CandidateGrid
from models.inverse.levenberg_marquardt import Fit, descend, weak_or_close
from models.inverse.prior import Prior

# Fall of χ² that a touch must bring. Noise alone brought 19 at most in 3000 measurements; rendered
# frames, whose model is right to half a percent, 22 in 200.
GAIN = 25.0
COARSE = 0.01  # of χ², which a step must gain while touches are still missing
HOPE = 0.5  # of the fall of χ² wanted, which a candidate of the grid must promise
CLEAR = 10.0  # times `GAIN`: no doubt that a touch is there
UNUSUAL = 6.0  # standard deviations of χ² above its mean: the fit does not explain the measurement


@dataclass(frozen=True, eq=False)
class CountProblem:
    """What is to be explained, by what, and by how many touches; `known` if just so many."""

    measured: NDArray[np.float64]
    search: CandidateGrid
    prior: Prior
    limit: int
    known: bool

    @cached_property
    def gain(self) -> float:
        """Fall of χ² that a touch must bring: more than noise and the model's own errors do."""
        doubt = self.search.forward.doubt
        return GAIN + float(doubt**2 * (self.measured @ self.measured))

    @property
    def least(self) -> float:
        """Fall of χ² that a further touch must bring."""
        return 0.0 if self.known else self.gain

    def cost(self, fit: Fit) -> float:
        """χ², and `gain` for every touch, which must earn its place."""
        return fit.chi2 + self.gain * len(fit.touches)

    def fit(self, touches: NDArray, share: float = 0.0) -> Fit:
        """Touches of least χ² downhill of some; see `descend`."""
        if not len(touches):
            chi2 = float(self.measured @ self.measured)
            tangent = np.empty((0, len(self.measured)))
            return Fit(touches, self.measured, tangent, chi2, True, np.empty((0, 0)))
        forward, bounds = self.search.forward, self.search.bounds
        return descend(self.measured, forward, touches, bounds, self.prior, share)

    def freedom(self, fit: Fit) -> int:
        """Numbers measured, or known beforehand, less unknowns; 1 at least."""
        unknowns = (3 - self.prior.known) * len(fit.touches)
        return max(self.search.forward.freedom - unknowns, 1)

    def explained(self, fit: Fit) -> bool:
        """Whether touches leave no more than noise; else the fit may be a local minimum."""
        freedom = self.freedom(fit)
        if fit.chi2 > freedom + UNUSUAL * sqrt(2.0 * freedom) + self.gain - GAIN:
            return False
        return self.search.best(fit.residual, fit.jacobian)[1] <= HOPE * self.gain


def search_count(task: CountProblem, begun: Fit) -> Fit:
    """Find touches from those of the last frame on, and afresh where these mislead."""
    fit = _follow(task, begun if task.known else pruned(task, begun))
    if not len(begun.touches) or (len(fit.touches) == len(begun.touches) and task.explained(fit)):
        return fit
    return min(fit, _follow(task, task.fit(begun.touches[:0])), key=task.cost)


def _follow(task: CountProblem, fit: Fit) -> Fit:
    """Add touches that are missing: greedily, then with more effort if these explain too little.

    What a pair does is the sum of what two touches do where forces superpose, and only there.
    """
    grown = _add_touch(task, fit, lambda fit: fit)
    if not isinstance(task.search.forward, LinearForward) or task.explained(grown):
        return grown
    grown = min(grown, _add_touch(task, fit, lambda fit: _pairs_anew(task, fit)), key=task.cost)
    if task.explained(grown):
        return grown
    return min(grown, _too_many(task, grown), key=task.cost)


def _too_many(task: CountProblem, fit: Fit) -> Fit:
    """Add two touches more than allowed and leave out those that are needed least.

    It frees touches that share between them what others should explain.
    """
    allowed = len(fit.touches)
    richer = replace(task, limit=allowed + 2, known=True)
    fit = _add_touch(richer, fit, lambda fit: fit)
    while len(fit.touches) > allowed:
        fewer = (np.delete(fit.touches, i, axis=0) for i in range(len(fit.touches)))
        fit = min((task.fit(touches, COARSE) for touches in fewer), key=task.cost)
    return _pairs_anew(task, task.fit(fit.touches))


def _add_touch(task: CountProblem, fit: Fit, mend: Callable[[Fit], Fit]) -> Fit:
    """Add touches one by one, mending all after each, while χ² falls by more than it must."""
    while len(fit.touches) < task.limit:
        grown = _one_more(task, fit)
        if grown is None:
            break
        fit = mend(grown)
    return task.fit(fit.touches)


def _one_more(task: CountProblem, fit: Fit) -> Fit | None:
    """One touch more, where it explains most of what is left; None if χ² falls by too little.

    A candidate of the grid that promises less than `HOPE` of that is not worth a fit: between the
    candidates a touch is worth little more than on the best of them. It begins with the force that
    it would have if the others gave way; where that gets stuck, with what it would explain alone:
    next to nothing where others have taken its part, and so free to slide.
    """
    index, gain, force = task.search.best(fit.residual, fit.jacobian)
    if gain <= HOPE * task.least:
        return None
    response = task.search.response[index]
    alone = max(fit.residual @ response / (response @ response), 0.0)
    for begun, share in ((force, COARSE), (alone, COARSE), (alone, 0.0)):
        grown = task.fit(np.vstack([fit.touches, [*task.search.xy[index], begun]]), share)
        if fit.chi2 - grown.chi2 > task.least:
            return grown
    return None


def _pairs_anew(task: CountProblem, fit: Fit) -> Fit:
    """Look for each pair of touches again among all pairs of candidates, until all is explained.

    Twice, since a pair that moved makes way for others.
    """
    for pair in 2 * list(combinations(range(len(fit.touches)), 2)):
        if task.explained(fit):
            break
        others = np.delete(fit.touches, pair, axis=0)
        predicted, tangent = task.search.forward.read(others)
        places, force = task.search.best_pair(task.measured - predicted, tangent)
        again = np.vstack([others, np.column_stack([task.search.xy[places], force])])
        fit = min(fit, task.fit(again, COARSE), key=task.cost)
    return fit


def pruned(task: CountProblem, fit: Fit) -> Fit:
    """Leave out touches, one by one, without which χ² rises by less than a touch must bring."""
    while len(fit.touches):
        tried = [task.fit(fewer) for fewer in _with_one_less(fit, task.gain)]
        fewer = min(tried, key=task.cost, default=fit)
        if task.cost(fewer) >= task.cost(fit):
            break
        fit = fewer
    return fit


def _with_one_less(fit: Fit, gain: float) -> Iterator[NDArray[np.float64]]:
    """Touches without the weakest, or with the two merged that are least apart.

    A touch whose force stands far out of its own noise, and two that stand well apart, need no
    second fit to be kept.
    """
    touches = fit.touches
    weakest, evidence, i, j, apart = weak_or_close(touches, fit.spread)
    if evidence <= CLEAR * gain:
        yield np.delete(touches, weakest, axis=0)
    if apart <= CLEAR * gain:
        merged = np.delete(touches, j, axis=0)
        force = touches[i, 2] + touches[j, 2]
        if force > 0:
            merged[i] = (touches[i] * touches[i, 2] + touches[j] * touches[j, 2]) / force
        merged[i, 2] = force
        yield merged
