"""Fingers that rub: the shell is pushed along its face too, and σ of the place holds it."""

import time

import numpy as np
import pytest

import fe
from rig.live.baseline import average_reference
from rig.live.bench import build_bench
from rig.live.chain import at_rest
from rig.live.frame_estimate import estimate_frame
from rig.sources.twin import build_twin
from rig.system.timing import Stopwatch

FRICTION = 0.8  # of rubber: more than noise does
COUNT = 24


@pytest.mark.slow
def test_the_place_of_a_finger_that_rubs_lies_within_its_sigma(small):
    said = {"touches.friction": FRICTION, "touches.force": [1.0, 4.0], "sensor.noise": 0.25}
    scene = small(said)
    bench, twin = build_bench(scene, lambda done, total: None), build_twin(scene)
    chain, _ = bench.prepare(average_reference([twin.frame(k, ()) for k in range(16)]))
    watch, shell = Stopwatch(time.monotonic), fe.Shell(bench.plate, fe.grid(bench.plate, 16))
    flat, rng = shell.at(fe.Base()), np.random.default_rng(5)
    off, aside, sigma, noise = (np.empty((COUNT, 2)) for _ in range(4))
    for number in range(COUNT):
        place = rng.uniform(40.0, np.array(bench.plate.size) - 40.0)
        force = float(rng.uniform(2.0, 4.0))
        along = FRICTION * force * rng.normal(size=2)
        pressed = flat.touch([fe.Touch(*place, force)]).apply([fe.FaceForce(*place, *along)])
        moved = pressed.displacement(twin.warper.points, "top")
        image = twin.warper.render(moved, twin.sensor, rng)
        found = estimate_frame(chain, image, at_rest(chain), watch).estimate
        assert found.count == 1
        off[number] = found.xy[0] - place
        aside[number] = 0.5 * bench.plate.thickness * along / force
        sigma[number] = np.sqrt(np.diag(found.covariance)[:2])
        noise[number] = np.sqrt(np.diag(found.covariance - found.systematic)[:2])
    assert np.mean(np.abs(off / sigma) < 1.0) > 0.5
    assert np.mean(np.abs(off / sigma) < 2.0) > 0.85
    assert np.mean(np.abs(off / noise) < 2.0) < 0.75  # without it, too often outside
    assert np.corrcoef(off.ravel(), aside.ravel())[0, 1] > 0.6
