"""Touches from strain, or from any measurement that a forward model explains.

What does not depend on the measurement is made once: an estimator is a value, to be used for every
frame.
"""

from __future__ import annotations

from dataclasses import KW_ONLY, InitVar, dataclass, field, replace

import numpy as np
from numpy.typing import ArrayLike

import fe
from models.arrays import F64
from models.bench.bench import BenchEstimate
from models.bench.marginal import traces_after
from models.bench.traces import NO_TRACES, Traces
from models.checks import check_integer, read_array
from models.estimate import Estimate
from models.forward.bench_forward import BenchForward
from models.forward.gauges import gauge_forward
from models.forward.linear import Forward, LinearForward
from models.inverse.candidates import CandidateGrid, prepare_candidates
from models.inverse.force_interval import ForceProfile, asymmetric, with_force_intervals
from models.inverse.friction import check_friction, with_friction
from models.inverse.levenberg_marquardt import LevenbergMarquardt
from models.inverse.marginal_search import Uncertain, find_on_bench
from models.inverse.prior import FLAT, Prior
from models.inverse.relevant import by_relevance
from models.inverse.solver import STANDARD, check_measured, find, read_start


@dataclass(frozen=True, eq=False)
class Estimator:
    """Everything that is prepared once to find touches in measurement after measurement.

    Attributes
    ----------
    forward : Forward
    max_touches : int
        Largest number of touches looked for.
    prior : Prior
        What is known of every touch beforehand.
    solver : LevenbergMarquardt
    bench : BenchEstimate, optional
        What is known of the bench, where the forward model is a `BenchForward`, which is put on its
        most likely values: it enters count, touches and covariance.
    friction : float
        Standard deviation of the force along the face, along x and along y, over that into the
        plate; see `with_friction`.
    grid : CandidateGrid, optional
        Candidates of this forward model, where they are known already.
    candidates : CandidateGrid
        Those in use.

    Raises
    ------
    ValueError
        If `max_touches` is no whole number of 0 or more, friction is negative, the candidates are
        those of another forward model, or a bench is given for a forward model that has none.
    """

    forward: Forward
    _: KW_ONLY
    max_touches: int = 4
    prior: Prior = FLAT
    solver: LevenbergMarquardt = STANDARD
    bench: BenchEstimate | None = None
    friction: float = 0.0
    grid: InitVar[CandidateGrid | None] = None
    candidates: CandidateGrid = field(init=False)
    _uncertain: Uncertain | None = field(init=False, repr=False)

    def __post_init__(self, grid: CandidateGrid | None) -> None:
        """Prepare the candidates."""
        check_integer("max_touches", self.max_touches, 0, "use 4")
        check_friction(self.friction)
        self._stand_on_bench()
        if grid is None and isinstance(self.forward, LinearForward):
            object.__setattr__(self, "forward", self.forward.often())
        candidates = prepare_candidates(self.forward) if grid is None else grid
        if candidates.forward is not self.forward:
            raise ValueError(
                "candidates are those of another forward model; ask with_forward(grid, forward)"
            )
        object.__setattr__(self, "candidates", candidates.prepare())
        uncertain = None if self.bench is None else Uncertain(self.bench, self.candidates)
        object.__setattr__(self, "_uncertain", uncertain)

    def without_memory(self, measured: F64, left: Traces) -> F64:
        """Take what the plate of a bench still shows of touches that ended off it, (m,)."""
        if self._uncertain is None or not len(left):
            return measured
        return self._uncertain.without_memory(measured, left)

    def traces_after(self, measured: F64, touches: F64, left: Traces) -> Traces:
        """Take in what a frame (m,) with touches (n, 3) tells of the traces of those that ended."""
        if self.bench is None or not isinstance(self.forward, BenchForward) or not len(left):
            return left
        return traces_after(self.forward, self.bench, measured, touches, left)

    def by_relevance(self, estimate: Estimate, measured: F64, left: Traces = NO_TRACES) -> Estimate:
        """Return an estimate with each cause of a bench as wide as the frame itself shows.

        It is another one only where nothing is known of the bench but its scene, and where no
        interval stands for a force: χ² is no parabola there, as the step to it would have it. To
        follow touches from frame to frame keep what `fit_whitened` finds: it explains the frame by
        the whole prior of the bench, as the traces of touches that ended take it.

        Parameters
        ----------
        estimate : Estimate
        measured, left
            As for `with_force_intervals`.
        """
        bench, forward = self.bench, self.forward
        if bench is None or not bench.is_prior or not isinstance(forward, BenchForward):
            return estimate
        known = not bench.prior.any() or not np.isfinite(estimate.covariance).all()
        if known or not estimate.count or any(estimate.force_intervals):
            return estimate
        found = by_relevance(estimate, forward, bench, measured, left, self.prior)
        return found if found is estimate else with_friction(found, forward.plate, self.friction)

    def with_force_intervals(
        self, estimate: Estimate, measured: F64, left: Traces = NO_TRACES
    ) -> Estimate:
        """Return an estimate with intervals of the forces that its covariance says too little of.

        That is of touches within 25 mm of an edge, and of forces known to less than a fifth. It
        costs some seven readings of the forward model for each, and nothing where there is none.

        Parameters
        ----------
        estimate : Estimate
        measured : (m,) float64
            What it is of, in units of its noise, as for `fit_whitened`.
        left : Traces
            As for `fit_whitened`.
        """
        wanted = asymmetric(estimate, self.forward.plate.size)
        if not wanted.any():
            return replace(estimate, force_intervals=(None,) * estimate.count)
        if self._uncertain is None:
            forward = self.forward
        else:
            touches = np.column_stack([estimate.xy, estimate.force])
            forward = self._uncertain.forward_about(touches, left)
            measured = forward.whitened(measured)
        profile = ForceProfile(measured, forward, self.candidates.bounds, self.prior)
        return with_force_intervals(estimate, wanted, profile)

    def _stand_on_bench(self) -> None:
        """Put the forward model on the bench that is most likely, where it is not there yet."""
        if self.bench is None:
            return
        if not isinstance(self.forward, BenchForward):
            raise ValueError(
                f"a bench needs the forward model of a bench, got a {type(self.forward).__name__};"
                " prepare its motions with BenchFields"
            )
        if not np.array_equal(self.forward.fields.values, self.bench.values):
            object.__setattr__(self, "forward", self.forward.moved(self.bench.values))

    def fit(
        self, measured: ArrayLike, start: ArrayLike | None = None, *, count: int | None = None
    ) -> Estimate:
        """Find touches from a measurement as it was taken: strain of gauges, say.

        Parameters
        ----------
        measured : (M, c) array
            In the units of the forward model; what it leaves out may be NaN.
        start, count
            As for `fit_whitened`.

        Raises
        ------
        ValueError
            As `fit_whitened`.
        """
        return self.fit_whitened(self.forward.whiten(measured), start, count=count)

    def fit_whitened(
        self,
        measured: F64,
        start: ArrayLike | None = None,
        *,
        count: int | None = None,
        left: Traces = NO_TRACES,
    ) -> Estimate:
        """Find touches from a measurement in units of its noise, (m,); see `find`.

        Parameters
        ----------
        measured : (m,) float64
        start : (n, 3) array, mm, mm, N, optional
            x, y, F of the last frame's touches: the fit begins there.
        count : int, optional
            Number of touches where it is known.
        left : Traces
            What the plate of a `bench` may still show of touches that ended.

        Raises
        ------
        ValueError
            If the measurement does not fit the forward model, it or the start is not finite, the
            start is not x, y, F of touches, or a count is negative.
        """
        if self._uncertain is not None:
            found = find_on_bench(
                check_measured(measured, self.candidates),
                self._uncertain,
                start=read_start(() if start is None else start),
                left=left,
                count=count,
                max_touches=self.max_touches,
                prior=self.prior,
                solver=self.solver,
            )
        else:
            found = find(
                measured,
                self.candidates,
                start=() if start is None else start,
                count=count,
                max_touches=self.max_touches,
                prior=self.prior,
                solver=self.solver,
            )
        return with_friction(found, self.forward.plate, self.friction)


