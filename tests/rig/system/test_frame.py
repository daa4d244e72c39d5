"""Which of the frames that wait comes next."""

from collections import deque

import numpy as np
from hypothesis import given, strategies as st

from rig.system.frame import HELD, Frame, take_next

BLACK = np.zeros((2, 3), np.uint8)


def waiting(*captured):
    return deque(Frame(number, time, BLACK) for number, time in enumerate(captured))


def test_a_loop_that_was_held_up_for_a_moment_takes_one_after_the_other():
    frames = waiting(0.0, 0.03, 0.06)
    assert [take_next(frames, 0.06 + 0.005 * k).sequence for k in range(3)] == [0, 1, 2]
    assert not frames


def test_a_loop_that_does_not_keep_up_goes_on_with_the_newest():
    frames = waiting(0.0, 0.03, 0.06)
    assert take_next(frames, HELD + 0.001).sequence == 2
    assert not frames


@given(st.lists(st.floats(0, 1), min_size=1, max_size=8), st.floats(1, 2))
def test_what_is_taken_is_the_newest_or_younger_than_it_may_wait(times, now):
    frames = waiting(*sorted(times))
    newest = frames[-1].captured
    taken = take_next(frames, now)
    assert taken.captured == newest or now - taken.captured <= HELD
