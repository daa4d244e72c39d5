"""A frame whose plate has moved far since the last one."""

import time

import numpy as np
import pytest

import fe
from rig.calibration.bench_presses import measured
from rig.live.baseline import average_reference
from rig.live.bench import build_bench
from rig.live.chain import at_rest
from rig.live.frame_estimate import estimate_frame
from rig.live.registration import register
from rig.sources.twin import build_twin
from rig.system.timing import Stopwatch

FREE = {
    "plate.edges.kind": "mixed",
    "plate.edges.west.kind": "clamped",
    "plate.edges.east.kind": "clamped",
    "plate.edges.south.kind": "free",
    "plate.edges.north.kind": "free",
}


def pressed_far(small):
    """Return the chain of a plate with two free edges, and its image under a press on one."""
    scene = small(FREE)
    bench, twin = build_bench(scene, lambda done, total: None), build_twin(scene)
    chain = bench.prepare(average_reference([twin.frame(n, ()) for n in range(16)]))[0]
    return chain, twin.frame(40, (fe.Touch(120.0, 30.0, 26.0),))


@pytest.mark.slow
def test_a_press_on_a_free_edge_is_found_from_the_plate_at_rest(small):
    chain, image = pressed_far(small)
    watch = Stopwatch(time.monotonic)
    seen = register(chain, image, chain.pattern.still(), watch)
    again = register(chain, image, seen.motion, watch)
    flow, settled = (chain.pattern.motions.flow(each.motion) for each in (seen, again))
    assert np.abs(settled).max() > 3.0  # px, where tiles find half a pixel
    assert np.abs(flow - settled).max() < 0.05


@pytest.mark.slow
def test_a_press_that_is_not_followed_to_its_end_is_refused(small, monkeypatch):
    chain, image = pressed_far(small)
    monkeypatch.setattr("rig.live.registration.MAX_ITERATIONS", 4)
    with pytest.raises(ValueError, match=r"press 3 move the pattern farther .* press less hard"):
        measured(chain, image.astype(np.float32), None, "3")


def test_a_frame_that_is_not_followed_to_its_end_goes_on_from_its_touches(small, monkeypatch):
    """Though no tile looks strange: it is moved as the touches found so far move it."""
    chain, image = pressed_far(small)
    monkeypatch.setattr("rig.live.registration.MAX_ITERATIONS", 4)
    found = estimate_frame(chain, image, at_rest(chain), Stopwatch(time.monotonic))
    assert not found.unusable_reason
    assert found.estimate.count == 1
    assert np.hypot(*(found.estimate.xy[0] - (120.0, 30.0))) < 5.0


def test_a_frame_that_is_not_followed_to_its_end_says_so(small, monkeypatch):
    chain, image = pressed_far(small)
    monkeypatch.setattr("rig.live.registration.MAX_ITERATIONS", 2)
    monkeypatch.setattr("rig.live.frame_estimate.GUESSES", 0)
    cut = estimate_frame(chain, image, at_rest(chain), Stopwatch(time.monotonic))
    assert "farther than it can be followed" in cut.unusable_reason
    assert not cut.estimate.count
    monkeypatch.undo()
    whole = estimate_frame(chain, image, cut.state, Stopwatch(time.monotonic))
    assert not whole.unusable_reason
    assert whole.estimate.count


def test_a_bench_on_which_nothing_can_be_computed_is_said_and_the_run_goes_on(small, monkeypatch):
    chain, image = pressed_far(small)

    def broken(*_, **__):
        raise np.linalg.LinAlgError("Matrix is not positive definite")

    monkeypatch.setattr("models.Estimator.fit_whitened", broken)
    found = estimate_frame(chain, image, at_rest(chain), Stopwatch(time.monotonic))
    assert "calibrate the bench" in found.unusable_reason
    assert not found.estimate.count
