"""Touches on the paper's bases, read from images, against the bound of their pixels.

Plate and bases are those of the scene paper-deformable-best, loads those of figure 5D. Truth is
the whole shell under the touch on 28 × 28 elements, in any of its stable shapes, photographed
exactly at 640² with a noise of 2 grey levels. The estimator has 20 × 20 for touches and 36 × 36 for
the shape: it finds the shape in one frame of the untouched plate, as the live loop does, and reads
each pressed frame by itself. The bound is that of the pixels of a frame, by differences of the
shell, with bend, twist, camera and light unknown.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

import fe
import models
import synthetic
from rig.report.figure import Figure, at_most
from rig.scene import load
from rig.studies.deformable.seen import FINER, NOISE, SIDE
from rig.studies.deformable.truth import Scene, Truth
from rig.studies.study import Cell, line, part, run
from rig.system.arrays import F64, AnyArray
from rig.training.bases import RATIOS
from rig.training.plan import TrainingPlan, training_plan

TABLE = "A touch on such a base, from the image"
CASE = "deformable, solver on images"
SCENES, FRAMES, SEED = 5, 8, 43
UNIT = 1.0  # N, the paper's Δ0
BENDS, TWISTS = (1.0, 2.5, 4.0), (0.0, 2.0)
"""Of the shapes that the search begins from, mm and degrees."""


def bound() -> Iterator[Figure]:
    """Read touches of each load from several frames each; compare with what the pixels allow."""
    plan, rng = training_plan(load("paper-deformable-best")), np.random.default_rng(SEED)
    truth = _truth(plan)
    shell, finer = (fe.Shell(truth.plate, _mesh(truth.plate, side)) for side in (SIDE, FINER))
    known = models.with_images(models.known_shapes(shell, BENDS, TWISTS))
    watched = models.Watched(truth.camera, truth.reference(rng), finer)
    ratios = np.resize(RATIOS, SCENES)
    off, limits = np.empty((SCENES, FRAMES, 3)), np.empty(SCENES)
    for number, ratio in enumerate(ratios):
        scene = _drawn(plan, truth, ratio * UNIT, rng)
        rest = truth.photograph(truth.light(scene.untouched), rng)
        fit = models.identify_shape(watched, rest, known)
        shape = models.prepare_shape(watched, fit.state, NOISE)
        light = truth.light(scene.state)
        limits[number] = np.trace(truth.bound(scene, light, NOISE)[:2, :2])
        for row in off[number]:
            row[:] = _off(shape, fit, truth.photograph(light, rng), scene.touch)
    yield from score(off, ratios, limits)


def score(off: F64, ratios: F64, limits: F64) -> Iterator[Figure]:
    """Give figures of errors (scenes, frames, 3) at loads (scenes,) with bounds (scenes,) mm²."""
    square = np.sum(off[:, :, :2] ** 2, axis=2)
    found = np.isfinite(square)
    count, scaled = int(found.sum()), square / limits[:, None]
    force = 100 * np.abs(off[:, :, 2]) / (ratios * UNIT)[:, None]
    cells: dict[str, Cell] = {
        "÷ CRB": (_root(scaled[found]), "", at_most(1.1), count),
        "place, root mean square": (_root(square[found]), "mm", None, count),
        "bound": (_root(limits), "mm", None, len(limits)),
        "largest place": (float(np.sqrt(square[found].max())), "mm", None, count),
        "force": (float(np.median(force[found])), "%, median", None, count),
        "not found": (int((~found).sum()), "", None, found.size),
    }
    yield from line(TABLE, CASE, **cells)
    for ratio in RATIOS:
        chosen = found & (ratios == ratio)[:, None]
        here = _root(scaled[chosen]), "", None, int(chosen.sum())
        yield from line(TABLE, f"{CASE}, {ratio:g} Δ0", **{"÷ CRB": here})


def _root(squares: F64) -> float:
    return float(np.sqrt(np.mean(squares))) if len(squares) else np.nan


def _mesh(plate: fe.Plate, side: int) -> fe.Mesh:
    return fe.Mesh(plate.size, (side, side))


def _truth(plan: TrainingPlan) -> Truth:
    plate = plan.plate.build()
    camera = synthetic.pinhole_above(plate.size, 500.0, (640, 640))
    pattern = synthetic.speckle(plate.size, diameter=0.8, softness=0.75, seed=3)
    return Truth(plate, camera, pattern, synthetic.Sensor(noise=NOISE))


def _drawn(plan: TrainingPlan, truth: Truth, force: float, rng: np.random.Generator) -> Scene:
    """Draw a base of the paper's, in one of its shapes, and a touch on it."""
    bases, margin = part(plan.training.bases), plan.training.margin
    base = fe.Base(float(rng.uniform(*bases.bend)), float(rng.uniform(*bases.twist)))
    x, y = (float(rng.uniform(margin, side - margin)) for side in truth.plate.size)
    return Scene(truth.shape(base, rng), fe.Touch(x, y, force))


def _off(
    shape: models.PreparedShape, fit: models.ShapeFit, frame: AnyArray, touch: fe.Touch
) -> F64:
    """Errors of x, y in mm and of the force in N, (3,); NaN where no touch was found."""
    estimate = shape.read(frame, shape.still(fit.camera), np.empty((0, 3))).estimate
    if estimate.result is not models.Result.FOUND or estimate.count != 1:
        return np.full(3, np.nan)
    return np.array([*estimate.xy[0] - (touch.x, touch.y), estimate.force[0] - touch.force])


if __name__ == "__main__":
    run({"bound": bound}, __doc__)
