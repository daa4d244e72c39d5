"""Rows of the paper's figures: the median of the seeds and their spread, the paper's number beside.

The solver on the same strains stands beside every net, and the bound beside both.
"""

from collections.abc import Iterator, Sequence
from functools import lru_cache

import numpy as np

import fe
import models
from models import Dataset, Estimator, matched_error
from rig.plates.cached import influence
from rig.report.figure import Bar, Figure
from rig.studies.paper.drawn.trainings import KeptTraining
from rig.studies.study import Cell, line
from rig.system.arrays import F64
from rig.training.plan import TrainingPlan

EXACT = 1e-6
"""Noise of strains that are called free of it, over the strain of a unit touch: the solver needs
one, and the bound scales with it."""

Gauges = tuple[tuple[float, float], ...]

SOLVED = 100  # samples of a test that the solver is given


def seeds(
    table: str,
    case: str,
    values: Sequence[float],
    unit: str,
    paper: str | float | None = None,
    bar: Bar | None = None,
    **more: Cell,
) -> Iterator[Figure]:
    """Make the row of one quantity over the seeds."""
    cells: dict[str, Cell] = {"here": (float(np.median(values)), unit, bar, len(values))}
    if len(values) > 1:
        cells |= {"least": (float(min(values)), unit), "largest": (float(max(values)), unit)}
    if paper is not None:
        cells["paper"] = paper if isinstance(paper, str) else (paper, unit)
    yield from line(table, case, **(cells | more))


def beside(training: KeptTraining) -> dict[str, Cell]:
    """Return cells of the solver and of the bound for the test of a flat plate without noise."""
    error, limit = solved(training.plan, training.flat.test)
    return {
        "solver": (error, "mm", None, min(SOLVED, len(training.flat.test))),
        "bound at 1 % noise": (limit, "mm"),
    }


def solved(plan: TrainingPlan, test: Dataset) -> tuple[float, float]:
    """Return the mean error of the solver on a test, and the bound on its root mean square.

    Forces are unknown to both; the bound is that of a noise of 1 % of the strain of a unit touch.
    """
    touches = plan.touches
    unit, estimator = _estimator(plan)
    strain = test.strain[:SOLVED].astype(np.float64)
    forces = _forces(plan, test)[:SOLVED]
    true = test.targets[:SOLVED, : 2 * touches].reshape(-1, touches, 2)
    found: list[F64] = []
    limits: list[float] = []
    for row, force, places in zip(strain, forces, true, strict=True):
        estimate = estimator.fit(row.reshape(-1, 3), count=touches)
        found.append(_filled(estimate.xy, touches))
        jacobian = estimator.forward.read(np.column_stack([places, force]))[1]
        limits.append(_limit(jacobian))
    error = matched_error(true, np.array(found))[0].mean()
    scale = 0.01 / EXACT  # the bound is linear in the noise
    return float(error), float(np.sqrt(np.nanmedian(limits)) * scale) if unit else 0.0


def _limit(jacobian: F64) -> float:
    """Mean least variance of the places, mm²; NaN where the touches cannot be separated."""
    try:
        covariance = np.linalg.inv(jacobian @ jacobian.T)
    except np.linalg.LinAlgError:
        return float("nan")
    variances = np.diag(covariance).reshape(-1, 3)[:, :2].sum(axis=1)
    return float(variances.mean())


def _filled(xy: F64, touches: int) -> F64:
    """Return places (touches, 2); one that was not found stands in the middle of the plate."""
    return np.vstack([xy, np.full((touches, 2), 50.0)])[:touches]


def _forces(plan: TrainingPlan, test: Dataset) -> F64:
    touches = plan.touches
    if plan.samples is None:
        return np.full((len(test), 1), plan.training.force[1])
    if plan.magnitudes:
        return plan.samples.force * test.targets[:, 2 * touches :]
    return np.full((len(test), touches), plan.samples.force)


def _estimator(plan: TrainingPlan) -> tuple[float, Estimator]:
    """Return the strain of a unit touch, and the solver on gauges without noise."""
    force = plan.samples.force if plan.samples else plan.training.force[1]
    spread = plan.training.spacing, plan.training.margin
    gauges = tuple((float(x), float(y)) for x, y in plan.gauges.build(plan.plate))
    return _prepared(plan.plate.build(), gauges, force, spread)


@lru_cache(maxsize=4)
def _prepared(
    plate: fe.Plate, gauges: Gauges, force: float, spread: tuple[float, float]
) -> tuple[float, Estimator]:
    touches = influence(plate, np.array(gauges), lambda done, total: None)
    some = models.grid_places(plate.size, *spread)
    unit = force * float(np.sqrt(np.mean(touches.strain(some) ** 2)))
    return unit, Estimator(models.gauge_forward(touches, EXACT * unit))
