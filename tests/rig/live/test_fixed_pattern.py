"""A camera whose sensor has a pattern of its own: known by what moves, and taken out."""

import time
from dataclasses import replace

import numpy as np
import pytest

import fe
from rig.calibration.bench_presses import with_fixed_pattern
from rig.live import fixed_pattern
from rig.live.baseline import average_reference
from rig.live.bench import build_bench
from rig.live.chain import at_rest
from rig.live.frame_estimate import estimate_frame
from rig.live.quality import signs
from rig.sources.twin import build_twin
from rig.system.timing import Stopwatch

PRESSES = [fe.Touch(150.0, 80.0, 6.0), fe.Touch(90.0, 130.0, 5.0), fe.Touch(120.0, 100.0, 6.0)]
FRAMES = 16
THIN = {"plate.thickness": "0.9 mm"}


@pytest.fixture
def run(small):
    """Run frames of presses through a chain, the sensor with a pattern of so many grey levels."""

    def run(level, changes=None):
        scene = small(THIN | (changes or {}))
        bench, twin = build_bench(scene, lambda done, total: None), build_twin(scene)
        own = level * np.random.default_rng(9).standard_normal(twin.frame(0, ()).shape)

        def soiled(number, touches):
            return np.clip(np.rint(twin.frame(number, touches) + own), 0, 255).astype(np.uint8)

        zero = average_reference([soiled(n, ()) for n in range(16)])
        chain = bench.prepare(zero)[0]
        state, found = at_rest(chain), []
        for k in range(FRAMES * len(PRESSES)):
            press = PRESSES[k // FRAMES]
            one = estimate_frame(chain, soiled(40 + k, (press,)), state, Stopwatch(time.monotonic))
            assert one.estimate.count == 1
            state = one.state
            found.append((one.estimate.force[0] / press.force - 1.0, chain, one))
        return found

    return run


def bias(found):
    """Give the mean error of forces after the first press, as a fraction."""
    return float(np.mean([force for force, _, _ in found[FRAMES:]]))


def test_a_pattern_of_the_sensor_is_known_and_forces_are_right(run, monkeypatch):
    found = run(3.0)
    _, chain, last = found[-1]
    assert last.state.fixed_pattern.level == pytest.approx(3.0, rel=0.1)
    (sensor,) = (sign for sign in signs(chain, last) if sign.name == "sensor")
    assert sensor.warns
    assert all(one.state.fixed_pattern.variance for _, _, one in found[FRAMES:])
    monkeypatch.setattr(fixed_pattern, "SURE", np.inf)
    before = bias(run(3.0))
    assert before < -0.02
    assert abs(bias(found)) < 0.15 * abs(before)


@pytest.mark.parametrize("softness", [None, 0.1])
def test_a_clean_sensor_has_none_whatever_the_print(run, softness):
    """A print with hard edges leaves much unexplained where it moves, by aliasing."""
    found = run(0.0, {} if softness is None else {"pattern.softness": softness})
    _, chain, last = found[-1]
    assert last.state.fixed_pattern.level < 0.3
    (sensor,) = (sign for sign in signs(chain, last) if sign.name == "sensor")
    bound = last.state.fixed_pattern.detectable
    assert sensor.says == f"clean to {bound:.1f} grey levels"
    assert bound < 3.0
    assert not sensor.warns


def test_images_of_presses_show_it_to_all_of_them(small):
    scene = small(THIN)
    bench, twin = build_bench(scene, lambda done, total: None), build_twin(scene)
    own = 3.0 * np.random.default_rng(9).standard_normal(twin.frame(0, ()).shape)
    zero = average_reference([np.rint(twin.frame(n, ()) + own) for n in range(16)])
    chain = bench.prepare(zero)[0]
    weak, strong = (
        np.mean([twin.frame(40 + n, (replace(press, force=force),)) for n in range(12)], axis=0)
        for press, force in zip(PRESSES[:2], (0.5, 6.0), strict=True)
    )
    images = [(np.float32(image + own), None) for image in (weak, strong)]
    assert not with_fixed_pattern(chain, images[:1]).fixed_pattern.variance
    assert with_fixed_pattern(chain, images).fixed_pattern.level == pytest.approx(3.0, rel=0.1)
