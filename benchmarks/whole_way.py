"""Print what the whole way reaches on rendered pictures, each figure beside its bar.

Usage: ``python benchmarks/whole_way.py [FOLDER]``, or ``make bench DATA=FOLDER``. FOLDER holds
``open_hole`` and ``star5``, pictures of others that are not in this repository; without it those
rows are left out.
"""

import json
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from dic_bars import compare_open_hole, compare_star

import dic
import fe
import models
import rig
import synthetic
from dic.images.spline import spline_coefficients, spline_gradient
from models.estimate import Estimate
from rig.live import chain as live
from rig.live.baseline import average_reference
from rig.live.bench import build_bench
from rig.sources.twin import Twin, build_twin
from rig.system.timing import Stopwatch

INSET = 25.0  # mm from an edge
FORCE = (2.0, 4.0)  # N
REFERENCE = 16  # frames


@dataclass(frozen=True)
class Row:
    """One figure: what, measured, and the bar in words."""

    what: str
    measured: str
    bar: str


def main(folder: str | None = None) -> None:
    """Print every figure that can be had."""
    for row in _rows(folder):
        print(f"{row.what:58s} {row.measured:>34s}   bar {row.bar}", flush=True)


def _rows(folder: str | None) -> Iterator[Row]:
    yield from twin_rows()
    yield from live_rows()
    yield from shift_rows()
    yield from plate_rows()
    yield from paper_rows()
    if folder is not None:
        yield from photograph_rows(Path(folder))


def twin_rows() -> Iterator[Row]:
    """Score one touch of 2 to 4 N at random places, 200 frames, and 300 frames without touch."""
    scene = rig.load("twin")
    bench, twin = build_bench(scene, lambda done, total: None), build_twin(scene)
    picture = twin.warper.render(np.zeros((len(twin.warper.points), 3)), None, None)
    span = (twin.sensor.white - twin.sensor.black) * twin.sensor.top / 255.0
    bound = models.pixel_level(bench.motions.modes, bench.camera, bench.height, span * picture)
    for name, shift in (("", (0.0, 0.0)), (", camera shifted by 0.3 px", (0.3, 0.0))):
        errors, limits = random_touches(bench, replace(twin, shift=shift), bound, 200)
        place = np.hypot(errors[:, 0], errors[:, 1])
        ratio = np.sqrt(np.mean(place**2) / np.mean(limits))
        yield Row(f"twin{name}: position, median", f"{np.median(place):.3f} mm", "≤ 1 mm")
        force = 100 * np.median(np.abs(errors[:, 2]))
        yield Row(f"twin{name}: force, median", f"{force:.2f} %", "≤ 3 %")
        rms = f"{np.sqrt(np.mean(place**2)):.3f} / {np.sqrt(np.mean(limits)):.3f} mm = {ratio:.2f}"
        yield Row(f"twin{name}: RMS / pixel-level Cramér-Rao bound", rms, "≤ 1.5")
    false = sum(estimate.count for estimate in _estimates(bench, twin, [()] * 300))
    yield Row("twin: false touches in 300 unloaded frames", str(false), "0")


def random_touches(bench, twin, bound, count) -> tuple[np.ndarray, np.ndarray]:
    """Errors x mm, y mm, F relative of `count` frames, and the bound on the place, mm²."""
    rng, (a, b) = np.random.default_rng(1), bench.plate.size
    touches = [
        fe.Touch(rng.uniform(INSET, a - INSET), rng.uniform(INSET, b - INSET), rng.uniform(*FORCE))
        for _ in range(count)
    ]
    noise = np.sqrt(twin.sensor.noise**2 + 1 / 12)  # with the rounding to whole grey levels
    errors, limits = [], []
    for touch, estimate in zip(
        touches, _estimates(bench, twin, [(touch,) for touch in touches]), strict=True
    ):
        if estimate.count != 1:
            raise SystemExit(f"{touch}: {estimate.count} touches found")
        x, y = estimate.xy[0]
        errors.append((x - touch.x, y - touch.y, estimate.force[0] / touch.force - 1))
        least = models.cramer_rao(bound, np.array([[touch.x, touch.y, touch.force]]), noise)
        limits.append(least[0, 0] + least[1, 1])
    return np.array(errors), np.array(limits)


