"""The shipped twin as it comes: touches and empty frames, rendered; the loop; rendered shifts.

Parts: touches, empty, lamp (lit after the reference, it saturates a third of the image), loop,
shifts. The bound is Cramér and Rao's of all pixels, with shift, rotation and scale of the camera
and the light unknown.
"""

import json
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace

import numpy as np

import dic
import fe
import models
import rig
import synthetic
from dic import spline_coefficients, spline_gradient
from models import Estimate, TilePattern
from rig.live.baseline import average_reference
from rig.live.bench import Bench, build_bench
from rig.live.chain import at_rest
from rig.live.frame_estimate import estimate_frame
from rig.report.figure import Figure, at_least, at_most
from rig.sources.twin import Twin, build_twin
from rig.studies.start import child
from rig.studies.study import line, part, rms, run
from rig.system.arrays import F64, AnyArray
from rig.system.timing import Stopwatch

INSET = 25.0  # mm from an edge
FORCE = (2.0, 4.0)  # N
REFERENCE = 16  # frames
FRAMES, EMPTY, LOOP = 200, 300, 600
LIT, EDGE = 60, 0.02  # frames; of the width
PLACE, OFF, OVER = at_most(1.0), at_most(3.0), at_most(1.5)  # mm; %; times the bound


def touches() -> Iterator[Figure]:
    """One touch of 2 to 4 N at random places, the camera where it was calibrated and beside it."""
    scene = rig.load("twin")
    bench, twin = build_bench(scene, lambda done, total: None), build_twin(scene)
    for name, shift in (("as calibrated", (0.0, 0.0)), ("camera shifted by 0.3 px", (0.3, 0.0))):
        errors, limits = random_touches(bench, replace(twin, shift=shift), FRAMES)
        place = np.hypot(errors[:, 0], errors[:, 1])
        found, bound = rms(place), float(np.sqrt(np.mean(limits)))
        yield from line(
            f"The shipped chain, {FRAMES} rendered frames of 2 to 4 N",
            name,
            **{"÷_CRB": (found / bound, "", OVER, FRAMES)},
            rms=(found, "mm"),
            bound=(bound, "mm"),
            median=(float(np.median(place)), "mm", PLACE, FRAMES),
            force=(100 * float(np.median(np.abs(errors[:, 2]))), "%, median", OFF, FRAMES),
        )


def empty() -> Iterator[Figure]:
    """Nobody touches: whatever is found is false."""
    scene = rig.load("twin")
    bench, twin = build_bench(scene, lambda done, total: None), build_twin(scene)
    false = sum(estimate.count for estimate in estimates(bench, twin, [()] * EMPTY))
    yield from line(
        "Empty frames of the shipped twin",
        "nobody touches",
        false_touches=(false, "", at_most(0), EMPTY),
    )


def lamp() -> Iterator[Figure]:
    """Touch, and touch not, while a lamp whitens a third of the image."""
    scene = rig.load("twin")
    bench, twin = build_bench(scene, lambda done, total: None), build_twin(scene)
    drawn = drawn_touches(bench, LIT)
    script = [pressed for touch in drawn for pressed in ((touch,), ())]
    found = list(estimates(bench, twin, script, lit))
    false = sum(each.count for each in found[1::2])
    once = [(t, each) for t, each in zip(drawn, found[::2], strict=True) if each.count == 1]
    place = [float(np.hypot(*(each.xy[0] - (t.x, t.y)))) for t, each in once]
    force = [100 * abs(float(each.force[0]) / t.force - 1) for t, each in once]
    yield from line(
        "A lamp saturates a third of the image",
        "one touch of 2 to 4 N, then none",
        found=(100.0 * len(once) / LIT, "%", at_least(95.0), LIT),
        place=(float(np.median(place)) if place else None, "mm, median", PLACE, len(place)),
        force=(float(np.median(force)) if force else None, "%, median", OFF, len(force)),
        false_touches=(false, "", at_most(0), LIT),
    )


def lit(image: AnyArray) -> AnyArray:
    """Add the light of a lamp at the left, with a soft edge a third of the width away."""
    along = np.linspace(0.0, 1.0, image.shape[1])
    light = 128.0 * (1.0 - np.tanh((along - 1 / 3 - 2 * EDGE) / EDGE))
    return np.clip(image + light, 0, 255).astype(np.uint8)


def random_touches(bench: Bench, twin: Twin, count: int) -> tuple[F64, F64]:
    """Errors x mm, y mm, F relative of `count` frames, and the bound on the place, mm²."""
    drawn = drawn_touches(bench, count)
    noise = float(np.sqrt(twin.sensor.noise**2 + 1 / 12))  # with the rounding to whole grey levels
    pattern = every_pixel(bench, twin)
    errors: list[tuple[float, float, float]] = []
    limits: list[float] = []
    found = estimates(bench, twin, [(touch,) for touch in drawn])
    for touch, estimate in zip(drawn, found, strict=True):
        if estimate.count != 1:
            raise SystemExit(f"{touch}: {estimate.count} touches found")
        x, y = estimate.xy[0]
        errors.append((x - touch.x, y - touch.y, estimate.force[0] / touch.force - 1))
        bound = models.cramer_rao(pattern, np.array([[touch.x, touch.y, touch.force]]), noise)
        limits.append(bound[0, 0] + bound[1, 1])
    return np.array(errors), np.array(limits)


