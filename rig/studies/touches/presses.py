"""Print what 20 known presses mend on a bench that is not as its model has it.

Usage: ``python benchmarks/presses.py [--quick]``. Gauges: gains off by 2 %, places by 0.5 mm, the
plate 10 % softer. Whole pattern, in the twin: a lens 2 % longer, the plate 0.5 mm beside its place,
10 % softer; and nothing wrong at all. It is mended by a map of what is found (`touchplate collect`)
or by a corrected forward model (`touchplate train --from`). Each figure is the RMS over fresh
touches, beside that of a model which is right.
"""

import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

import fe
import models
import rig
import synthetic
from dic.tiles.tiles import lay_tiles
from models.data import gauge_layout
from models.design.press_calibration import correct
from rig.calibration.presses import fit_presses
from rig.live import chain as live
from rig.live.alignment import Alignment, align
from rig.live.baseline import take_zero
from rig.plates.cached import plate_modes
from rig.sources.script import asked
from rig.system.timing import Stopwatch

SOFTER, GAIN, PLACE = 1.1, 0.02, 0.5  # stiffness, gain as a share, place in mm
PRESSES, FRAMES, REFERENCE = 20, 8, 16
SIGMA = 0.5e-6  # strain of a gauge; a press of 2 N gives 20 µε on the plate below
PLATE = fe.Plate((120.0, 90.0), 1.0, 3000.0, 0.3, fe.Clamped())
SMALL = {
    "plate.size": [254, 203], "camera.pixels": [512, 416], "pattern.diameter": 2.6,
    "dic.tile": 8, "estimator.modes": 100,
}  # fmt: skip


def rms(found: np.ndarray, true: np.ndarray) -> np.ndarray:
    """RMS distance, mm, and RMS error of the force as a share."""
    away = np.square(found[:, :2] - true[:, :2]).sum(axis=1).mean()
    return np.sqrt([away, np.square(found[:, 2] / true[:, 2] - 1).mean()])


def gauges(rng: np.random.Generator, count: int) -> Iterator[np.ndarray]:
    """Errors of the model as it is, mended, and right, of gauges 15 mm from the edges."""
    mesh, places = fe.grid(PLATE, 40), gauge_layout.inside_edges(PLATE.size, 15.0, 15.0)
    assumed = fe.influence(PLATE, places, mesh)
    moved = fe.influence(PLATE, places + rng.normal(0, PLACE, places.shape), mesh)
    factor = SOFTER * (1 + rng.normal(0, GAIN, len(places)))
    real = fe.Influence(
        fe.Adjoint(PLATE, mesh, moved.adjoint.values * np.repeat(factor, 3)), places
    )

    def read(touches):
        unit = real.strain(touches[:, :2]) * touches[:, 2, None, None]
        return unit + rng.normal(0, SIGMA, unit.shape)

    known, fresh = (
        rng.uniform((30, 30, 1.5), (90, 60, 3.0), (number, 3)) for number in (PRESSES, count)
    )
    presses = tuple(fe.Touch(*touch) for touch in known.tolist())
    mended = fit_presses(presses, read(known), assumed, SIGMA).influence
    strain = read(fresh)
    for influence in (assumed, mended, real):
        each = [models.solve(one, influence, sigma=SIGMA, count=1) for one in strain]
        yield rms(np.array([(*one.xy[0], one.force[0]) for one in each]), fresh)


@dataclass(frozen=True, eq=False)
class Eye:
    """A plate under a camera that takes pictures of it."""

    solver: fe.Linear
    warper: synthetic.Warper
    sensor: synthetic.Sensor
    rng: np.random.Generator

    def picture(self, touch: np.ndarray | None = None) -> np.ndarray:
        moved = np.zeros((len(self.warper.points), 3))
        if touch is not None:
            moved = self.solver.deflect([fe.Touch(*touch)]).displacement(self.warper.points, "top")
        return self.warper.render(moved, self.sensor, self.rng)


def chain(plate: fe.Plate, camera: synthetic.Camera, zero, tile: int, modes: int) -> live.Chain:
    """Prepare what the live loop makes of a reference, if plate and camera are as given."""
    tiles = lay_tiles((camera.size[1], camera.size[0]), tile)
    shapes = plate_modes(plate, modes, lambda done, total: None)
    motions = models.see_motions(shapes, camera, plate.thickness / 2, tiles)
    return live.prepare_chain(zero, motions, 1)


