"""The live chain where the camera looks at the underside."""

import time

import numpy as np
import pytest

import fe
import synthetic
from rig.calibration.store import Calibration
from rig.live.baseline import average_reference
from rig.live.bench import build_bench
from rig.live.chain import at_rest
from rig.live.frame_estimate import estimate_frame
from rig.live.strain_chain import with_strain
from rig.sources.twin import build_twin
from rig.system.timing import Stopwatch

PRESS = fe.Touch(90.0, 120.0, 3.0)
BELOW = {"camera.side": "below", "estimator.modes": 200}


def quiet(done, total):
    """Report of progress that nobody reads."""


def test_a_press_is_found_from_below_within_its_own_uncertainty(small):
    scene = small(BELOW)
    twin, bench = build_twin(scene), build_bench(scene, quiet)
    assert bench.height == -1.0
    frames = [twin.frame(number, ()) for number in range(16)]
    chain, strain = bench.prepare(average_reference(frames))
    state, watch, off = at_rest(chain), Stopwatch(time.monotonic), []
    for number in range(50, 70):
        seen = estimate_frame(chain, twin.frame(number, (PRESS,)), state, watch)
        seen, state = with_strain(strain, seen, watch), seen.state
        for found in (seen.estimate, seen.from_strain):
            error = [*found.xy[0] - (PRESS.x, PRESS.y), found.force[0] - PRESS.force]
            off.append(error / np.sqrt(np.diag(found.covariance)))
    assert np.abs(np.mean(off, axis=0)).max() < 2.0  # the reference's own noise is in all of them
    assert np.std(off, axis=0) == pytest.approx(1.0, abs=0.5)


def test_a_pose_of_the_other_side_is_refused(small, monkeypatch):
    scene = small(BELOW)
    above = synthetic.pinhole_above(scene.plate.size, 500.0, scene.camera.pixels)
    known = Calibration()
    monkeypatch.setattr(Calibration, "camera", lambda self: above)
    with pytest.raises(
        ValueError, match=r'the other side of the plate than camera\.side = "below"'
    ):
        build_bench(scene, quiet, known)
