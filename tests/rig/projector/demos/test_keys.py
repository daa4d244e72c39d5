"""Keys: which lies where, when a note sounds and ends, and how loud."""

import itertools
from math import exp, log

import numpy as np
import pytest
from hypothesis import given, strategies as st

from rig.live.snapshot import Mark
from rig.live.tracks import ABSENT
from rig.projector.content import draw
from rig.projector.demos.keyboard import lay_keys
from rig.projector.demos.keys import begin_keys
from rig.projector.demos.moment import Moment
from rig.projector.demos.notes import HARD, SOFT, Playing, velocity_of

RATE = 30.0
SIZE = (240.0, 150.0)
KEYS = lay_keys(SIZE)


def middle(pitch):
    key = next(key for key in KEYS.keys if key.pitch == pitch)
    return (key.low[0] + key.high[0]) / 2, key.low[1] + 0.2 * (key.high[1] - key.low[1])


def play(frames, playing=None, begun=1.0, rate=RATE):
    """Play marks frame by frame; gives (time, pitch, velocity) of all notes, and what sounds."""
    playing = playing or Playing(KEYS, begun - 1 / rate)
    notes = []
    for number, marks in enumerate(frames):
        time = begun + number / rate
        playing, now = playing.after(marks, time)
        notes += [(round(time, 6), *note) for note in now]
    return notes, playing


def press(pitch, forces, identity=1):
    return [(Mark(*middle(pitch), force, identity=identity),) for force in forces]


def test_keys_are_those_of_a_piano_as_wide_as_one_and_do_not_overlap():
    whites = [key for key in KEYS.keys if not key.black]
    assert [key.pitch for key in whites] == [60, 62, 64, 65, 67, 69, 71, 72]
    assert [key.pitch for key in KEYS.keys if key.black] == [61, 63, 66, 68, 70]
    assert whites[0].high[0] - whites[0].low[0] == pytest.approx(23.5, rel=0.1)
    for left, right in itertools.pairwise(whites):
        assert left.high[0] == pytest.approx(right.low[0])
    assert KEYS.pitch_at(*middle(64)) == 64
    sharp = next(key for key in KEYS.keys if key.pitch == 66)
    assert KEYS.pitch_at(sharp.low[0] + 1, sharp.high[1] - 1) == 66
    assert KEYS.pitch_at(sharp.low[0] + 1, sharp.low[1] - 1) == 65
    assert KEYS.pitch_at(1.0, 1.0) is None


@given(a=st.floats(60, 900), b=st.floats(60, 900))
def test_keys_lie_within_every_plate(a, b):
    for key in lay_keys((a, b)).keys:
        assert 0 < key.low[0] < key.high[0] < a
        assert 0 < key.low[1] < key.high[1] < b


@pytest.mark.parametrize("rise", [1.0, 2.0, 7.0, 14.2, 50.0, 100.0, 300.0])
def test_velocity_is_even_in_the_logarithm_of_the_rise(rise):
    expected = 127 * (log(rise) - log(SOFT)) / (log(HARD) - log(SOFT))
    assert velocity_of(rise) == pytest.approx(np.clip(expected, 1, 127), abs=0.5)


@pytest.mark.parametrize("rise", [5.0, 20.0, 60.0])
@pytest.mark.parametrize("phase", [0.05, 0.5, 0.95])
def test_a_force_that_rises_evenly_sounds_at_its_rise_wherever_the_frames_fall(rise, phase):
    """The ramp ends after the second frame; its first frame shows a part of a frame's rise."""
    forces = [rise * (number + phase) / RATE for number in range(3)]
    notes, _ = play(press(64, forces))
    ((time, pitch, velocity),) = notes
    assert (time, pitch) == (round(1.0 + 1 / RATE, 6), 64)
    assert velocity == velocity_of(rise)


def test_velocity_orders_strikes_and_is_the_same_at_twice_the_frame_rate():
    def struck(rise, rate):
        forces = [min(rise * (number + 0.5) / rate, 4.0) for number in range(8)]
        ((_, _, velocity),), _ = play(press(60, forces), Playing(KEYS, 1 - 1 / rate), rate=rate)
        return velocity

    for rate in (30.0, 60.0):
        velocities = [struck(rise, rate) for rise in (4, 10, 25, 50)]
        assert velocities == sorted(set(velocities))
    assert struck(25, 30.0) == pytest.approx(struck(25, 60.0), abs=2)


