"""Touches on a base that is bent and twisted, from single frames of which nothing is known.

Parts: any (base, shape and touch drawn over the whole range), limit (bases near a limit point,
where a bow buckles or begins to lean). Truth is the whole shell under the touch on 40 × 40
elements, any of its stable shapes, photographed exactly at 640² with a noise of 2 grey levels; the
estimator has 20 × 20 for touches and 36 × 36 for the shape, the flat reference and nothing else.
The bound is that of the pixels, by differences of the shell, with base, camera and light unknown.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np

import fe
import models
import synthetic
from rig.plates import cached
from rig.report.figure import Figure, at_most
from rig.studies.deformable.truth import Scene, Truth
from rig.studies.study import line, run
from rig.system.arrays import F64

TABLE = "Deformable base, from the image"
CASE = "bent and twisted base"
NEAR = "bent and twisted base near a limit point"
SCENES, LIMITS, BOUNDS = 40, 20, 40
BEND, TWIST, FORCE, MARGIN = (0.0, 10.0), (-15.0, 15.0), (0.5, 2.0), 8.0
NOISE, SIDE, FINER, SEED = 2.0, 20, 36, 11
TRUE = 40  # elements a side of the truth: coarser ones are off by more than noise, at rest
# Wrong, and not by noise: mm, fraction of the force, and stated σ.
WRONG, WRONG_FORCE, SURE = 3.0, 0.15, 4.0
# Of the eigenvalue at rest: nearer than this a base counts as near a limit point.
SOFT = 0.15

EDGES = fe.Edges(fe.Clamped(), fe.Clamped(), fe.Free(), fe.Free())
PLATE = fe.Plate((100.0, 100.0), 1.0, 3000.0, 0.3, EDGES)


class Seen(NamedTuple):
    """What the estimator said of a scene.

    Attributes
    ----------
    found : bool
        Whether it says that it found one touch and the base.
    place, force : float, mm and a fraction
        Errors of the touch; NaN where none was found.
    bend, twist : float, fraction and degrees
        Errors of the base; NaN where it was not found.
    sigmas : float
        Largest error of x, y and force over its σ.
    scaled : float
        Square of the distance over that of the bound, NaN where no bound was computed.
    surface : models.Surface
    """

    found: bool
    place: float
    force: float
    bend: float
    twist: float
    sigmas: float
    scaled: float
    surface: models.Surface

    @property
    def silent(self) -> bool:
        """Whether it is wrong by more than noise and says that it is right."""
        off = self.place > WRONG or abs(self.force) > WRONG_FORCE
        return self.found and off and self.sigmas > SURE


@dataclass(frozen=True, eq=False)
class Setup:
    """Truth and estimator."""

    truth: Truth
    watched: models.Watched
    known: tuple[fe.ShellState, ...]


def setup(rng: np.random.Generator) -> Setup:
    """Prepare truth and estimator."""
    camera = synthetic.pinhole_above(PLATE.size, 500.0, (640, 640))
    pattern = synthetic.speckle(PLATE.size, diameter=0.8, softness=0.75, seed=3)
    truth = Truth(PLATE, camera, pattern, synthetic.Sensor(noise=NOISE), TRUE)
    shell = fe.Shell(PLATE, fe.Mesh(PLATE.size, (SIDE, SIDE)))
    known = models.with_images(cached.shapes(shell, lambda done, total: None))
    finer = fe.Shell(PLATE, fe.Mesh(PLATE.size, (FINER, FINER)))
    return Setup(truth, models.Watched(camera, truth.reference(rng), finer), known)


def any_base(rng: np.random.Generator, truth: Truth) -> fe.ShellState:
    """Draw a base over the whole range, in any of its shapes."""
    return truth.shape(fe.Base(rng.uniform(*BEND), rng.uniform(*TWIST)), rng)


def near_limit(rng: np.random.Generator, truth: Truth) -> fe.ShellState:
    """Draw a base at which a bow begins to lean, or at which a flat plate buckles."""
    if rng.random() < 0.5:
        return truth.shape(fe.Base(rng.uniform(0.0, 0.03), rng.uniform(-0.3, 0.3)), rng)
    state = truth.shell.at(fe.Base(rng.uniform(0.5, BEND[1])))
    low, high, found = 0.0, TWIST[1], state
    while high - low > 0.02 and found.stability.eigenvalue > SOFT:
        middle = 0.5 * (low + high)
        ahead = truth.shell.moved(found, fe.Base(state.base.bend, middle))
        if ahead.stability.escapes or not ahead.stability.converged:
            high = middle
        else:
            low, found = middle, ahead
    return found


def touch(rng: np.random.Generator) -> fe.Touch:
    """Draw a touch."""
    x, y = (rng.uniform(MARGIN, side - MARGIN) for side in PLATE.size)
    return fe.Touch(float(x), float(y), float(rng.uniform(*FORCE)))


def look(made: Setup, scene: Scene, rng: np.random.Generator, bound: bool) -> Seen:
    """Estimate a scene from one frame."""
    light = made.truth.light(scene.state)
    frame = made.truth.photograph(light, rng)
    fit = models.identify_shape(made.watched, frame, made.known)
    said = models.estimate_on_shape(made.watched, frame, fit, NOISE)
    estimate, base, true = said.estimate, said.base, scene.untouched.base
    found = said.surface is models.Surface.SEEN and estimate.result is models.Result.FOUND
    bend = (base.bend - true.bend) / max(true.bend, 1e-9)
    if not estimate.count:
        none = np.nan, np.nan
        return Seen(False, *none, bend, base.twist - true.twist, *none, said.surface)
    off = np.array([*estimate.xy[0], estimate.force[0]]) - _numbers(scene.touch)
    sigma = np.sqrt(np.diag(estimate.covariance)[:3])
    scaled = np.nan
    if bound and found:
        bound_of = made.truth.bound(scene, light, NOISE)
        scaled = float(off[:2] @ off[:2] / np.trace(bound_of[:2, :2]))
    return Seen(
        found,
        float(np.hypot(*off[:2])),
        float(off[2] / scene.touch.force),
        float(bend),
        float(base.twist - true.twist),
        float(np.abs(off / sigma).max()),
        scaled,
        said.surface,
    )


def figures(case: str, seen: list[Seen], barred: bool) -> Iterator[Figure]:
    """Give the figures of a case; those of touches are of the ones that it says to have found."""
    found = [each for each in seen if each.found]
    count, bars = len(found), (at_most(1.0), at_most(5.0), at_most(2.0))
    place, force, bend = bars if barred else (None, None, None)

    def middle(values: list[float]) -> float:
        return float(np.median(np.abs(values))) if values else np.nan

    yield from line(
        TABLE,
        case,
        **{
            "place": (middle([s.place for s in found]), "mm, median", place, count),
            "force": (100 * middle([s.force for s in found]), "%", force, count),
            "bend": (100 * middle([s.bend for s in seen]), "%", bend, len(seen)),
            "twist": (middle([s.twist for s in seen]), "degrees", None, len(seen)),
            "largest place": (max((s.place for s in found), default=np.nan), "mm", None, count),
            "found": (100.0 * count / len(seen), "%", None, len(seen)),
            "silently wrong": (float(sum(s.silent for s in seen)), "", at_most(0.0), len(seen)),
        },
    )


def any_part(scenes: int) -> Iterator[Figure]:
    """Score bases over the whole range, and the errors over their bound."""
    rng = np.random.default_rng(SEED)
    made = setup(rng)
    seen = [
        look(made, Scene(any_base(rng, made.truth), touch(rng)), rng, number < BOUNDS)
        for number in range(scenes)
    ]
    yield from figures(CASE, seen, barred=True)
    scaled: F64 = np.array([each.scaled for each in seen if np.isfinite(each.scaled)])
    ratio = float(np.sqrt(scaled.mean())) if len(scaled) else np.nan
    yield from line(TABLE, CASE, **{"÷ CRB": (ratio, "", at_most(1.1), len(scaled))})


def limit_part(scenes: int) -> Iterator[Figure]:
    """Score bases near a limit point."""
    rng = np.random.default_rng(SEED + 1)
    made = setup(rng)
    seen = [
        look(made, Scene(near_limit(rng, made.truth), touch(rng)), rng, False)
        for _ in range(scenes)
    ]
    yield from figures(NEAR, seen, barred=False)


def _numbers(touch: fe.Touch) -> F64:
    return np.array([touch.x, touch.y, touch.force])


PARTS = {"any": partial(any_part, SCENES), "limit": partial(limit_part, LIMITS)}

if __name__ == "__main__":
    run(PARTS, __doc__)
