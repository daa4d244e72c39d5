"""How well a touch net reads drawn measurements, beside the solver, and how honest its σ are."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from pydantic import ValidationError

from rig.scene import Scene
from rig.scene.refusal import sentence
from rig.system.arrays import F64, I64
from rig.training.touch_nets import MAX_TOUCHES, described_bench

if TYPE_CHECKING:
    from models import Estimate, Estimator, LinearForward, NetTouches, TouchNet, TouchReader

RANKS = 199  # draws of the posterior among which the truth is ranked
BINS = 20  # of the ranks, so that each is of ten


@dataclass(frozen=True, eq=False)
class TouchReading:
    """One measurement: what was there, and what net and solver say.

    Attributes
    ----------
    truth : (n, 3) float64, mm, mm, N
    bound : (n,) float64, mm
        Root of the least variance of each place.
    net : NetTouches
    solver : Estimate
    """

    truth: F64
    bound: F64
    net: NetTouches
    solver: Estimate

    @property
    def known(self) -> bool:
        """Whether the net found as many touches as there are, and says that it knows the frame."""
        return self.net.count == len(self.truth) and not self.net.reason


@dataclass(frozen=True)
class NumberScore:
    """Figures of the measurements of one number of touches; None where none was right.

    Attributes
    ----------
    touches, samples : int
    right, solver_right : float
        Fraction whose number was right; of the net, and known to it.
    unknown : float
        Fraction of which the net says that it does not know it.
    rms, solver_rms : float or None, mm
    over_bound, solver_over_bound : float or None
        Root mean square of the errors, each over its own bound.
    """

    touches: int
    samples: int
    right: float
    solver_right: float
    unknown: float
    rms: float | None
    solver_rms: float | None
    over_bound: float | None
    solver_over_bound: float | None


def bench_of(net: TouchNet, path: Path) -> Scene:
    """Return the scene that a net was trained for.

    Raises
    ------
    ValueError
        The file names none that this release knows.
    """
    try:
        return Scene.model_validate(net.about.get("scene"))
    except ValidationError as error:
        raise ValueError(
            f"net file {path} names a bench that this release does not know"
            f" ({sentence(error, Scene)}); run 'touchplate train touch-net'"
        ) from error


def forward_of(scene: Scene) -> LinearForward:
    """Return the forward model of the bench of a scene, its pattern alike in all tiles."""
    from models import bench_forward

    return bench_forward(described_bench(scene))


def draw_readings(
    net: TouchNet, forward: LinearForward, number: int, samples: int, seed: int
) -> list[TouchReading]:
    """Draw measurements of so many touches and read each by net and solver."""
    from models import Estimator, covariance, prepare_reader

    reader, solver = prepare_reader(net, forward), Estimator(forward, max_touches=MAX_TOUCHES)
    rng, found = np.random.default_rng((seed, number)), list[TouchReading]()
    for _ in range(samples):
        truth = net.touches.draw(rng, number)
        measured = rng.standard_normal(len(reader.response[0]))
        bound = np.empty(0)
        if number:
            predicted, jacobian = forward.read(truth)
            measured += predicted
            bound = place_bound(covariance(jacobian))
        found.append(read(reader, solver, measured, truth, bound))
    return found


def read(
    reader: TouchReader, solver: Estimator, measured: F64, truth: F64, bound: F64
) -> TouchReading:
    """Read one measurement by net and solver."""
    return TouchReading(truth, bound, reader.read(measured), solver.fit_whitened(measured))


def place_bound(covariance: F64) -> F64:
    """Root of the variance of each place, (n,) mm, by a covariance (3n, 3n)."""
    variance = np.diag(covariance).reshape(-1, 3)
    return np.sqrt(variance[:, 0] + variance[:, 1])


def number_score(readings: list[TouchReading]) -> NumberScore:
    """Figures of measurements of the same number of touches."""
    number = len(readings[0].truth)
    right = [each.known for each in readings]
    counted = [each.solver.count == number for each in readings]
    by_net = place_errors([e for e, good in zip(readings, right, strict=True) if good], "net")
    by_solver = place_errors(
        [e for e, good in zip(readings, counted, strict=True) if good], "solver"
    )
    rms, over = _ratio(*by_net)
    solver_rms, solver_over = _ratio(*by_solver)
    return NumberScore(
        touches=number,
        samples=len(readings),
        right=float(np.mean(right)),
        solver_right=float(np.mean(counted)),
        unknown=float(np.mean([bool(each.net.reason) for each in readings])),
        rms=rms,
        solver_rms=solver_rms,
        over_bound=over,
        solver_over_bound=solver_over,
    )


def place_errors(readings: list[TouchReading], who: str) -> tuple[list[F64], list[F64]]:
    """Distances of `net` or `solver`, mm, and their bounds, by the true touches."""
    errors, bounds = list[F64](), list[F64]()
    for each in readings:
        found = each.net.estimate if who == "net" else each.solver
        here, true = pair_places(found.xy, each.truth[:, :2])
        errors.append(np.linalg.norm(found.xy[here] - each.truth[true, :2], axis=1))
        bounds.append(each.bound[true])
    return errors, bounds


def ranks(readings: list[TouchReading], seed: int) -> F64:
    """Rank of the truth among draws of the posterior, of x, y, F of one touch each, (k, 3).

    Of measurements whose number is right; the touch is drawn. After Talts et al. (2018).
    """
    rng, found = np.random.default_rng(seed), list[F64]()
    for each in readings:
        if not len(each.truth) or not each.known:
            continue
        here, true = pair_places(each.net.estimate.xy, each.truth[:, :2])
        chosen = int(rng.integers(len(here)))
        drawn = each.net.touches.draw(rng, RANKS)[:, here[chosen]]
        found.append((drawn < each.truth[true[chosen]]).sum(axis=0).astype(np.float64))
    return np.array(found).reshape(-1, 3)


def number_ranks(readings: list[TouchReading], seed: int) -> F64:
    """Rank of the true number among draws, ties broken at random, (k,)."""
    rng = np.random.default_rng(seed)
    number = np.array([len(each.truth) for each in readings])
    below = np.cumsum([each.net.probability for each in readings], axis=1)
    before = np.concatenate([np.zeros((len(below), 1)), below], axis=1)
    rows = np.arange(len(number))
    place = rng.uniform(before[rows, number], before[rows, number + 1])
    return np.minimum(np.floor(place * (RANKS + 1)), RANKS)


def flat(found: F64) -> float:
    """Probability of ranks (k,) less even than these if the posterior is right: χ² of 20 bins."""
    from scipy.stats import chisquare

    counts = np.bincount((found * BINS / (RANKS + 1)).astype(int), minlength=BINS)
    return float(chisquare(counts).pvalue)


def _ratio(errors: list[F64], bounds: list[F64]) -> tuple[float | None, float | None]:
    if not sum(map(len, errors)):
        return None, None
    off, limits = np.concatenate(errors), np.concatenate(bounds)
    return float(np.sqrt(np.mean(off**2))), float(np.sqrt(np.mean((off / limits) ** 2)))


def pair_places(reported: F64, true: F64) -> tuple[I64, I64]:
    """Pair places (n, 2) and (m, 2) at the least sum of distances: two lists of indices."""
    from scipy.optimize import linear_sum_assignment

    here, there = linear_sum_assignment(np.linalg.norm(reported[:, None] - true, axis=2))
    return np.asarray(here), np.asarray(there)
