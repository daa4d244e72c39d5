"""A telecentric camera in a scene: seen in the twin, live, by nets, and in the account."""

import time

import numpy as np
import pytest

import fe
from rig.live.baseline import average_reference
from rig.live.bench import build_bench
from rig.live.chain import at_rest
from rig.live.frame_estimate import estimate_frame
from rig.live.strain_chain import with_strain
from rig.scene.account import account
from rig.sources.twin import build_twin
from rig.system.timing import Stopwatch
from rig.training.data import simulate_sets
from rig.training.plan import training_plan

PRESS = fe.Touch(90.0, 120.0, 30.0)  # N; without the plate's motion towards it a camera sees little


def quiet(done, total):
    """Report of progress that nobody reads."""


@pytest.fixture
def scene(small):
    return small({"camera.kind": "telecentric", "estimator.modes": 200})


def test_a_press_is_found_within_its_own_uncertainty(scene):
    twin, bench = build_twin(scene), build_bench(scene, quiet)
    chain, strain = bench.prepare(
        average_reference([twin.frame(number, ()) for number in range(16)])
    )
    state, watch = at_rest(chain), Stopwatch(time.monotonic)
    off = []
    for number in range(50, 70):
        sensed = estimate_frame(chain, twin.frame(number, (PRESS,)), state, watch)
        sensed, state = with_strain(strain, sensed, watch), sensed.state
        for reported in (sensed.estimate, sensed.from_strain):
            error = [*reported.xy[0] - (PRESS.x, PRESS.y), reported.force[0] - PRESS.force]
            off.append(error / np.sqrt(np.diag(reported.covariance)))
    assert np.abs(np.mean(off, axis=0)).max() < 2.0  # the reference's own noise is in all of them
    assert np.std(off, axis=0) == pytest.approx(1.0, abs=0.5)


def test_it_sees_less_of_a_touch_than_a_pinhole(small):
    net = {
        "touches.max_touches": 1,
        "gauges": {"kind": "lattice", "spacing": 51.0, "margin": 25.0, "subset": 41},
        "estimator": {"kind": "net"},
        "training": {"samples": 40, "margin": 30.0, "test_samples": 20},
    }
    size = {
        kind: np.std(
            simulate_sets(
                training_plan(small(net | {"camera.kind": kind})), quiet
            ).noise.pool.strain
        )
        for kind in ("telecentric", "pinhole")
    }
    assert size["telecentric"] < 0.5 * size["pinhole"]


def test_the_account_says_what_it_leaves_out(scene, small):
    named = {part.name for part in account(scene).left_out}
    assert "out-of-plane terms" in named
    assert "out-of-plane terms" not in {part.name for part in account(small()).left_out}
