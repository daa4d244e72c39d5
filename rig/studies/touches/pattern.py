"""What the solver reaches on rendered images, the whole pattern seen at once.

Parts: small (touches of linear theory, against the bound) and time. Times are of the processor, on
one core.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial

import numpy as np

import fe
import models
import synthetic
from dic import TileReference, prepare_tiles, tile_sums
from models import CandidateGrid, Estimate, TilePattern, match
from rig.report.figure import Figure, at_most
from rig.studies.study import line, run, timed, times
from rig.studies.touches.strain import Touches, over_bounds
from rig.system.arrays import F64, AnyArray, Mask

SENSOR = synthetic.Sensor(noise=2.0)
NOISE = float(np.sqrt(SENSOR.noise**2 + 1 / 12))  # with the rounding to whole grey levels
FRAMES = 16  # averaged into the reference
AGAINST = NOISE * float(np.sqrt(1 + 1 / FRAMES))  # of a frame less the reference
TILE = 16  # px
INSET = 30.0  # mm from an edge
MODES = 200
RATE = 30.0  # frames a second
SMALL = 50  # frames
EDGES = {
    "four": fe.Clamped(),
    "two": fe.Edges(fe.Clamped(), fe.Clamped(), fe.Free(), fe.Free()),
}


@dataclass(frozen=True, eq=False)
class Bench:
    """A plate under a camera, and the pattern at rest."""

    plate: fe.Plate
    camera: synthetic.Camera
    warper: synthetic.Warper
    reference: TileReference

    def light(self, moved: F64, shift: tuple[float, float] = (0.0, 0.0)) -> F64:
        """Image without noise, 0 to 1."""
        return self.warper.render(moved, None, None, shift=shift) / 255.0


def stand(
    thickness: float, pixels: int, edges: fe.Edge | fe.Edges = EDGES["four"], spacing: int = 8
) -> Bench:
    """Set up a bench of PVC, 254 mm a side, seen from 500 mm; motion given every `spacing` px."""
    plate = fe.Plate((254.0, 254.0), thickness, 3000.0, 0.38, edges)
    camera = synthetic.pinhole_above(plate.size, 500.0, (pixels, pixels))
    speckle = synthetic.speckle(plate.size, diameter=1.3 * 1024 / pixels, softness=0.6)
    height = camera.face_height(thickness)
    warper = synthetic.prepare_warp(speckle, camera, height, spacing=spacing)
    light = warper.render(np.zeros((len(warper.points), 3)), None, None) / 255.0
    rng = np.random.default_rng(0)
    taken = np.array([SENSOR.capture(light, rng) for _ in range(FRAMES)], dtype=np.float64)
    own = NOISE / float(np.sqrt(FRAMES))
    return Bench(plate, camera, warper, prepare_tiles(taken.mean(axis=0), TILE, noise=own))


NO_TOUCHES = np.empty((0, 3))


def sense(
    pattern: TilePattern,
    search: CandidateGrid,
    image: AnyArray,
    start: Touches = NO_TOUCHES,
    passes: int = 3,
    masked: bool = True,
) -> Estimate:
    """Touches in an image, moved and masked anew in each pass."""
    motion, estimate = pattern.still(), None
    if len(start):
        motion[: pattern.count] = pattern.motions.modal_amplitudes(start[:, :2], start[:, 2])
    for _ in range(passes):
        sums = tile_sums(pattern.reference, image, *pattern.motions.flow_and_gradient(motion))
        if masked:
            visible = pattern.hiding(models.hidden_tiles(pattern.reference, sums, AGAINST))
            if visible is not pattern:
                pattern, search = visible, models.with_forward(search, visible.forward(AGAINST))
        right = pattern.gradient(sums, motion)
        estimate = models.find(pattern.whiten(right, AGAINST), search, start=start, max_touches=3)
        start = np.column_stack([estimate.xy, estimate.force])
        motion = pattern.amplitudes(estimate, right)
    if estimate is None:
        raise ValueError(f"there must be a pass, got {passes}")
    return estimate


def small() -> Iterator[Figure]:
    """One touch of 2 to 4 N on a plate of 2 mm, whose truth is linear theory."""
    bench = stand(2.0, 1024)
    modes = fe.modes(bench.plate, MODES)
    height = bench.camera.face_height(bench.plate.thickness)
    motions = models.prepare_motions(modes, bench.camera, height, bench.reference.tiles)
    pattern = models.prepare_pattern(motions, bench.reference)
    search = models.prepare_candidates(pattern.forward(AGAINST))
    span = (SENSOR.white - SENSOR.black) * SENSOR.top
    still = span * bench.light(np.zeros((len(bench.warper.points), 3)))
    fine = models.pixel_level(modes, bench.camera, height, still)
    linear = fe.Linear(bench.plate, fe.grid(bench.plate, 64))
    # A palm from a corner, over a tenth of the image.
    palm = synthetic.Occluder(np.array([(540.0, -50.0), (1080.0, -50.0), (1080.0, 540.0)]), 0.5)
    cases = {
        "still": (None, (0.0, 0.0), 1.15),
        "camera shifted by 0.3 px": (None, (0.3, 0.0), 1.15),
        f"hand over {palm.coverage((1024, 1024)).mean():.0%}": (palm, (0.0, 0.0), 1.3),
    }
    for name, (hand, shift, limit) in cases.items():
        seen = fine if hand is None else fine.hiding(_covers(hand, fine))
        rng = np.random.default_rng(1)
        places: list[F64] = []
        limits: list[F64] = []
        force: list[float] = []
        while len(places) < SMALL:
            x, y = rng.uniform(INSET, 254.0 - INSET, 2)
            touch = fe.Touch(x, y, rng.uniform(2.0, 4.0))
            moved = linear.deflect([touch]).displacement(bench.warper.points, bench.camera.face)
            light = bench.light(moved, shift)
            image = SENSOR.capture(light if hand is None else hand.cover(light), rng)
            estimate = sense(pattern, search, image)
            if estimate.count != 1:
                raise SystemExit(f"{touch}: {estimate.count} touches found")
            place, error, true = match(estimate, (touch,))
            bound = models.cramer_rao(seen, np.array([[x, y, touch.force]]), NOISE)
            places.append(place[:1])
            limits.append(np.sqrt([(bound[0, 0] + bound[1, 1]) * (1 + 1 / FRAMES)]))
            force.append(abs(error[0] / true[0]))
        yield from line(
            "Whole pattern: against the bound of the pixels in view",
            name,
            **over_bounds(places, limits, at_most(limit)),
            force=(100 * float(np.median(force)), "%, median"),
        )


def _covers(hand: synthetic.Occluder, fine: TilePattern) -> Mask:
    """Tiles of a pattern that a hand reaches into, (T,) bool."""
    return fine.motions.tiles.sums(hand.coverage((1024, 1024))) > 0.01


def time() -> Iterator[Figure]:
    """Follow one touch; hidden tiles are looked for in each frame."""
    table = "Whole pattern: time of a frame"
    for pixels, plain, warped in ((1024, 6.0, 20.0), (2048, 14.0, 70.0)):
        bench = stand(2.0, pixels)
        motions = models.prepare_motions(
            fe.modes(bench.plate, MODES), bench.camera, 1.0, bench.reference.tiles
        )
        pattern = models.prepare_pattern(motions, bench.reference)
        search = models.prepare_candidates(pattern.forward(NOISE))
        # What does not move by more than a fraction of a pixel needs no warp.
        for force, name, most in ((0.3, "no warp", plain), (3.0, "one warp", warped)):
            moved = fe.deflect(bench.plate, [fe.Touch(150.0, 100.0, force)])
            light = bench.light(moved.displacement(bench.warper.points, bench.camera.face))
            image = SENSOR.capture(light, np.random.default_rng(1))
            start = np.array([[150.3, 99.7, 0.97 * force]])
            motion = pattern.still()
            if name == "one warp":
                motion[: pattern.count] = motions.modal_amplitudes(start[:, :2], start[:, 2])
            work = partial(_frame, pattern, search, image, motion, start)
            yield from line(table, f"{pixels}², {name}", **times(_taken(work), at_most(most)))
        # A frame at 30 a second is lost when the mask takes longer than its period.
        taken = _taken(partial(_masked, pattern, search))
        case = f"{pixels}², a changed mask, 10 % hidden"
        yield from line(table, case, **times(taken, at_most(1000.0 / RATE)))


def _frame(
    pattern: TilePattern, search: CandidateGrid, image: AnyArray, motion: F64, start: Touches
) -> Estimate:
    moved = pattern.motions.flow_and_gradient(motion) if motion.any() else ()
    sums = tile_sums(pattern.reference, image, *moved)
    models.hidden_tiles(pattern.reference, sums, NOISE)
    white = pattern.whiten(pattern.gradient(sums, motion), NOISE)
    return models.find(white, search, start=start)


def _masked(pattern: TilePattern, search: CandidateGrid) -> CandidateGrid:
    hidden = np.arange(len(pattern.hidden)) < len(pattern.hidden) // 10
    return models.with_forward(search, pattern.hiding(hidden).forward(NOISE))


def _taken(work: Callable[[], object], repeats: int = 30) -> list[float]:
    """Time of each of some runs after a first, ms."""
    work()
    return [timed(work)[1] for _ in range(repeats)]


PARTS = {
    "small": small,
    "time": time,
}

if __name__ == "__main__":
    run(PARTS, __doc__)
