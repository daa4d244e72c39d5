"""A finger that writes: where it presses, where it is lifted, and what it cannot write."""

from itertools import pairwise

import numpy as np
import pytest

from rig.sources.letters import PACE, STROKES, letters, strokes

SIZE = (200.0, 120.0)


@pytest.mark.parametrize("letter", sorted(STROKES))
def test_every_letter_stays_on_the_plate(letter):
    for press in strokes(SIZE, letter, 2.0, 0.0):
        path = np.array(press.path)
        assert path.min() > 0.1
        assert path.max() < 0.9


def test_letters_follow_each_other_from_left_to_right():
    """Three strokes of one vertical bar each: I I I."""
    presses = strokes(SIZE, "III", 2.0, 1.0)
    x = [press.path[0][0] for press in presses]
    assert len(presses) == 3
    assert x == sorted(x)
    assert presses[0].start == 1.0
    gaps = [b.start - a.start - a.duration for a, b in pairwise(presses)]
    np.testing.assert_allclose(gaps, 0.25)


def test_the_finger_presses_with_one_force_and_at_one_pace():
    write, (press,) = letters(SIZE, "i", 2.0, 1.0), strokes(SIZE, "I", 2.0, 1.0)
    times = np.arange(1.4, 1.0 + press.duration - 0.4, 0.01)
    touches = [write(time) for time in times]
    assert all(len(each) == 1 for each in touches)
    np.testing.assert_allclose([each[0].force for each in touches], 2.0)
    steps = -np.diff([each[0].y for each in touches]) / 0.01
    np.testing.assert_allclose(np.median(steps), PACE * SIZE[0], rtol=0.02)
    assert write(0.9) == write(1.0 + press.duration + 0.1) == ()


@pytest.mark.parametrize(("text", "sentence"), [("A1", "has '1'"), (" ", "is empty")])
def test_a_text_that_cannot_be_written_is_refused(text, sentence):
    with pytest.raises(ValueError, match=f"{sentence}; a finger writes letters A to Z"):
        letters(SIZE, text, 2.0, 0.0)