def _estimates(bench, twin: Twin, script) -> Iterator[Estimate]:
    """Take the reference, then estimate a frame for each entry of the script."""
    images = [twin.frame(n, ()) for n in range(REFERENCE)]
    chain, _ = bench.prepare(average_reference(images))
    state, watch = live.at_rest(chain), Stopwatch(lambda: 0.0)
    for n, touches in enumerate(script):
        image = twin.frame(1000 + n, touches)
        sensed = live.estimate_frame(chain, image, state, watch)
        estimate, state = sensed.estimate, sensed.state
        yield estimate


def _touchplate(*arguments: str) -> dict:
    """Run a command in a process of its own, as a user does."""
    command = [str(Path(sys.executable).parent / "touchplate"), *arguments, "--json"]
    return json.loads(subprocess.run(command, capture_output=True, text=True, check=True).stdout)


def live_rows() -> Iterator[Row]:
    """Run the loop with the twin rendering beside it."""
    run = _touchplate("run", "twin", "--frames", "600", "--headless")
    yield Row("loop: frames a second, twin beside it", f"{run['fps']:.1f}", "≥ 25")
    latency = run["latency_ms"]
    measured = f"{latency['median']:.1f} ms, p95 {latency['p95']:.1f} ms"
    yield Row("loop: frame to touches", measured, "p95 ≤ 15 ms")
    yield Row("loop: dropped of 600 frames", str(run["dropped"]), "–")
    for way in ("pattern", "strain"):
        scores = run[way]
        measured = f"{scores['position_median_mm']:.2f} mm, {scores['force_median_percent']:.2f} %"
        yield Row(f"loop: tour of 0.5–4 N from {way}, medians", measured, "–")


def shift_rows() -> Iterator[Row]:
    """Correlate rendered rigid shifts: bias without noise, scatter with it."""
    size = (127.0, 111.0)
    camera = synthetic.pinhole_above(size, pixels=(512, 448), margin=0.0)
    spots = rig.load("twin").pattern
    pattern = synthetic.speckle(size, diameter=spots.diameter, softness=spots.softness)
    sensor = synthetic.Sensor(noise=2.0)
    rng = np.random.default_rng(2)

    def picture(shift: float) -> np.ndarray:
        centre = camera.centre[0] + shift, camera.centre[1] + shift / 2
        return synthetic.render(pattern, replace(camera, centre=centre), None, None, None)

    plain = picture(0.0)
    clean, biases, scatters = dic.prepare(plain), [], []
    for shift in np.arange(11) / 10:
        moved = picture(shift)
        biases.append(np.nanmean(dic.correlate(clean, moved).u) - shift)
        first, second = (sensor.capture(image / 255.0, rng) for image in (plain, moved))
        noisy = dic.correlate(dic.prepare(first), second)
        scatters.append(np.nanstd(noisy.u))
    yield Row("rendered shifts: largest bias", f"{1e3 * np.abs(biases).max():.2f} mpx", "≤ 1 mpx")
    span = (sensor.white - sensor.black) * sensor.top
    floor = _floor(span / 255.0 * plain, np.sqrt(sensor.noise**2 + 1 / 12))
    ratio = np.median(scatters) / floor
    measured = f"{1e3 * np.median(scatters):.2f} / {1e3 * floor:.2f} mpx = {ratio:.3f}"
    yield Row("rendered shifts, σ 2: scatter / floor", measured, "≤ 1.05")


