"""Touches beyond linear theory: the loop follows them on the reduced plate; the shell checks it."""

import time

import numpy as np
import pytest

import fe
from rig.live.baseline import average_reference
from rig.live.bench import build_bench
from rig.live.chain import at_rest
from rig.live.frame_estimate import estimate_frame
from rig.live.tracker import FrameProcessor
from rig.sources.twin import build_twin
from rig.system.frame import Frame
from rig.system.timing import Stopwatch

THIN = {"thickness": 1.0, "theory": None}
TOUCHES = (fe.Touch(150.0, 90.0, 2.5), fe.Touch(80.0, 120.0, 1.2))  # w/h of 1.1 and 0.5


@pytest.mark.slow
def test_a_press_of_a_finger_on_a_thin_plate_is_found_in_images_of_the_shell(small):
    plate = small().model_dump()["plate"] | THIN
    scene = small({"plate": plate, "touches.force": [0.5, 3.0], "estimator.modes": 80})
    bench, twin = build_bench(scene, lambda done, total: None), build_twin(scene)
    assert bench.theory.name == "large"
    watch, mesh = Stopwatch(time.monotonic), fe.grid(bench.plate, 32)
    follower = FrameProcessor(
        bench, average_reference([twin.frame(k, ()) for k in range(16)]), watch, time.monotonic
    )
    for number, touch in enumerate(TOUCHES):
        shell = fe.solve(bench.plate, [touch], mesh=mesh)
        rng = np.random.default_rng(number)
        moved = shell.displacement(twin.warper.points, "top")
        image = twin.warper.render(moved, twin.sensor, rng)
        sensed = follower.process(Frame(20 + number, time.monotonic(), image)).frame_estimate
        for found in (sensed.estimate, sensed.from_strain):
            assert found.count == 1
            # 0.4 mm and 0.9 % measured; linear theory is off by centimetres and 60 % here
            assert np.hypot(*(found.xy[0] - (touch.x, touch.y))) < 2.0
            assert found.force[0] == pytest.approx(touch.force, rel=0.05)
        assert follower.sentence(sensed) == "one touch"
    hard = twin.frame(30, (fe.Touch(127.0, 100.0, 9.0),))
    sensed = estimate_frame(follower.chain, hard, at_rest(follower.chain), watch)
    assert "the plate is stretched further than" in follower.sentence(sensed)
