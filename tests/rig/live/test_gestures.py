"""Gestures of scripted fingers: each once, of its kind, and none where nothing is done."""

import math
from dataclasses import replace

import numpy as np
import pytest

from rig.live.gestures import Gestures
from rig.live.loop import Loop
from rig.studies.gestures.hands import drawn, reported
from rig.studies.gestures.script import Score

RATE = 30.0


def played(*fingers, seconds=3.0):
    """Follow fingers, functions from time, s, to (x, y, force) or None; identities from 1."""
    gestures, found = Gestures(), []
    for number in range(round(seconds * RATE)):
        now = number / RATE
        places = ((name, finger(now)) for name, finger in enumerate(fingers, 1))
        found += gestures.follow([(name, *at, 0.1) for name, at in places if at], now)
    return found


def between(begin, end, at):
    return lambda now: at(now - begin) if begin <= now < end else None


def test_a_brief_touch_is_a_tap_with_its_force():
    (tap,) = played(between(0.5, 0.7, lambda age: (40.0, 50.0, 2.0)))
    assert (tap.kind, tap.x, tap.y, tap.value, tap.identities) == ("tap", 40.0, 50.0, 2.0, (1,))


def test_a_long_rest_is_a_hold_and_reported_once_while_it_lasts():
    (hold,) = played(between(0.5, 2.5, lambda age: (40.0, 50.0, 1.0)))
    assert hold.kind == "hold"
    assert 1.0 < hold.time < 1.3


def test_a_fast_stroke_is_a_swipe_with_its_speed_and_direction():
    (swipe,) = played(between(0.5, 0.8, lambda age: (40.0 + 160 * age, 50.0 + 120 * age, 1.0)))
    assert swipe.kind == "swipe"
    assert swipe.value == pytest.approx(200.0, rel=0.02)
    assert swipe.angle == pytest.approx(math.atan2(3, 4), abs=0.01)


@pytest.mark.parametrize("sign", [-1, 1])
def test_two_fingers_that_part_or_meet_are_a_pinch(sign):
    def finger(side):
        return between(0.5, 1.2, lambda age: (100 + side * (25 + sign * 20 * age), 80.0, 1.0))

    (pinch,) = played(finger(-1), finger(1))
    assert pinch.kind == "pinch"
    assert pinch.identities == (1, 2)
    assert (pinch.value > 1) == (sign > 0)


def test_two_fingers_that_turn_are_a_rotation_the_right_way_round():
    def finger(side):
        return between(
            0.5,
            1.3,
            lambda age: (100 + side * 20 * math.cos(age), 80 + side * 20 * math.sin(age), 1),
        )

    (turn,) = played(finger(-1), finger(1))
    assert turn.kind == "rotate"
    assert 0.3 <= turn.value < 0.4


def test_a_finger_that_presses_harder_is_a_hard_press():
    found = played(between(0.5, 2.5, lambda age: (40.0, 50.0, 1.0 if age < 1 else 2.5)))
    assert [gesture.kind for gesture in found] == ["hold", "hard press"]
    assert found[1].value == 2.5


def test_two_fingers_that_move_as_one_and_one_that_slides_slowly_make_nothing():
    def finger(x):
        return between(0.5, 1.7, lambda age: (x + 30 * age, 50.0, 1.0))

    assert played(finger(40.0), finger(70.0), finger(150.0)) == []


def test_a_tap_whose_identity_another_finger_takes_is_still_one_tap_each():
    gestures, found = Gestures(), []
    for number in range(40):
        touches = [(1, 40.0, 50.0, 1.0, 0.1)] if number < 4 else []
        touches += [(1, 95.0, 50.0, 1.0, 0.1)] if 6 <= number < 10 else []
        found += gestures.follow(touches, number / RATE)
    assert [(gesture.kind, gesture.x) for gesture in found] == [("tap", 40.0), ("tap", 95.0)]


@pytest.mark.parametrize("touch", [(1, math.nan, 50.0, 1.0, 0.1), (1, 40.0, 50.0, 1.0, 5.0)])
def test_a_place_that_is_hardly_known_makes_nothing(touch):
    gestures = Gestures()
    assert not any(gestures.follow([touch], number / RATE) for number in range(60))


@pytest.mark.slow
def test_ten_fingers_of_a_minute_are_read_right():
    made, score = drawn(60.0, 77), Score()
    score.add(made, reported(made, 60.0, 77))
    assert score.made.total() > 150
    assert score.right.total() >= 0.98 * score.made.total()
    assert score.invented == 0


class Paced:
    """A source whose frames bear the times of their numbers."""

    status = ""

    def __init__(self, source):
        self._source = source

    def grab(self, timeout):
        frame = self._source.grab(timeout)
        return replace(frame, captured=frame.sequence / RATE)


def test_the_loop_puts_the_gestures_of_the_last_second_into_its_snapshots(small, in_hand):
    from rig.live.bench import build_bench
    from rig.sources.twin import build_twin

    scene = small({"sensor.noise": 0.2})  # of a small camera, whose places are coarse otherwise
    bench = build_bench(scene, lambda done, total: None)
    source = Paced(in_hand(build_twin(scene), [*range(16), *range(44, 100)]))
    shots = list(Loop(bench, source))
    kinds = {gesture.kind for shot in shots for gesture in shot.gestures}
    assert kinds == {"hold"}  # the tour rests on the middle first
    assert np.all([len(shot.gestures) <= 2 for shot in shots])