def test_a_note_ends_when_its_finger_lets_go_or_has_left():
    notes, playing = play(press(67, [1.0, 2.0, 2.0, 0.2]))
    assert [note[1:] for note in notes] == [(67, notes[0][2]), (67, 0)]
    assert notes[1][0] == round(1.0 + 3 / RATE, 6)
    notes, playing = play([*press(67, [1.0, 2.0, 2.0]), *[()] * 8])
    _, off = notes
    assert off[1:] == (67, 0)
    assert ABSENT < off[0] - (1.0 + 2 / RATE) <= ABSENT + 1.01 / RATE
    assert playing.lit() == {}


def test_a_touch_of_one_frame_sounds_and_ends():
    notes, _ = play([*press(62, [1.0]), *[()] * 8])
    assert [note[1] for note in notes] == [62, 62]
    assert notes[0][2] == velocity_of(30.0)
    assert notes[1][2] == 0


def test_one_lost_frame_and_a_slide_sound_no_other_note():
    frames = [*press(64, [1, 2, 2]), (), *press(64, [2, 2]), *press(65, [2, 2])]
    notes, playing = play(frames)
    assert len(notes) == 1
    assert playing.lit().keys() == {64}


def test_a_finger_that_lands_on_another_key_with_the_same_identity_sounds_it():
    frames = [*press(64, [1, 2, 1]), (), *press(65, [1, 2]), *press(65, [2])]
    notes, playing = play(frames)
    assert [(pitch, velocity > 0) for _, pitch, velocity in notes] == [
        (64, True), (64, False), (65, True),
    ]  # fmt: skip
    assert playing.lit().keys() == {65}


def test_a_key_that_is_struck_again_sounds_again():
    frames = [*press(64, [1, 2, 1]), (), (), *press(64, [1, 2, 2])]
    assert [velocity > 0 for *_, velocity in play(frames)[0]] == [True, False, True]


def test_what_lands_beside_the_keys_stays_silent_even_where_it_slides_onto_them():
    beside = [(Mark(2.0, 2.0, 2.0, identity=5),)] * 3
    on_keys = [(Mark(*middle(60), 2.0, identity=5),)] * 3
    assert play([*beside, *on_keys])[0] == []


@given(
    st.lists(
        st.dictionaries(
            st.integers(1, 3), st.tuples(st.floats(0, 240), st.floats(0, 150), st.floats(0, 5)),
            max_size=3,
        ),
        max_size=30,
    )
)  # fmt: skip
def test_every_note_that_sounds_ends_once(frames):
    marks = [
        tuple(Mark(*place, identity=name) for name, place in fingers.items()) for fingers in frames
    ]
    notes, playing = play([*marks, *[()] * 8])
    sounding: dict[int, int] = {}
    for _, pitch, velocity in notes:
        assert 0 <= velocity <= 127
        sounding[pitch] = sounding.get(pitch, 0) + (1 if velocity else -1)
        assert sounding[pitch] >= 0
    assert not any(sounding.values())
    assert playing.held == ()


def test_the_key_that_sounds_is_lit_as_far_up_as_it_is_loud(screen):
    keys = begin_keys(SIZE)
    resting = draw(keys, screen)
    rise = exp(0.5 * (log(SOFT) + log(HARD)))  # velocity 64
    for number in range(3):
        force = rise * (number + 0.5) / RATE
        mark = Mark(*middle(64), force, identity=1)
        keys = keys.after(Moment(1.0 + number / RATE, (mark,)))
    changed = np.abs(draw(keys, screen).astype(int) - resting).max(axis=2)
    rows, columns = np.nonzero(changed > 40)
    key = next(key for key in KEYS.keys if key.pitch == 64)
    assert columns.min() == pytest.approx(key.low[0], abs=2)
    assert columns.max() == pytest.approx(key.high[0], abs=2)
    top = key.low[1] + 64 / 127 * (key.high[1] - key.low[1])
    assert 150 - rows.min() == pytest.approx(top, abs=2.5)
    assert 150 - rows.max() == pytest.approx(key.low[1], abs=2)
