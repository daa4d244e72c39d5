"""How right the touches of a run are, and how honest their σ."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

import rig
from models import Estimate, Result
from rig.calibration.store import Calibration
from rig.studies.real_bench.session import Touched
from rig.system.arrays import F64


@dataclass(frozen=True)
class Score:
    """Figures of a run.

    Attributes
    ----------
    place : (n,) float64, mm
        Distance of each touch that was found.
    force : (n,) float64
        Error as a fraction.
    within : (n, 3) float64
        Errors of x, y and F over their σ, of those that are said to be known.
    missed, phantoms : int
        Frames in which a touch was not found, those that were given up among them, or one too many
        was.
    false : int
        Touches found on the plate alone.
    alone : int
        Frames of the plate alone.
    seconds : float
        Of one frame, median.
    """

    place: F64
    force: F64
    within: F64
    missed: int
    phantoms: int
    false: int
    alone: int
    seconds: float


def score(scene: rig.Scene, known: Calibration, made: list[Touched]) -> Score:
    """Run a scene over its images and compare what is found with what was made."""
    found, taken = _run(scene, known)
    return compared(found, made, float(np.median(taken)))


def compared(found: dict[int, Estimate], made: Sequence[Touched], seconds: float) -> Score:
    """Compare what is found in frames, by their numbers, with what was made."""
    touches = {one.sequence: one.touch for one in made if one.touch is not None}
    touched = [(found[k], touch) for k, touch in touches.items() if k in found and found[k].count]
    hit = [_nearest(estimate, touch) for estimate, touch in touched]
    sure = [_nearest(*pair)[2] for pair in touched if pair[0].result is Result.FOUND]
    alone = [found[k] for k in found.keys() & {one.sequence for one in made if one.touch is None}]
    return Score(
        place=np.array([place for place, _, _ in hit]),
        force=np.array([force for _, force, _ in hit]),
        within=np.array(sure).reshape(-1, 3),
        missed=len(touches) - len(touched),
        phantoms=sum(estimate.count > 1 for estimate, _ in touched),
        false=sum(estimate.count for estimate in alone),
        alone=len(alone),
        seconds=seconds,
    )


def pooled(scores: Sequence[Score]) -> Score:
    """Put the touches of several runs together."""
    return Score(
        place=np.concatenate([one.place for one in scores]),
        force=np.concatenate([one.force for one in scores]),
        within=np.concatenate([one.within for one in scores]),
        missed=sum(one.missed for one in scores),
        phantoms=sum(one.phantoms for one in scores),
        false=sum(one.false for one in scores),
        alone=sum(one.alone for one in scores),
        seconds=float(np.median([one.seconds for one in scores])),
    )


def _run(scene: rig.Scene, known: Calibration) -> tuple[dict[int, Estimate], list[float]]:
    found: dict[int, Estimate] = {}
    taken: list[float] = []
    began = time.thread_time()
    for frame in rig.run(scene, calibration=known):
        if frame.fresh and frame.estimate is not None:
            found[frame.sequence] = frame.estimate
        taken.append(time.thread_time() - began)
        began = time.thread_time()
    return found, taken[1:]


def _nearest(estimate: Estimate, touch: F64) -> tuple[float, float, F64]:
    """Distance and error of force of the touch that lies nearest, and errors over σ."""
    away = np.hypot(*(estimate.xy - touch[:2]).T)
    best = int(np.argmin(away))
    found = np.array([*estimate.xy[best], estimate.force[best]])
    part = slice(3 * best, 3 * best + 3)
    sigma = np.sqrt(np.diag(estimate.covariance)[part])
    return float(away[best]), float(found[2] / touch[2] - 1.0), (found - touch) / sigma
