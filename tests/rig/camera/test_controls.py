"""The order in which controls are held, on cameras that refuse in the ways that real ones do."""

import pytest

from rig.camera import opencv, v4l2
from rig.camera.controls import Controls, Knob, hold
from rig.camera.panel import Panel


class Webcam:
    """Refuses a value while its automatic is on; each of these may not exist or be stuck."""

    def __init__(self, stuck=(), absent=(), steps=()):
        self.automatic = dict.fromkeys(Knob, True) | {Knob.GAIN: False}
        self.values = {
            Knob.EXPOSURE: 0.025, Knob.GAIN: 16.0, Knob.FOCUS: 30.0, Knob.WHITE_BALANCE: 4600.0,
        }  # fmt: skip
        self.stored = dict(self.values) | {Knob.EXPOSURE: 0.1}
        self.stuck, self.steps = stuck, dict(steps)
        for knob in absent:
            del self.values[knob]

    def manual(self, knob):
        if knob in self.stuck:
            return False
        if self.automatic[knob]:
            self.values[knob] = self.stored[knob]  # an older value comes back
        self.automatic[knob] = False
        return True

    def read(self, knob):
        return self.values.get(knob)

    def write(self, knob, value):
        if self.automatic[knob]:
            return False
        step = self.steps.get(knob, 1e-9)
        self.values[knob] = round(value / step) * step
        return True


def test_automatics_go_off_before_values_are_set():
    camera = Webcam()
    settings = hold(camera, Controls(exposure=0.008, gain=4, focus=12, white_balance=5000))
    assert [setting.held for setting in settings] == [True] * 4
    assert camera.values == {
        Knob.EXPOSURE: 0.008, Knob.GAIN: 4, Knob.FOCUS: 12, Knob.WHITE_BALANCE: 5000,
    }  # fmt: skip


def test_without_a_value_the_one_that_the_automatic_found_is_held():
    camera = Webcam()
    exposure = hold(camera, Controls())[0]
    assert exposure.held
    assert camera.values[Knob.EXPOSURE] == pytest.approx(0.025)
    assert exposure.sentence == "exposure is held at 0.025 s"


def test_an_automatic_that_stays_on_is_said():
    exposure = hold(Webcam(stuck=[Knob.EXPOSURE]), Controls(exposure=0.01))[0]
    assert not exposure.held
    assert exposure.sentence == "the camera still sets its exposure itself, now 0.025 s"


def test_a_control_that_is_not_there_is_said_where_it_was_asked_for_and_only_there():
    camera = Webcam(absent=[Knob.FOCUS, Knob.WHITE_BALANCE])
    settings = hold(camera, Controls(focus=10))
    assert [setting.knob for setting in settings] == [Knob.EXPOSURE, Knob.GAIN, Knob.FOCUS]
    assert settings[2].sentence == "the focus of the camera cannot be held"
    assert not settings[2].held


def test_rounding_to_the_steps_of_the_camera_is_held_and_a_coarse_one_is_not():
    fine, coarse = (
        hold(Webcam(steps={Knob.EXPOSURE: step}), Controls(exposure=0.00832))[0]
        for step in (1e-4, 0.01)
    )
    assert fine.held
    assert coarse.sentence == "exposure 0.00832 s was refused, it is 0.01 s"


def test_an_exposure_that_is_no_time_is_refused():
    with pytest.raises(ValueError, match="exposure must be positive, got -1 s"):
        Controls(exposure=-1)


@pytest.mark.parametrize("steps", [opencv.STEPS, v4l2.STEPS])
def test_uvc_counts_exposure_in_steps_of_100_microseconds(steps):
    kept = {"exposure": 333, "gain": 16}
    keys = {Knob.EXPOSURE: "exposure", Knob.GAIN: "gain"}
    panel = Panel(keys, {}, steps, kept.get, lambda key, value: not kept.update({key: value}))
    assert panel.read(Knob.EXPOSURE) == pytest.approx(0.0333)
    assert panel.write(Knob.EXPOSURE, 0.008)
    assert panel.write(Knob.GAIN, 20.0)
    assert kept == pytest.approx({"exposure": 80.0, "gain": 20.0})
    assert panel.read(Knob.FOCUS) is None
