"""What projected marks do to the touches that are found: each mode against no light at all.

    python benchmarks/projected_light.py [--touches 60] [--strength 1.0]

A clamped PVC plate under the camera of the scene `twin`; each touch is seen in the same noise with
and without the light of its own mark. `strength` is the projector's white over the room's light.
The meter's prediction stands beside what happened.
"""

from __future__ import annotations

import argparse
import time

import numpy as np

import fe
import rig
from rig.live import chain as live
from rig.live.baseline import take_zero
from rig.live.bench import build_bench
from rig.live.view import look, marks
from rig.projector.interference import interference
from rig.projector.light_map import divided, see_light
from rig.projector.markers import draw_marks, fit_plate
from rig.projector.modes import placed
from rig.sources.twin import build_twin
from rig.system.timing import Stopwatch

SENSOR_DARK = 51.0  # grey levels that the twin's sensor reads without light
PROJECTOR = (1280, 800)


def photograph(twin, touches, light, seed):
    """Frame of a plate under light of the room times `light`."""
    displacement = np.zeros((len(twin.warper.points), 3))
    if touches:
        displacement = twin.solver.deflect(touches).displacement(twin.warper.points, "top")
    sharp = twin.warper.render(displacement, None, None) / 255
    return twin.sensor.capture((sharp * light).astype(np.float32), np.random.default_rng(seed))


def find(chain, image, start):
    """Touch in a frame, begun from where it was in the last one."""
    state = live.at_rest(chain)
    for _ in range(2):
        found = live.sense(chain, image, state, Stopwatch(time.monotonic))
        state = found.state
    return found.estimate


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--touches", type=int, default=60)
    options.add_argument("--strength", type=float, default=1.0)
    given = options.parse_args()
    scene = rig.load("twin", {"touches.most": 1})
    twin, bench = build_twin(scene), build_bench(scene, lambda done, total: None)
    dark = np.ones(twin.warper.light.shape, np.float32)
    rest = [photograph(twin, (), dark, (9, k)) for k in range(scene.dic.reference_frames)]
    chain = live.prepare_chain(take_zero(rest), bench.motions, 1)
    screen = fit_plate(PROJECTOR, bench.plate.size)
    view = look(bench.plate, bench.camera, bench.height)
    map_ = see_light(screen, view.T_px_plate, bench.camera.size, given.strength, SENSOR_DARK)
    rng = np.random.default_rng(3)
    errors, predicted = {}, []
    for index in range(given.touches):
        x, y = rng.uniform(25, np.array(bench.plate.size) - 25)
        touch = fe.Touch(float(x), float(y), float(rng.uniform(0.5, 4.0)))
        first = find(chain, photograph(twin, (touch,), dark, (1, index)), None)
        errors.setdefault("none", []).append(miss(first, touch))
        for mode in ("on", "beside", "outside"):
            shown = draw_marks(placed(marks(first), mode, bench.plate.size), screen)
            light = map_.seen(shown)
            image = photograph(twin, (touch,), light, (1, index))
            errors.setdefault(mode, []).append(miss(find(chain, image, None), touch))
            mended = divided(image, light, SENSOR_DARK)
            errors.setdefault(f"{mode}, divided", []).append(miss(find(chain, mended, None), touch))
            if mode == "on":
                said = interference(chain, light, SENSOR_DARK, marks(first))
                now = find(chain, image, None)
                moved = (
                    np.hypot(*(now.xy[0] - first.xy[0])) if now.count and first.count else np.nan
                )
                predicted.append((said.shift, moved, said.sigmas))
    base = None
    for name, values in errors.items():
        rms = np.sqrt(np.nanmean(np.square(values)))
        base = base or rms
        print(
            f"{name:18s} rms {rms:.3f} mm  median {np.nanmedian(values):.3f} mm  {rms / base:.3f}"
        )
    said, moved, sigmas = np.array(predicted).T
    print(
        f"meter: predicted {np.nanmedian(said):.3f} mm, happened {np.nanmedian(moved):.3f} mm, "
        f"correlation {np.corrcoef(said, moved)[0, 1]:.3f}, median {np.median(sigmas):.2f} sigma"
    )


def miss(estimate, touch):
    """Distance of a found touch from the true one, mm; NaN where it was not found alone."""
    if estimate.count != 1:
        return np.nan
    return float(np.hypot(estimate.xy[0, 0] - touch.x, estimate.xy[0, 1] - touch.y))


if __name__ == "__main__":
    main()
