"""Touches through the real Lab Streaming Layer: an outlet, and an inlet that finds it."""

import time
from math import isnan

import pylsl
import pytest

from rig.live.gestures import Gesture
from rig.live.snapshot import Mark
from rig.out.lsl import FIELDS, LslOutlet, sample
from tests.rig.page.conftest import draw_snapshot

HARD = Mark(120.0, 80.0, 2.25, (1.5, 0.5, 0.25), 0.125, 7)
SOFT = Mark(30.0, 40.0, 1.0)


def test_the_hardest_touches_come_first_and_the_rest_is_no_number():
    assert sample([SOFT, HARD], 1) == [7.0, 120.0, 80.0, 2.25, 1.5, 0.5, 0.125]
    values = sample([SOFT, HARD], 3)
    assert values[:7] == sample([HARD], 1)
    assert isnan(values[7])  # it is not tracked
    assert values[8:11] == [30.0, 40.0, 1.0]
    assert all(map(isnan, values[14:]))


def test_an_inlet_finds_the_stream_its_channels_and_the_capture_time():
    outlet = LslOutlet(2, "touchplate-test")
    (info,) = pylsl.resolve_byprop("name", "touchplate-test", timeout=10)
    inlet = pylsl.StreamInlet(info)
    labels = inlet.info().get_channel_labels()
    assert labels[:3] == ["id_1", "x_1", "y_1"]
    assert len(labels) == 2 * len(FIELDS)
    inlet.open_stream(timeout=10)
    # Both clocks are read before and after, so that nothing depends on how long the call takes.
    early, between, late = time.monotonic(), pylsl.local_clock(), time.monotonic()
    captured = early - 3600.0
    outlet(draw_snapshot(1, captured=captured, touches=(HARD,)))
    took = time.monotonic() - late
    values, stamp = inlet.pull_sample(timeout=10)
    assert values[:4] == [7.0, 120.0, 80.0, 2.25]
    assert all(map(isnan, values[7:]))
    assert captured + between - late <= stamp <= captured + between - early + took


def test_each_gesture_is_one_marker_at_its_time():
    outlet = LslOutlet(1, "touchplate-markers")
    (info,) = pylsl.resolve_byprop("name", "touchplate-markers-gestures", timeout=10)
    assert (info.type(), info.channel_count(), info.nominal_srate()) == ("Markers", 1, 0.0)
    inlet = pylsl.StreamInlet(info)
    inlet.open_stream(timeout=10)
    touches = pylsl.StreamInlet(pylsl.resolve_byprop("name", "touchplate-markers", timeout=10)[0])
    touches.open_stream(timeout=10)
    now = time.monotonic()
    tap = Gesture("tap", now - 0.25, 10.0, 20.0, 1.5, 0.0, (3,))
    press = Gesture("hard press", now, 10.0, 20.0, 3.5, 0.0, (4,))
    for gestures in ((tap,), (tap,), (tap, press), ()):
        outlet(draw_snapshot(1, captured=now, touches=(HARD,), gestures=gestures))
    kinds, stamps = zip(*(inlet.pull_sample(timeout=10) for _ in range(2)), strict=True)
    assert kinds == (["tap"], ["hard press"])
    assert inlet.pull_sample(timeout=0.0) == (None, None)
    _, frame = touches.pull_sample(timeout=10)
    assert stamps[0] == pytest.approx(frame - 0.25, abs=0.01)


def test_room_for_no_touch_is_refused():
    with pytest.raises(ValueError, match="room for 1 touch or more, got 0"):
        LslOutlet(0)
