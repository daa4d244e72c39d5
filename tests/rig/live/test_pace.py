"""The count of a loop's frames: dropped ones, those out of order, and the rate of the source."""

import pytest

from rig.live.pace import Pace


def begun(frames, rate=None):
    pace = Pace(rate)
    for sequence, captured in frames:
        pace.begin(sequence, captured)
    return pace


def warned(pace):
    return [sign.name for sign in pace.signs if sign.warns]


def test_frames_out_of_order_are_counted_and_said_and_none_is_dropped():
    pace = begun([(number, 0.1 * number) for number in (1, 2, 4, 3, 5)])
    assert (pace.dropped, pace.out_of_order) == (0, 1)
    assert warned(pace) == ["out of order"]


def test_frames_that_never_come_are_dropped_and_one_that_comes_twice_is_none_of_them():
    pace = begun([(number, 0.1 * number) for number in (7, 10, 10, 11)])
    assert (pace.dropped, pace.out_of_order) == (2, 1)


def test_a_source_that_counts_from_its_start_again_drops_nothing():
    pace = begun([(5, 0.5), (0, 0.6), (1, 0.7), (2, 0.8)])
    assert (pace.dropped, pace.out_of_order) == (0, 3)


@pytest.mark.parametrize(
    ("real", "said"), [(30.0, []), (25.0, []), (20.0, ["camera rate"]), (60.0, ["camera rate"])]
)
def test_a_rate_that_is_not_that_of_the_scene_is_said(real, said):
    pace = begun([(number, number / real) for number in range(40)], rate=30.0)
    assert pace.source_rate == pytest.approx(real)
    assert warned(pace) == said


def test_frames_that_the_loop_leaves_out_are_no_lower_rate():
    assert not warned(begun([(number, number / 30.0) for number in range(0, 80, 4)], rate=30.0))


def test_a_rate_is_not_judged_by_a_few_frames():
    assert begun([(0, 0.0), (1, 1.0)], rate=30.0).signs == ()
