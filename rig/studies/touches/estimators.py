"""Every estimator on one touch and 72 gauges: training time, time a frame, error, error over bound.

Parts: regressions, nets, solver, robust. The paper's 289 training touches; the test is 1000 random
ones with a noise of 1 % of the strain of 1 N. The bound is Cramér and Rao's of the place with the
force unknown; estimators that are trained on one force know it, and can come below.
"""

import time
from collections.abc import Callable, Iterator
from functools import cache
from typing import NamedTuple

import numpy as np

import models
from models import Estimate, Net, NetOptions, Recipe, predict, train_net
from models.nets import batches, regression
from models.nets.recipe import BEST, BEST_NET
from models.nets.refine import refine
from rig.report.figure import Bar, Figure, at_most
from rig.studies.paper.sets import pressed, sets, several
from rig.studies.study import cpu_seconds, line, rms, run
from rig.system.arrays import F64

TABLE = "One touch, 72 gauges, noise 1 %"
NOISE = 0.01  # of the root mean square strain of 1 N
TEST, TIMED = 1000, 300
STREAMED = 4000  # epochs of the net trained with noise; the paper's table has a longer one
Estimator = Callable[[F64], F64]
"""From strains (n, 216) to places (n, 2)."""


class Case(NamedTuple):
    """Test strains with noise and without, their touches, σ, and the bound of each place, mm."""

    noisy: F64
    exact: F64
    places: F64
    sigma: float
    bound: float


@cache
def case() -> Case:
    """Draw the test."""
    data, answer, rng = sets(), pressed("paper-one")[1], np.random.default_rng(7)
    places, exact = data.test.targets[:TEST], data.test.strain[:TEST].astype(np.float64)
    sigma = NOISE * float(np.sqrt(np.mean(data.training.strain**2)))
    forward = models.gauge_forward(answer, sigma)
    variances: list[float] = []
    for place in places:
        jacobian = forward.read(np.array([[*place, 1.0]]))[1]
        variances.append(float(np.trace(np.linalg.inv(jacobian @ jacobian.T)[:2, :2])))
    noisy = exact + sigma * rng.normal(size=exact.shape)
    return Case(noisy, exact, places, sigma, float(np.sqrt(np.mean(variances))))


def regressions() -> Iterator[Figure]:
    """Fit regressions to the 289 touches."""
    data = sets()
    for fit in (
        regression.linear,
        regression.quadratic,
        regression.ridge,
        regression.gaussian_process,
        regression.nearest,
    ):
        began = time.process_time()
        estimator = fit(data.training)
        name, spent = fit.__name__.replace("_", " "), time.process_time() - began
        yield from scored(name, estimator, spent)


def nets() -> Iterator[Figure]:
    """Train nets: the paper's recipe, the best one, one with noise; and two steps after each."""
    data, answer = sets(), pressed("paper-one")[1]
    pool, first, test = several(1)
    unit = float(np.sqrt(np.mean(first.strain**2)))
    gain = batches.gain(answer.gradient(pool.targets)).astype(np.float32)
    rng = np.random.default_rng(0)
    levels = (0.01 * unit, 0.2 * unit)
    noisy = batches.estimated(pool, gain, levels, 512, rng)
    for name, make in (
        (
            "net, the paper's recipe",
            lambda: train_net(data.training, data.validation, NetOptions(), Recipe(), rng),
        ),
        (
            "net, best recipe",
            lambda: train_net(data.training, data.validation, BEST_NET, BEST, rng),
        ),
        (
            "net trained with noise",
            lambda: train_net(
                first,
                test,
                NetOptions((128,) * 3, "silu"),
                Recipe(STREAMED, 2e-3, "cosine", "scaled", check=STREAMED),
                rng,
                batches=noisy,
            ),
        ),
    ):
        began = time.process_time()
        net = make().net
        spent = time.process_time() - began
        yield from scored(name, lambda strain, net=net: predict(net, strain), spent)
        yield from scored(f"{name}, and 2 solver steps", stepped(net), spent)


def stepped(net: Net) -> Estimator:
    """Take two steps of the solver after a net."""
    forward = models.gauge_forward(pressed("paper-one")[1], case().sigma)

    def estimate(strain: F64) -> F64:
        starts = predict(net, strain)
        white = strain / case().sigma
        return np.array(
            [
                refine(measured, forward, np.array([[*start, 1.0]]))[0, :2]
                for measured, start in zip(white, starts, strict=True)
            ]
        )

    return estimate


def solver() -> Iterator[Figure]:
    """Solve on the influence: from nothing, and from the last frame."""
    grid, spent = candidates()
    starts = np.column_stack([case().places + 0.3, np.ones(TEST)])
    cold = each(lambda m, n: models.find(m, grid, count=1))
    yield from scored("solver (default)", cold, spent, at_most(1.05))
    tracked = each(lambda m, n: models.find(m, grid, count=1, start=starts[n : n + 1]))
    yield from scored("solver, from the last frame", tracked, spent)


def robust() -> Iterator[Figure]:
    """Solve on the influence as if some channels were false."""
    grid, spent = candidates()
    estimator = each(lambda m, n: models.find_robust(m, grid, count=1))
    yield from scored("solver, robust", estimator, spent)


def candidates() -> tuple[models.CandidateGrid, float]:
    """Prepare the solver; and the CPU time that it took, s."""
    began = time.process_time()
    forward = models.gauge_forward(pressed("paper-one")[1], case().sigma)
    return models.prepare_candidates(forward), time.process_time() - began


def each(solve: Callable[[F64, int], Estimate]) -> Estimator:
    """Solve frame by frame; `solve` takes a whitened frame and its number."""
    return lambda strain: np.array(
        [solve(white, n).xy[0] for n, white in enumerate(strain / case().sigma)]
    )


def scored(
    name: str, estimator: Estimator, spent: float, bar: Bar | None = None
) -> Iterator[Figure]:
    """Score an estimator, and time it frame by frame."""
    known = case()
    off, clean = (
        np.linalg.norm(estimator(strain) - known.places, axis=1)
        for strain in (known.noisy, known.exact)
    )
    estimator(known.noisy[:1])
    rows = iter(known.noisy[:TIMED])
    taken = cpu_seconds(lambda: estimator(next(rows)[None]), TIMED)
    error = rms(off)
    return line(
        TABLE,
        name,
        time=(1e3 * taken, "ms"),
        error=(error, "mm, rms"),
        **{"÷_CRB": (error / known.bound, "", bar)},
        without_noise=(float(clean.mean()), "mm, mean"),
        training=(spent, "CPU s"),
    )


PARTS = {"regressions": regressions, "nets": nets, "solver": solver, "robust": robust}

if __name__ == "__main__":
    run(PARTS, __doc__)