def pattern(rng: np.random.Generator, count: int, off: float = 1.0) -> Iterator[np.ndarray]:
    """Errors of the model as it is, mapped, corrected, and right, of the whole pattern.

    The bench is wrong by a part `off` of what is stated above.
    """
    scene = rig.load("twin", SMALL)
    plate, view = scene.plate.build(), scene.camera.build(scene.plate)
    pose = view.T_cam_plate.copy()
    pose[:2, 3] += off * PLACE / np.sqrt(2)
    seen = replace(view, T_cam_plate=pose, focal=(1 + off * GAIN) * view.focal)
    soft = replace(plate, young=plate.young / (1 + off * (SOFTER - 1)))
    warper = synthetic.prepare_warp(scene.pattern.build(scene.plate), seen, plate.thickness / 2)
    eye = Eye(fe.Linear(soft, fe.grid(soft, 64)), warper, scene.sensor.build(), rng)
    zero = take_zero([eye.picture() for _ in range(REFERENCE)])
    parts = zero, scene.dic.tile, scene.estimator.modes
    assumed, right = chain(plate, view, *parts), chain(soft, seen, *parts)
    known = np.array([(t.x, t.y, t.force) for t in asked(plate.size, (2.0, 4.0), 0)][:PRESSES])
    pictures = [[eye.picture(touch) for _ in range(FRAMES)] for touch in known]
    fresh = np.array([(t.x, t.y, t.force) for t in asked(plate.size, (2.0, 4.0), 1)])
    fresh = np.tile(fresh, (-(-count // len(fresh)), 1))[:count]
    shown = [eye.picture(touch) for touch in fresh]
    raw = np.array([sense(assumed, image)[0] for image in shown])
    yield rms(raw, fresh)
    yield rms(mapped(assumed, pictures, known).mend(raw), fresh)
    one = zero.noise / np.sqrt(1 + 1 / REFERENCE)  # of a frame
    corrected = correct(
        view,
        lambda camera: seen_by(assumed, camera),
        assumed.reference,
        [np.mean(frames, axis=0) for frames in pictures],
        known,
        tuple(one / np.sqrt([FRAMES, REFERENCE])),
    )
    better = chain(plate, corrected.camera, *parts)
    found = np.array([sense(better, image)[0] for image in shown])
    yield rms(found / (1.0, 1.0, corrected.softness), fresh)
    yield rms(np.array([sense(right, image)[0] for image in shown]), fresh)


def mapped(assumed: live.Chain, pictures: list[list[np.ndarray]], known: np.ndarray) -> Alignment:
    """Fit the map from what is found in the pictures of presses to where they are."""
    each = [[sense(assumed, image) for image in frames] for frames in pictures]
    found = np.array([[place for place, _ in frames] for frames in each]).mean(axis=1)
    sigma = np.array([frames[-1][1] for frames in each])
    return align(tuple(fe.Touch(*touch) for touch in known.tolist()), found, sigma)


def seen_by(assumed: live.Chain, camera: synthetic.Camera) -> models.Motions:
    """See the motions of a chain by another camera."""
    motions = assumed.pattern.motions
    height = motions.modes.plate.thickness / 2
    return models.see_motions(motions.modes, camera, height, motions.tiles)


def sense(chain: live.Chain, image: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """x, y, F of the one touch in a picture, and their standard deviations."""
    estimate = live.sense(chain, image, live.at_rest(chain), Stopwatch(lambda: 0.0)).estimate
    if estimate.count != 1:
        raise SystemExit(f"{estimate.count} touches found in a picture of one")
    return (
        np.array([*estimate.xy[0], estimate.force[0]]),
        np.sqrt(np.diag(estimate.covariance)),
    )


WAYS: dict[str, tuple[Callable, tuple[str, ...]]] = {
    "gauges": (gauges, ("fitted",)),
    "whole pattern": (pattern, ("mapped", "corrected")),
    "pattern, nothing wrong": (partial(pattern, off=0.0), ("mapped", "corrected")),
}


def rows(draws: int, count: int) -> Iterator[tuple[str, dict[str, str]]]:
    """Give a line a way of measuring: what is measured, and each model's error of it."""
    for name, (way, mends) in WAYS.items():
        errors = np.array([list(way(np.random.default_rng(seed), count)) for seed in range(draws)])
        before, *after, perfect = np.sqrt(np.square(errors).mean(axis=0))
        for index, (what, unit, scale) in enumerate((("place", "mm", 1.0), ("force", "%", 100.0))):
            ends = {"as it is": before[index], "right model": perfect[index]}
            cells = {how: f"{scale * error:.3f} {unit}" for how, error in ends.items()}
            for how, one in zip(mends, after, strict=True):
                ratio = one[index] / perfect[index]
                cells[how] = f"{scale * one[index]:.3f} {unit}, {ratio:.2f} of the right model's"
            yield f"{name}: {what}", cells


def main(*arguments: str) -> None:
    """Print a row a way of measuring."""
    for name, cells in rows(*(1, 60) if "--quick" in arguments else (4, 120)):
        said = ", ".join(f"{how} {error}" for how, error in cells.items())
        print(f"{name:32s} {said}   bar ≤ 1.2", flush=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
