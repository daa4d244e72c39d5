"""What projected marks do to the touches that are found: each mode against no light at all.

Parts: modes, demos. A clamped PVC plate under the camera of the scene `twin`; each touch is seen in
the same noise with and without the light of its own mark, as it is and divided by the light that is
known, as the loop does. The meter's prediction stands beside what happened. *Demos*: likewise under
the light of each demo after half a second of a touch, its resting light in the reference.
"""

import time
from collections import defaultdict
from collections.abc import Iterator
from typing import get_args

import numpy as np
from numpy.typing import NDArray

import fe
import rig
from models import Estimate
from rig.live.baseline import average_reference
from rig.live.bench import build_bench
from rig.live.chain import Chain, at_rest, prepare_chain
from rig.live.frame_estimate import estimate_frame
from rig.live.snapshot import Mark
from rig.live.view import marks, plate_view
from rig.plates.plate_solver import solve_plate
from rig.projector.content import draw
from rig.projector.demos.demo import Demo, DemoName, begin_demo
from rig.projector.demos.moment import Load, Moment
from rig.projector.interference import interference
from rig.projector.light_map import divided, prepare_light_map
from rig.projector.markers import draw_marks, fit_plate
from rig.projector.modes import Mode, placed
from rig.report.figure import Figure, at_most
from rig.sources.twin import Twin, build_twin
from rig.studies.study import line, part, rms, run
from rig.system.timing import Stopwatch

TOUCHES = 80
STRENGTH = 1.0  # the projector's white over the room's light
SENSOR_DARK = 51.0  # grey levels that the twin's sensor reads without light
PROJECTOR = (1280, 800)
MODES: tuple[Mode, ...] = ("on", "beside", "outside")
DEFAULT = "on"
GROWTH = at_most(1.1)  # of the error of the place without light
BARRED = (DEFAULT, *get_args(DemoName))
UNDER_DEMOS = 120  # touches


def photograph(
    twin: Twin, touches: tuple[fe.Touch, ...], light: NDArray[np.float32], seed: tuple[int, int]
) -> NDArray[np.uint8]:
    """Frame of a plate under light of the room times `light`."""
    displacement = np.zeros((len(twin.warper.points), 3))
    if touches:
        displacement = solve_plate(twin.solver, touches).displacement(
            twin.warper.points, twin.warper.camera.face
        )
    sharp = twin.warper.render(displacement, None, None) / 255
    return twin.sensor.capture((sharp * light).astype(np.float32), np.random.default_rng(seed))


def find(chain: Chain, image: NDArray[np.uint8]) -> Estimate:
    """Touch in a frame, begun from where it was in the last one."""
    state, watch = at_rest(chain), Stopwatch(time.monotonic)
    state = estimate_frame(chain, image, state, watch).state
    return estimate_frame(chain, image, state, watch).estimate


def modes() -> Iterator[Figure]:
    """Find touches under the light of their marks, mode by mode."""
    scene = rig.load("twin", {"touches.max_touches": 1})
    twin, bench = build_twin(scene), build_bench(scene, lambda done, total: None)
    dark = np.ones(twin.warper.light.shape, np.float32)
    rest = [photograph(twin, (), dark, (9, k)) for k in range(part(scene.dic).reference_frames)]
    chain = prepare_chain(average_reference(rest), bench.motions, 1)
    screen = fit_plate(PROJECTOR, bench.plate.size)
    view = plate_view(bench.plate, bench.camera)
    seen = prepare_light_map(screen, view.T_px_plate, bench.camera.size, STRENGTH, SENSOR_DARK)
    rng = np.random.default_rng(3)
    errors: defaultdict[str, list[float]] = defaultdict(list)
    meter: list[tuple[float, float]] = []
    for index in range(TOUCHES):
        x, y = rng.uniform(25, np.array(bench.plate.size) - 25)
        touch = fe.Touch(float(x), float(y), float(rng.uniform(0.5, 4.0)))
        first = find(chain, photograph(twin, (touch,), dark, (1, index)))
        errors["none"].append(miss(first, touch))
        for mode in MODES:
            shown = draw_marks(placed(marks(first), mode, bench.plate.size), screen)
            light = seen.on_camera(shown)
            image = photograph(twin, (touch,), light, (1, index))
            found = find(chain, image)
            errors[mode].append(miss(found, touch))
            clean = divided(image, light, SENSOR_DARK)
            errors[f"{mode}, divided"].append(miss(find(chain, clean), touch))
            if mode == "on" and found.count == first.count == 1:
                said = interference(chain, light, SENSOR_DARK, marks(first))
                meter.append((said.shift, float(np.hypot(*(found.xy[0] - first.xy[0])))))
    yield from measured(errors)
    predicted, moved = np.array(meter).T
    yield from line(
        "Marks of the projector: what the meter predicts, mode on",
        "how far the touch moves",
        predicted=(float(np.median(predicted)), "mm, median"),
        happened=(float(np.median(moved)), "mm, median"),
        correlation=float(np.corrcoef(predicted, moved)[0, 1]),
    )