def drawn_touches(bench: Bench, count: int) -> list[fe.Touch]:
    """Draw touches all over the plate but for its rim."""
    rng, (a, b) = np.random.default_rng(1), bench.plate.size
    return [
        fe.Touch(rng.uniform(INSET, a - INSET), rng.uniform(INSET, b - INSET), rng.uniform(*FORCE))
        for _ in range(count)
    ]


def every_pixel(bench: Bench, twin: Twin) -> TilePattern:
    """Use every pixel of the image at rest."""
    rest = twin.warper.render(np.zeros((len(twin.warper.points), 3)), None, None)
    span = (twin.sensor.white - twin.sensor.black) * twin.sensor.top / 255.0
    return models.pixel_level(bench.motions.plate_modes, bench.camera, bench.height, span * rest)


def estimates(
    bench: Bench,
    twin: Twin,
    script: Iterable[tuple[fe.Touch, ...]],
    seen: Callable[[AnyArray], AnyArray] = np.asarray,
) -> Iterator[Estimate]:
    """Take the reference, then estimate a frame, as it is seen, for each entry of the script."""
    images = [twin.frame(n, ()) for n in range(REFERENCE)]
    chain, _ = bench.prepare(average_reference(images))
    state, watch = at_rest(chain), Stopwatch(lambda: 0.0)
    for n, pressed in enumerate(script):
        sensed = estimate_frame(chain, seen(twin.frame(1000 + n, pressed)), state, watch)
        state = sensed.state
        yield sensed.estimate


def loop() -> Iterator[Figure]:
    """Run the command with the twin rendering beside it."""
    words = "run", "twin", "--frames", str(LOOP), "--headless", "--json"
    said = json.loads(child.command(*words).said.splitlines()[-1])
    latency = said["latency_ms"]
    yield from line(
        "The shipped loop, the twin rendering beside it on the same machine",
        f"{LOOP} frames",
        rate=(said["fps"], "frames/s", at_least(25.0)),
        capture_to_touches=(latency["median"], "ms, median"),
        late_frame=(latency["p95"], "ms, p95", at_most(15.0), LOOP),
        dropped=(said["dropped"], "frames"),
        **{
            f"place_from_{way}": (said[way]["position_median_mm"], "mm, median")
            for way in ("pattern", "strain")
        },
    )


def shifts() -> Iterator[Figure]:
    """Correlate rendered rigid shifts: bias without noise, scatter with it."""
    size = (127.0, 111.0)
    camera = synthetic.pinhole_above(size, pixels=(512, 448), margin=0.0)
    spots = part(rig.load("twin").pattern)
    pattern = synthetic.speckle(size, diameter=spots.diameter, softness=spots.softness)
    sensor, rng = synthetic.Sensor(noise=2.0), np.random.default_rng(2)

    def image(shift: float) -> F64:
        centre = camera.centre[0] + shift, camera.centre[1] + shift / 2
        return synthetic.render(pattern, replace(camera, centre=centre), None, None, None)

    plain = image(0.0)
    clean = dic.prepare(plain)
    biases: list[float] = []
    scatters: list[float] = []
    for shift in np.arange(11) / 10:
        moved = image(shift)
        biases.append(float(np.nanmean(dic.correlate(clean, moved).u) - shift))
        first, second = (sensor.capture(seen / 255.0, rng) for seen in (plain, moved))
        scatters.append(float(np.nanstd(dic.correlate(dic.prepare(first), second).u)))
    span, noise = (sensor.white - sensor.black) * sensor.top, np.sqrt(sensor.noise**2 + 1 / 12)
    floor, scatter = floor_of(span / 255.0 * plain, float(noise)), float(np.median(scatters))
    yield from line(
        "Rigid shifts of 0 to 1 px, rendered as the twin is",
        "subset 21, order 1",
        largest_bias=(1e3 * float(np.abs(biases).max()), "mpx", at_most(0.5)),
        scatter=(1e3 * scatter, "mpx, σ 2"),
        over_the_floor=(scatter / floor, "", at_most(1.03)),
    )


def floor_of(image: F64, noise: float) -> float:
    """√2 σ / √SSSIG at subset 21, order 1, with the full 6 x 6 Hessian, px."""
    fx, fy = spline_gradient(spline_coefficients(image))
    half, step = 10, 25
    variances: list[float] = []
    eta, xi = np.mgrid[-half : half + 1, -half : half + 1]
    shape = np.stack([np.ones_like(xi), xi, eta]).reshape(3, -1)
    for row in range(40, image.shape[0] - 40, step):
        for column in range(40, image.shape[1] - 40, step):
            window = np.s_[row - half : row + half + 1, column - half : column + half + 1]
            columns = np.concatenate([fx[window].ravel() * shape, fy[window].ravel() * shape])
            variances.append(float(np.linalg.inv(columns @ columns.T)[0, 0]))
    return float(noise * np.sqrt(2 * np.mean(variances)))


PARTS = {"touches": touches, "empty": empty, "lamp": lamp, "loop": loop, "shifts": shifts}

if __name__ == "__main__":
    run(PARTS, __doc__)
