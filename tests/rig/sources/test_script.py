"""Scripts: what presses the twin's plate is a pure function of time."""

import numpy as np
import pytest
from hypothesis import given, strategies as st

from rig.sources import script
from rig.sources.script import RAMP, STILL, TOUR_LENGTH, ScriptedPress

SIZE = (254.0, 203.0)
SCRIPTS = {
    "tour": script.tour(SIZE),
    "random": script.random_touches(SIZE, (0.5, 4.0), seed=3, rate=30.0),
    "empty": script.empty,
    "presses": script.pressing(SIZE, script.presses(SIZE, (0.5, 4.0), seed=5)),
}
every_script = pytest.mark.parametrize("touches", SCRIPTS.values(), ids=SCRIPTS)
seconds = st.floats(0.0, 100.0)


@every_script
@given(time=st.floats(0.0, STILL, exclude_max=True))
def test_nothing_touches_in_the_first_second(touches, time):
    assert script.at_rest(time)
    assert touches(time) == ()


@every_script
@given(times=st.lists(seconds, min_size=2, max_size=5))
def test_touches_follow_from_the_time_alone(touches, times):
    forwards = [touches(time) for time in times]
    backwards = [touches(time) for time in reversed(times)]
    assert forwards == backwards[::-1]


@every_script
@given(time=seconds)
def test_every_touch_is_on_the_plate_and_presses_with_a_finger_s_force(touches, time):
    for touch in touches(time):
        assert 0 < touch.x < SIZE[0]
        assert 0 < touch.y < SIZE[1]
        assert 0 < touch.force <= 4.0


@given(time=st.floats(0.0, 50.0), step=st.floats(0.0, 0.01))
def test_a_finger_of_the_tour_neither_jumps_nor_hits(time, step):
    def total(time):
        return sum(touch.force for touch in SCRIPTS["tour"](time))

    steepest = 2 * (4.0 / RAMP + 4.0)  # N/s of two fingers: ramp, and steady change on top
    assert abs(total(time + step) - total(time)) <= steepest * step + 1e-9


def test_the_tour_presses_moves_takes_two_fingers_and_begins_again():
    tour = SCRIPTS["tour"]
    times = np.arange(0.0, TOUR_LENGTH, 0.05)
    assert {len(tour(time)) for time in times} == {0, 1, 2}
    assert len({touch.x for time in times for touch in tour(time)}) > 100
    for time in times:
        np.testing.assert_allclose(
            _numbers(tour(time + TOUR_LENGTH)), _numbers(tour(time)), atol=1e-6
        )


def _numbers(touches):
    return [(touch.x, touch.y, touch.force) for touch in touches]


def test_a_press_reaches_its_force_after_the_ramp_and_follows_its_path():
    press = ScriptedPress(2.0, 4.0, ((0.2, 0.2), (0.8, 0.2), (0.8, 0.6)), (1.0, 3.0))
    assert press.at(2.0, SIZE) is None
    assert press.at(6.0, SIZE) is None
    middle = press.at(4.0, SIZE)
    assert middle is not None
    assert (middle.x, middle.y) == pytest.approx((0.8 * SIZE[0], 0.2 * SIZE[1]))
    assert middle.force == pytest.approx(2.0)
    landing = press.at(2.0 + RAMP / 2, SIZE)
    assert landing is not None
    assert landing.force == pytest.approx(0.5 * (1.0 + 2.0 * RAMP / 2 / 4.0))


def test_random_touches_are_new_in_every_frame_and_keep_from_the_edges():
    drawn = [SCRIPTS["random"](sequence / 30) for sequence in range(30, 330)]
    places = np.array([(touch.x, touch.y) for (touch,) in drawn])
    forces = np.array([touch.force for (touch,) in drawn])
    assert len(np.unique(places, axis=0)) == 300
    assert (places >= 25).all()
    assert (places <= np.array(SIZE) - 25).all()
    assert forces.min() == pytest.approx(0.5, abs=0.1)
    assert forces.max() == pytest.approx(4.0, abs=0.1)


def test_random_touches_fit_on_a_plate_smaller_than_the_inset():
    touches = script.random_touches((40.0, 20.0), (1.0, 1.0), seed=0, rate=30.0)
    places = np.array([(touch.x, touch.y) for k in range(30, 130) for touch in touches(k / 30)])
    assert (places >= (10.0, 5.0)).all()
    assert (places <= (30.0, 15.0)).all()


def test_presses_rest_where_they_are_one_after_the_other_and_begin_again():
    presses = script.presses(SIZE, (0.5, 4.0), seed=5)
    pressing = script.pressing(SIZE, presses)
    length = script.PLACES * (script.HELD + script.LIFTED)
    for number, press in enumerate(presses):
        middle = press.start + script.HELD / 2
        (touch,) = pressing(middle)
        assert (touch.x, touch.y) == pytest.approx(np.multiply(press.path[0], SIZE))
        assert touch.force == pytest.approx(press.force[0])
        assert pressing(middle + length) == pressing(middle)
        assert pressing(press.start - 0.5) == ()
        assert number == 0 or press.start - presses[number - 1].start == pytest.approx(
            script.HELD + script.LIFTED
        )
    assert script.pressing(SIZE, ())(3.0) == ()