def demos() -> Iterator[Figure]:
    """Find touches under the light of each demo."""
    scene = rig.load("twin", {"touches.max_touches": 1})
    twin, bench = build_twin(scene), build_bench(scene, lambda done, total: None)
    size, count = bench.plate.size, part(scene.dic).reference_frames
    screen = fit_plate(PROJECTOR, size)
    view = plate_view(bench.plate, bench.camera)
    seen = prepare_light_map(screen, view.T_px_plate, bench.camera.size, STRENGTH, SENSOR_DARK)
    dark = np.ones(twin.warper.light.shape, np.float32)
    errors: defaultdict[str, list[float]] = defaultdict(list)
    resting: dict[str, Demo | None] = {
        name: begin_demo(name, size, 4.0) for name in get_args(DemoName)
    }
    for name, demo in ({"none": None} | resting).items():
        lit = dark if demo is None else seen.on_camera(draw(demo, screen))
        rest = [photograph(twin, (), lit, (9, k)) for k in range(count)]
        chain = prepare_chain(average_reference(rest), bench.motions, 1)
        clear = [divided(image, lit, SENSOR_DARK) for image in rest]
        clean = prepare_chain(average_reference(clear), bench.motions, 1)
        rng = np.random.default_rng(3)
        for index in range(UNDER_DEMOS):
            x, y = rng.uniform(25, np.array(size) - 25)
            touch = fe.Touch(float(x), float(y), float(rng.uniform(0.5, 4.0)))
            light = dark if demo is None else seen.on_camera(draw(touched(demo, touch), screen))
            image = photograph(twin, (touch,), light, (1, index))
            errors[name].append(miss(find(chain, image), touch))
            if demo is not None:
                image = divided(image, light, SENSOR_DARK)
                errors[f"{name}, divided"].append(miss(find(clean, image), touch))
    yield from measured(errors, "Demos of the projector: error of the place with light and without")


def touched(demo: Demo, touch: fe.Touch) -> Demo:
    """Let a demo see a touch for half a second."""
    mark = Mark(touch.x, touch.y, touch.force, (0.3, 0.3, 0.0), 0.02, 1)
    for number in range(16):
        demo = demo.after(Moment(number / 30.0, (mark,), Load(touch.force, 0.02)))
    return demo


def measured(
    errors: dict[str, list[float]],
    table: str = "Marks of the projector: error of the place with light and without",
) -> Iterator[Figure]:
    """Give a line to each kind of light, its error beside that without light."""
    base = rms(found(errors["none"]))
    for name, values in errors.items():
        there = found(values)
        yield from line(
            table,
            name + " (default)" * (name == DEFAULT),
            rms=(rms(there), "mm"),
            median=(float(np.median(there)), "mm"),
            over_none=(rms(there) / base, "", GROWTH if name in BARRED else None, len(there)),
        )


def found(errors: list[float]) -> NDArray[np.float64]:
    """Errors of the touches that were found alone."""
    values = np.array(errors)
    return values[np.isfinite(values)]


def miss(estimate: Estimate, touch: fe.Touch) -> float:
    """Distance of a found touch from the true one, mm; NaN where it was not found alone."""
    if estimate.count != 1:
        return np.nan
    return float(np.hypot(estimate.xy[0, 0] - touch.x, estimate.xy[0, 1] - touch.y))


PARTS = {"modes": modes, "demos": demos}

if __name__ == "__main__":
    run(PARTS, __doc__)
