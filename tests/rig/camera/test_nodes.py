import numpy as np
import pytest

from rig.camera import Controls
from rig.camera.device import stamp
from rig.camera.nodes import DeviceClock, by_pulses, set_up
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


class Features:
    """Features of a camera, some of which take certain values only."""

    def __init__(self, **offered):
        self.offered, self.now = offered, {}

    def get(self, name):
        return self.now.get(name)

    def set(self, name, value):
        accepted = value in self.offered.get(name, (value,))
        if accepted:
            self.now[name] = value
        return accepted


def take_by(features, trigger):
    return set_up(features, "camera 7", (64, 48), 30.0, Controls(), trigger)


def test_a_camera_with_a_trigger_waits_for_rising_edges_and_keeps_no_rate():
    features = Features()
    take_by(features, "Line1")
    assert features.now["TriggerSource"] == "Line1"
    assert features.now["TriggerMode"] == "On"
    assert features.now["TriggerSelector"] == "FrameStart"
    assert features.now["TriggerActivation"] == "RisingEdge"
    assert not features.now["AcquisitionFrameRateEnable"]
    assert by_pulses("camera 7", "Line1") == "camera 7, triggered by Line1,"


def test_a_camera_without_a_trigger_runs_by_itself_whatever_it_was_left_at():
    features = Features()
    take_by(features, "Line1")
    take_by(features, None)
    assert features.now["TriggerMode"] == "Off"
    assert features.now["AcquisitionFrameRate"] == 30.0
    assert by_pulses("camera 7", None) == "camera 7"


@pytest.mark.parametrize("offered", [{"TriggerSource": ["Line1"]}, {"TriggerMode": ["Off"]}])
def test_an_input_that_the_camera_has_not_is_one_sentence(offered):
    with pytest.raises(OSError, match=r"camera 7 takes no frames by its input 'Line2'; set source"):
        take_by(Features(**offered), "Line2")
