"""What of a bench is not as described: the causes tried one by one, and named by what they explain.

A few touches of unknown place and force are fitted once on the bench as it is described, and once
more for each cause with the numbers of that cause free. What explains the touches best is named
with its size; where others explain them nearly as well, they are named with it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from math import sqrt

import numpy as np

import fe
from models.bench.bench import NAMES, UNITS, BenchEstimate
from models.bench.identify import COARSE
from models.bench.joint import JointProblem, State, Term, descend, pose, scatters, stand, through
from models.bench.press import Press
from models.forward.bench_forward import BenchForward
from models.forward.camera_change import CAMERA, CameraChange

_LENS, _FOCAL = ("k1", "k2"), ("focal",)
_POSE = tuple(name for name, _ in CAMERA if name not in (*_LENS, *_FOCAL))


def _starting(*starts: str) -> tuple[str, ...]:
    return tuple(name for name, _ in fe.BENCH_PARAMETERS if name.startswith(starts))


CAUSES: dict[str, tuple[str, ...]] = {
    "clamps that give": _starting("rotation", "membrane"),
    "a plate that is not flat": _starting("sag"),
    "tension in the plate": _starting("tension"),
    "uneven thickness": _starting("thickness_"),
    "the camera's pose": _POSE,
    "the focal length": _FOCAL,
    "the lens": _LENS,
}
"""Numbers of the bench by what they are; not Young's modulus, of which touches of unknown force
tell nothing."""

# Fall of χ², beside 1 for each number, that a cause must bring to be named.
_GAIN = 25.0
# Standard deviations of χ² above its mean: one cause does not explain all.
_UNUSUAL = 6.0
# χ² by which another cause may explain less than the best and be named with it.
_ALIKE = 12.0


@dataclass(frozen=True)
class Cause:
    """One cause, and what it explains.

    Attributes
    ----------
    name : str
        One of `CAUSES`.
    chi2 : float
        With its numbers free.
    size : dict of str to float
        Its numbers, in the units of `BENCH`.
    """

    name: str
    chi2: float
    size: dict[str, float]

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
    """

    chi2: float
    freedom: int
    causes: tuple[Cause, ...]

    @property
    def named(self) -> tuple[Cause, ...]:
        """The causes that explain the touches; none where the bench is as described."""
        best = self.causes[0]
        if self.chi2 - best.chi2 < _GAIN + len(best.size):
            return ()
        near = (each for each in self.causes if each.chi2 - len(best.size) - best.chi2 < _ALIKE)
        return tuple(each for each in near if self.chi2 - each.chi2 >= _GAIN)

    @property
    def sentence(self) -> str:
        """State it for the user."""
        if not self.named:
            return "The bench is as the scene says, as far as these touches tell."
        what = " or ".join(f"{each.name} ({each.largest})" for each in self.named)
        left = self.causes[0].chi2 - self.freedom
        more = ", and more than that" if left > _UNUSUAL * sqrt(2.0 * self.freedom) else ""
        return f"Not as the scene says: {what}{more}; calibrate the bench."


def diagnose(
    forward: BenchForward,
    presses: Sequence[Press],
    prior: BenchEstimate,
    look: CameraChange | None = None,
    progress: Callable[[int, int], object] | None = None,
) -> Diagnosis:
    """Find what of the bench touches show to be otherwise than described.

    Parameters
    ----------
    forward, presses, prior, look
        As for `identify`; eight touches of unknown place and force are enough.
    progress : callable, optional
        Called with the causes tried and their number.
    """
    causes = {name: free for name, free in CAUSES.items() if look or free[0] in _starting("")}
    tried: list[Cause] = []
    described = _fitted(forward, pose(presses, prior, look, (), forward), look)
    for name, free in causes.items():
        problem = pose(presses, prior, look, free, forward)
        state, chi2 = _fitted(forward, problem, look)
        tried.append(Cause(name, chi2, _by_size(problem, state)))
        if progress is not None:
            progress(len(tried), len(causes))
    freedom = sum(through(forward, press).freedom - 3 for press in presses)
    return Diagnosis(described[1], freedom, tuple(sorted(tried, key=lambda cause: cause.chi2)))


def _fitted(
    forward: BenchForward, problem: JointProblem, look: CameraChange | None
) -> tuple[State, float]:
    """Fit touches and free numbers; χ² with the priors of both."""
    state = State(problem.prior.values.copy(), np.array([one.touch for one in problem.presses]))
    on, terms = stand(forward, state.values, look), list[Term]()
    for discrepancy in (COARSE, problem.prior.discrepancy):
        factors = [each.factor(discrepancy) for each in scatters(problem, on, state)]
        state, terms, _ = descend(replace(problem, factors=factors), on, state, terms)
        on = stand(on, state.values, look)
    beside = (state.values - problem.prior.values)[problem.free] / problem.scales
    return state, sum(term.chi2 for term in terms) + float(beside @ beside)


def _by_size(problem: JointProblem, state: State) -> dict[str, float]:
    """Numbers that were free, that which is largest in parts of its prior first."""
    off = np.abs(state.values - problem.prior.values) / np.maximum(problem.prior.prior, 1e-300)
    names = [name for name, free in zip(NAMES, problem.free, strict=True) if free]
    names.sort(key=lambda name: -off[NAMES.index(name)])
    return {name: float(state.values[NAMES.index(name)]) for name in names}
