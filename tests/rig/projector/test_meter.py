"""The interference meter: what becomes of it when its work fails."""

from types import SimpleNamespace

import numpy as np

from rig.projector import meter as module
from rig.projector.meter import PAUSE, Meter
from tests.waiting import wait_for


def test_a_meter_that_breaks_is_said_and_ends_no_run(monkeypatch, caplog):
    def broken(*_):
        raise TypeError("no number")

    monkeypatch.setattr(module, "prepare_light_map", broken)
    image, T = np.zeros((30, 40), np.uint8), np.eye(3)

    def shot(second):
        return SimpleNamespace(
            captured=second * PAUSE, fresh=True, touches=(1,), image=image, T_px_plate=T
        )

    with Meter(None) as meter:
        meter.measure(shot(1), None, None)
        wait_for(lambda: meter.measure(shot(1), None, None) or meter.sentence)
        meter.measure(shot(3), None, None)
    assert meter.sentence == (
        "the projector's light is no longer measured: unexpected TypeError: no number"
    )
    assert caplog.text.count("the interference meter failed") == 1
