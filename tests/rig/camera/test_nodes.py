import numpy as np
import pytest

from rig.camera.device import stamp
from rig.camera.nodes import DeviceClock
from rig.system.optional import need


@pytest.mark.parametrize("jump", [-3600.0, -2.5, 0.5, 3600.0])
def test_a_stamp_of_another_clock_gives_way_to_the_time_of_arrival(jump):
    assert stamp(100.0 + jump, 100.0) == 100.0
    assert stamp(99.98, 100.0) == 99.98


def test_a_package_that_is_not_installed_is_named_with_its_command():
    with pytest.raises(OSError, match=r"run pip install 'touchplate\[vision\]'"):
        need("no_such_package_at_all", "vision")


def test_a_device_clock_follows_the_quickest_delivery_and_a_drifting_crystal(rng):
    clock, drift = DeviceClock(), 50e-6
    errors = []
    for number in range(3000):
        captured = 1000.0 + number / 30
        theirs = (captured - 990.0) * (1 + drift)
        arrival = captured + 0.002 + rng.exponential(0.003)
        errors.append(clock.ours(theirs, arrival) - captured)
    settled = np.array(errors[100:])
    assert settled.min() > 0.0015  # never before it was taken
    assert settled.max() < 0.0035  # measured 2.0 to 2.7 ms: the transport's least and some drift


def test_a_camera_without_a_clock_is_stamped_at_arrival():
    assert DeviceClock().ours(0.0, 12.5) == 12.5
