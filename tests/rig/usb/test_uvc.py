"""Controls of a camera by class requests, with the order of `rig.camera.controls`."""

import pytest

from rig.camera import Controls
from rig.camera.controls import hold
from rig.usb import list_devices
from rig.usb.uvc import open_uvc


def test_controls_are_held_through_the_units_that_the_descriptors_name(make_bus, webcam, tmp_path):
    bus = make_bus(webcam)
    (device,) = list_devices(bus, tmp_path)
    with open_uvc(device, bus) as port:
        assert webcam.driver == {1}
        settings = hold(port, Controls(exposure=0.008, gain=40, white_balance=5000))
    assert [setting.sentence for setting in settings] == [
        "exposure is held at 0.008 s",
        "gain is held at 40",
        "focus is held at 30",
        "white balance is held at 5000 K",
    ]
    assert {place: value for place, (_, value) in webcam.controls.items()} == {
        (7, 2): 1, (7, 4): 80, (7, 6): 30, (7, 8): 0, (9, 4): 40, (9, 10): 5000, (9, 11): 0,
    }  # fmt: skip


def test_the_driver_has_the_camera_back_afterwards(make_bus, webcam, tmp_path):
    bus = make_bus(webcam)
    (device,) = list_devices(bus, tmp_path)
    with pytest.raises(RuntimeError), open_uvc(device, bus):
        raise RuntimeError
    assert webcam.driver == {0, 1}
    assert webcam.claimed == set()


def test_a_control_that_the_camera_lacks_is_data(make_bus, webcam, tmp_path):
    del webcam.controls[7, 6], webcam.controls[7, 8]
    bus = make_bus(webcam)
    (device,) = list_devices(bus, tmp_path)
    with open_uvc(device, bus) as port:
        settings = hold(port, Controls(focus=10, gain=70_000))
    assert [setting.sentence for setting in settings[1:3]] == [
        "gain 70000 was refused, it is 16",
        "the camera has no focus",
    ]


def test_a_camera_that_is_pulled_out_meanwhile_ends_quietly(make_bus, webcam, tmp_path):
    bus = make_bus(webcam)
    (device,) = list_devices(bus, tmp_path)
    with open_uvc(device, bus) as port:
        bus.toys = []
        assert hold(port, Controls(exposure=0.01))[0].got is None


def test_what_is_no_camera_is_one_sentence(make_bus, light, tmp_path):
    bus = make_bus(light)
    (device,) = list_devices(bus, tmp_path)
    with (
        pytest.raises(OSError, match="Light 1209:0001 at 1-4 is no UVC camera"),
        open_uvc(device, bus),
    ):
        pass
