"""A tap in the live loop: images rendered from finite elements that are stepped through time."""

import time

import numpy as np
import pytest

import fe
import rig
from fe.elements.functional import derivative
from fe.linear.energy import free
from rig.live.baseline import average_reference
from rig.live.bench import build_bench
from rig.live.tracker import FrameProcessor
from rig.scene.account import account
from rig.sources.twin import build_twin
from rig.studies.dynamics.vibrating import KEPT, STEP, Damping, summed_readings
from rig.system.frame import Frame
from rig.system.timing import Stopwatch

RINGS = {"dynamics.density": "1.4 g/cm³", "dynamics.damping": 0.02, "dynamics.exposure": "6 ms"}
RATE, EXPOSURE, FORCE, BEGINS, LASTS = 120.0, 0.006, 8.0, 0.03, 0.02
PLACE = np.array([[100.0, 150.0]])


def shown_by(plate, mesh, points):
    """Displacement of the touched face at points by each free unknown, (3N, unknowns)."""
    rows, columns = free(plate, mesh)
    size = int(rows.sum() * columns.sum())
    unit = np.zeros((*mesh.shape, size))
    unit[np.ix_(rows, columns)] = np.eye(size).reshape(rows.sum(), columns.sum(), size)
    w, wx, wy = (derivative(mesh, points, *pq).of(unit) for pq in ((0, 0), (1, 0), (0, 1)))
    height = plate.thickness / 2
    return np.stack([-height * wx, -height * wy, w], axis=1).reshape(-1, size)


def frames(bench, twin, duration):
    """Render images, each of the mean over its exposure, with their times."""
    mesh, points = fe.grid(bench.plate, 12), twin.warper.points
    summed = summed_readings(
        bench.plate,
        mesh,
        1.4e-9,
        Damping(0.02, 80.0, 450.0),
        shown_by(bench.plate, mesh, points),
        PLACE,
        lambda t: np.array([FORCE * np.sin(np.pi * np.clip((t - BEGINS) / LASTS, 0, 1))]),
        duration,
    )[:, 0]
    grain, rng = KEPT * STEP, np.random.default_rng(0)
    for end in range(round(EXPOSURE / grain), len(summed), round(1 / RATE / grain)):
        mean = (summed[end] - summed[end - round(EXPOSURE / grain)]) / EXPOSURE
        yield end * grain, twin.warper.render(mean.reshape(-1, 3), twin.sensor, rng)


@pytest.mark.slow
@pytest.mark.parametrize("changes", [{}, RINGS])
def test_a_plate_that_rings_after_a_tap_shows_no_touch(small, changes):
    scene = small({"comparison": None, "estimator.modes": 100} | changes)
    bench, twin = build_bench(scene, lambda done, total: None), build_twin(scene)
    reference = average_reference([twin.frame(k, ()) for k in range(16)])
    follower = FrameProcessor(bench, reference, Stopwatch(time.monotonic), time.monotonic)
    after, taps = 0, []
    for number, (when, image) in enumerate(frames(bench, twin, 0.25)):
        found = follower.process(Frame(number, when, image)).frame_estimate
        taps += found.state.past.taps
        after += found.estimate.count if when - EXPOSURE > BEGINS + LASTS else 0
    if not changes:
        assert after > 0
        assert not taps
        return
    assert after == 0
    (tap,) = taps
    # 1 % measured
    assert tap.force == pytest.approx(FORCE, rel=0.1)
    assert np.hypot(tap.x - PLACE[0, 0], tap.y - PLACE[0, 1]) < 3.0


def test_what_a_scene_says_of_time_is_in_its_account(small):
    scene = small(RINGS | {"dynamics.creep": [[0.02, "5 s"], [0.04, "50 s"]]})
    (part,) = (part for part in account(scene).parts if part.name == "dynamics")
    assert part.what == "ringing at 1400 kg/m³ and creep of 2 terms"


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"dynamics.damping": 0.1}, "dynamics.density or dynamics.creep"),
        ({"dynamics.density": "water"}, "kg/m³"),
        ({"dynamics.creep": [[0.7, "5 s"]]}, "dynamics.creep"),
    ],
)
def test_a_scene_that_says_nothing_of_use_is_refused(small, changes, says):
    with pytest.raises(rig.SceneError, match=says):
        small(changes)


def test_an_uncertain_bench_has_no_modes_that_ring(small):
    scene = small(RINGS | {"estimator.bench": "usual"})
    with pytest.raises(ValueError, match=r"leave dynamics.density out"):
        build_bench(scene, lambda done, total: None)