def solve(
    strain: ArrayLike,
    influence: fe.Influence,
    sigma: ArrayLike | None = None,
    count: int | None = None,
    max_touches: int = 4,
    covariance: ArrayLike | None = None,
    prior: Prior = FLAT,
) -> Estimate:
    """Find touches from strain at gauges, once; use an `Estimator` for frame after frame.

    Parameters
    ----------
    strain : (M, 3) array, strain
        exx, eyy, exy at the gauges of `influence`; not finite for a channel that is missing.
    influence : fe.Influence
    sigma : float, (M,) or (M, 3), strain
        Standard deviation of each channel.
    count : int, optional
        Number of touches where it is known; found from the data otherwise.
    max_touches : int
        Largest number of touches looked for.
    covariance : (M, 3, 3) or (3M, 3M), strain²
        Instead of sigma, where the noise of channels is correlated.
    prior : Prior
        What is known of every touch beforehand.

    Raises
    ------
    ValueError
        If strain, sigma or covariance do not fit the gauges, nothing is measured, or a count is
        negative.
    """
    measured = read_array(
        "strain", strain, "exx, eyy, exy of each gauge", (len(influence.gauges), 3)
    )
    forward = gauge_forward(influence, sigma, ~np.isfinite(measured), covariance)
    return find(
        forward.whiten(measured),
        prepare_candidates(forward),
        count=count,
        max_touches=max_touches,
        prior=prior,
    )
