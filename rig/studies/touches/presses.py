"""What 20 known presses correct on a bench that is not as its model has it.

Parts: gauges, pattern, right. Gauges: gains off by 2 %, places by 0.5 mm, the plate 10 % softer.
Whole pattern, in the twin: a lens 2 % longer, the plate 0.5 mm beside its place, 10 % softer; and
nothing wrong at all. It is corrected by a map of what is found (`touchplate collect`) or by a
corrected forward model (`touchplate train --from`). Each figure is the RMS over fresh touches,
beside that of a model which is right.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

import fe
import models
import rig
import synthetic
from dic import lay_tiles
from models import correct_by_presses
from models.data import gauge_layout
from rig.calibration.presses import fit_presses
from rig.calibration.requested_presses import requested_presses
from rig.live.alignment import Alignment, align
from rig.live.baseline import ReferenceFrame, average_reference
from rig.live.chain import Chain, at_rest, prepare_chain
from rig.live.frame_estimate import estimate_frame
from rig.plates.cached import plate_modes
from rig.report.figure import Figure, at_most
from rig.sources.twin import build_twin
from rig.studies.study import Cell, line, part, run
from rig.system.arrays import F64, AnyArray
from rig.system.timing import Stopwatch

SOFTER, GAIN, PLACE = 1.1, 0.02, 0.5  # stiffness, gain as a fraction, place in mm
PRESSES, FRAMES, REFERENCE = 20, 8, 16
DRAWS, FRESH = 4, 120
WITHIN = at_most(1.2)  # of the error of a model that is right
SIGMA = 0.5e-6  # strain of a gauge; a press of 2 N gives 20 µε on the plate below
PLATE = fe.Plate((120.0, 90.0), 1.0, 3000.0, 0.3, fe.Clamped())
SMALL: dict[str, Any] = {
    "plate.size": [254, 203], "camera.pixels": [512, 416], "pattern.diameter": 2.6,
    "dic.tile": 8, "estimator.modes": 100,
}  # fmt: skip


def error(found: F64, true: F64) -> F64:
    """RMS distance, mm, and RMS error of the force as a fraction."""
    away = np.square(found[:, :2] - true[:, :2]).sum(axis=1).mean()
    return np.sqrt([away, np.square(found[:, 2] / true[:, 2] - 1).mean()])


def gauges(rng: np.random.Generator) -> Iterator[F64]:
    """Errors of the model as it is, corrected, and right, of gauges 15 mm from the edges."""
    mesh, places = fe.grid(PLATE, 40), gauge_layout.gauges_inside_edges(PLATE.size, 15.0, 15.0)
    assumed = fe.influence(PLATE, places, mesh)
    moved = fe.influence(PLATE, places + rng.normal(0, PLACE, places.shape), mesh)
    factor = SOFTER * (1 + rng.normal(0, GAIN, len(places)))
    real = fe.Influence(
        fe.Adjoint(PLATE, mesh, moved.adjoint.values * np.repeat(factor, 3)), places
    )

    def read(touches: F64) -> F64:
        unit = real.strain(touches[:, :2]) * touches[:, 2, None, None]
        return unit + rng.normal(0, SIGMA, unit.shape)

    known, fresh = (
        rng.uniform((30, 30, 1.5), (90, 60, 3.0), (number, 3)) for number in (PRESSES, FRESH)
    )
    presses = tuple(fe.Touch(*touch) for touch in known.tolist())
    fitted = fit_presses(presses, read(known), assumed, SIGMA).influence
    strain = read(fresh)
    for influence in (assumed, fitted, real):
        each = [models.solve(one, influence, sigma=SIGMA, count=1) for one in strain]
        yield error(np.array([(*one.xy[0], one.force[0]) for one in each]), fresh)


@dataclass(frozen=True, eq=False)
class Watched:
    """A plate under a camera that takes images of it."""

    solver: fe.Linear
    warper: synthetic.Warper
    sensor: synthetic.Sensor
    rng: np.random.Generator

    def image(self, touch: F64 | None = None) -> AnyArray:
        """Take an image, at rest or under a touch."""
        moved = np.zeros((len(self.warper.points), 3))
        if touch is not None:
            state, face = self.solver.deflect([fe.Touch(*touch)]), self.warper.camera.face
            moved = state.displacement(self.warper.points, face)
        return self.warper.render(moved, self.sensor, self.rng)


def chain(
    plate: fe.Plate, camera: synthetic.Camera, zero: ReferenceFrame, tile: int, modes: int
) -> Chain:
    """Prepare what the live loop makes of a reference, if plate and camera are as given."""
    tiles = lay_tiles((camera.size[1], camera.size[0]), tile)
    shapes = plate_modes(plate, modes, lambda done, total: None)
    motions = models.prepare_motions(shapes, camera, camera.face_height(plate.thickness), tiles)
    return prepare_chain(zero, motions, 1)


def pattern(rng: np.random.Generator, off: float = 1.0) -> Iterator[F64]:
    """Errors of the model as it is, mapped, corrected, and right, of the whole pattern.

    The bench is wrong by a part `off` of what is stated above.
    """
    scene = rig.load("twin", SMALL)
    twin, tile = build_twin(scene), part(scene.dic).tile
    plate, view, modes = twin.solver.plate, twin.warper.camera, SMALL["estimator.modes"]
    if not isinstance(view, synthetic.Camera):
        raise TypeError("the twin must have a pinhole camera")
    pose = view.T_cam_plate.copy()
    pose[:2, 3] += off * PLACE / np.sqrt(2)
    seen = replace(view, T_cam_plate=pose, focal=(1 + off * GAIN) * view.focal)
    soft = replace(plate, young=plate.young / (1 + off * (SOFTER - 1)))
    speckle = part(scene.pattern).build(part(scene.plate))
    warper = synthetic.prepare_warp(speckle, seen, seen.face_height(plate.thickness))
    bench = Watched(fe.Linear(soft, fe.grid(soft, 64)), warper, twin.sensor, rng)
    zero = average_reference([bench.image() for _ in range(REFERENCE)])
    parts = zero, tile, modes
    assumed, right = chain(plate, view, *parts), chain(soft, seen, *parts)
    known = np.array(
        [(t.x, t.y, t.force) for t in requested_presses(plate.size, (2.0, 4.0), 0)][:PRESSES]
    )
    images = [[bench.image(touch) for _ in range(FRAMES)] for touch in known]
    fresh = np.array([(t.x, t.y, t.force) for t in requested_presses(plate.size, (2.0, 4.0), 1)])
    fresh = np.tile(fresh, (-(-FRESH // len(fresh)), 1))[:FRESH]
    shown = [bench.image(touch) for touch in fresh]
    raw = np.array([sense(assumed, image)[0] for image in shown])
    yield error(raw, fresh)
    yield error(mapped(assumed, images, known).correct(raw), fresh)
    one = zero.noise / np.sqrt(1 + 1 / REFERENCE)  # of a frame
    corrected = correct_by_presses(
        view,
        lambda camera: seen_by(assumed, camera),
        assumed.reference,
        [np.mean(frames, axis=0) for frames in images],
        known,
        (float(one / np.sqrt(FRAMES)), float(one / np.sqrt(REFERENCE))),
    )
    better = chain(plate, corrected.camera, *parts)
    found = np.array([sense(better, image)[0] for image in shown])
    yield error(found / (1.0, 1.0, corrected.softness), fresh)
    yield error(np.array([sense(right, image)[0] for image in shown]), fresh)


def mapped(assumed: Chain, images: list[list[AnyArray]], known: F64) -> Alignment:
    """Fit the map from what is found in the images of presses to where they are."""
    each = [[sense(assumed, image) for image in frames] for frames in images]
    found = np.array([[place for place, _ in frames] for frames in each]).mean(axis=1)
    sigma = np.array([frames[-1][1] for frames in each])
    return align(tuple(fe.Touch(*touch) for touch in known.tolist()), found, sigma)


def seen_by(assumed: Chain, camera: synthetic.Camera) -> models.ImageMotions:
    """See the motions of a chain by another camera."""
    motions = assumed.pattern.motions
    height = camera.face_height(motions.modes.plate.thickness)
    return models.prepare_motions(motions.modes, camera, height, motions.tiles)


def sense(chain: Chain, image: AnyArray) -> tuple[F64, F64]:
    """x, y, F of the one touch in an image, and their standard deviations."""
    estimate = estimate_frame(chain, image, at_rest(chain), Stopwatch(lambda: 0.0)).estimate
    if estimate.count != 1:
        raise SystemExit(f"{estimate.count} touches found in an image of one")
    return (
        np.array([*estimate.xy[0], estimate.force[0]]),
        np.sqrt(np.diag(estimate.covariance)),
    )


Way = Callable[[np.random.Generator], Iterator[F64]]
"""Draws a bench; gives errors of the model as it is, of each correction, and of the right model."""


def compared(name: str, way: Way, corrections: tuple[str, ...]) -> Iterator[Figure]:
    """Give a line to the place and one to the force of a way of measuring."""
    errors = np.array([list(way(np.random.default_rng(seed))) for seed in range(DRAWS)])
    before, *after, right = np.sqrt(np.square(errors).mean(axis=0))
    for index, (what, unit, scale) in enumerate((("place", "mm", 1.0), ("force", "%", 100.0))):
        cells: dict[str, Cell] = {
            "as_it_is": (scale * before[index], unit),
            "right_model": (scale * right[index], unit),
        }
        for how, one in zip(corrections, after, strict=True):
            cells[how] = scale * one[index], unit
            cells[f"{how}_over_right"] = one[index] / right[index], "", WITHIN
        yield from line(
            f"{PRESSES} known presses on a bench that is not as its model",
            f"{name}: {what}",
            **cells,
        )


BY_IMAGES = ("mapped", "corrected")
PARTS = {
    "gauges": partial(compared, "gauges", gauges, ("fitted",)),
    "pattern": partial(compared, "whole pattern", pattern, BY_IMAGES),
    "right": partial(
        compared, "whole pattern, nothing wrong", partial(pattern, off=0.0), BY_IMAGES
    ),
}

if __name__ == "__main__":
    run(PARTS, __doc__)