def _floor(picture: np.ndarray, noise: float) -> float:
    """√2 σ / √SSSIG at subset 21, order 1, with the full 6 x 6 Hessian, px."""
    fx, fy = spline_gradient(spline_coefficients(picture))
    half, step, variances = 10, 25, []
    eta, xi = np.mgrid[-half : half + 1, -half : half + 1]
    shape = np.stack([np.ones_like(xi), xi, eta]).reshape(3, -1)
    for row in range(40, picture.shape[0] - 40, step):
        for column in range(40, picture.shape[1] - 40, step):
            window = np.s_[row - half : row + half + 1, column - half : column + half + 1]
            columns = np.concatenate([fx[window].ravel() * shape, fy[window].ravel() * shape])
            variances.append(np.linalg.inv(columns @ columns.T)[0, 0])
    return float(noise * np.sqrt(2 * np.mean(variances)))


def plate_rows() -> Iterator[Row]:
    """Compare the clamped square at the default mesh with its double series."""
    side, plate = 100.0, fe.Plate(size=(100.0, 100.0), thickness=1.0, young=3000.0, poisson=0.3)
    unit = plate.rigidity / side**2
    w = -fe.deflect(plate, [fe.Touch(50.0, 50.0, 1.0)]).deflection([[50.0, 50.0]])[0] * unit
    yield Row("clamped plate: centre deflection", f"{abs(w / 0.005612024020 - 1):.1e}", "≤ 1e-4")
    worst = 0.0
    for load, gauge, curvatures in RING:
        influence = fe.influence(plate, side * np.array([gauge]))
        strain = influence.strain(side * np.array([load]))[0, 0]
        truth = plate.thickness / 2 / plate.rigidity * np.array(curvatures)
        worst = max(worst, np.abs(strain - truth).max() / np.abs(truth).max())
    yield Row("clamped plate: ring strains, worst", f"{worst:.1e}", "≤ 1e-4")


# Clamped square: load, sensor (shares of the side), w,xx w,yy w,xy times D/P of the load direction,
# from a double series; two resolutions agree to 9e-12.
RING = (
    ((0.50, 0.50), (0.05, 0.05), (0.0030847812, 0.0030847812, 0.0039477063)),
    ((0.50, 0.50), (0.50, 0.05), (-0.0030220542, 0.0920915285, 0.0)),
    ((0.50, 0.50), (0.95, 0.30), (0.0604749480, -0.0008194226, -0.0165689089)),
    ((0.25, 0.50), (0.05, 0.75), (0.0576292409, 0.0025525414, -0.0273085479)),
    ((0.25, 0.50), (0.25, 0.95), (-0.0018027523, 0.0424404139, -0.0108859802)),
)


def paper_rows() -> Iterator[Row]:
    """Train the paper's first model and test it."""
    with tempfile.TemporaryDirectory() as folder:
        result = _touchplate("train", "paper-one", "--out", f"{folder}/model.h5")
    for name in ("training", "validation", "test"):
        scores = result[name]
        measured = f"{scores['mean']:.3f} / {scores['max']:.2f} mm, {scores['fraction']:.0%} < 0.5"
        yield Row(f"paper-one: {name}, mean / max", measured, "printed")


def photograph_rows(folder: Path) -> Iterator[Row]:
    """Compare with another code on a tensile test, and with the closed form of a star pattern."""
    hole = compare_open_hole(folder / "open_hole")
    measured = f"u {hole.rms_u:.4f}, v {hole.rms_v:.4f} px"
    yield Row("open hole: rms difference to another code", measured, "≤ 0.02 px")
    yield Row("open hole: its points that are valid here", f"{hole.valid:.1%}", "≥ 95 %")
    for low, high, rms, _ in compare_star(folder / "star5").bands:
        yield Row(f"star 5: rms error of v, period {low} to {high} px", f"{rms:.4f} px", "printed")


if __name__ == "__main__":
    main(*sys.argv[1:])
