"""Frames that are played like those of a camera: the case that is asked for, in order, in time."""

import multiprocessing
from itertools import islice

import numpy as np
import pytest

import fe
from rig.sources import twin_source
from rig.sources.script import STILL
from rig.studies.bench.soak import FASTER, Repeated
from rig.studies.start.played_frames import (
    ROUND,
    Played,
    in_place_of_the_twin,
    play,
    pressed,
)

RATE, SLOTS = 10.0, 6


@pytest.mark.parametrize(("case", "count"), [("calm", 0), ("touch", 1), ("two", 2), ("four", 4)])
def test_a_case_presses_with_as_many_fingers_and_repeats(case, count):
    script = pressed(case, (254.0, 200.0))
    counts = [len(script(STILL + age)) for age in np.arange(0.0, ROUND, 0.1)]
    assert set(counts) == {0, count}
    assert script(STILL - 0.1) == ()
    for age in (1.3, 2.9, 5.1):
        early, late = script(STILL + age), script(STILL + age + ROUND)
        for one, again in zip(early, late, strict=True):
            assert (one.x, one.y, one.force) == pytest.approx((again.x, again.y, again.force))


def test_the_process_of_the_twin_is_given_the_case(tmp_path):
    before = twin_source.deliver
    with in_place_of_the_twin("four", tmp_path / "late.txt"):
        assert twin_source.deliver.args == ("four", tmp_path / "late.txt")
    assert twin_source.deliver is before


class Clock:
    """Time that passes by sleeping, and by what is added."""

    def __init__(self):
        self.now = 100.0

    def __call__(self):
        return self.now

    def sleep(self, seconds):
        self.now += seconds


@pytest.fixture
def played():
    """Frames whose grey level is their number, from 100 on after the script has begun."""
    touch = (fe.Touch(1.0, 2.0, 3.0),)
    still = np.arange(4, dtype=np.uint8)[:, None, None] * np.ones((4, 2, 3), np.uint8)
    images = (100 + np.arange(3, dtype=np.uint8))[:, None, None] * np.ones((3, 2, 3), np.uint8)
    return Played(RATE, still, images, (touch, (), touch))


def test_frames_come_in_order_and_on_time_and_late_ones_are_counted(played):
    here, there = multiprocessing.Pipe()
    clock, numbers = Clock(), np.full(SLOTS, -1)
    images = np.zeros((SLOTS, 2, 3), np.uint8)
    here.send(None)  # the loop listens
    begun = round(STILL * RATE) + 1
    here.send(None)  # and its script may begin, with frame 1
    given = []

    def stalled(seconds):
        clock.sleep(seconds)
        if len(given) == 15:
            clock.now += 2.5 / RATE  # the player has to wait for a processor
        while here.poll():
            message = here.recv()
            if message is not None:
                given.append((message, images[message[0] % SLOTS, 0, 0]))

    late = play(played, images, numbers, there, clock, stalled)
    assert len(list(islice(late, 2))) == 2  # two came late by more than a frame
    there.close()
    numbers_given = [message[0] for message, _ in given]
    assert numbers_given == list(range(len(given)))
    first = [message[1] for message, _ in given[:10]]
    np.testing.assert_allclose(np.diff(first), 1 / RATE)
    levels = [level for _, level in given]
    assert set(levels[:begun]) <= {0, 1, 2, 3}
    assert levels[begun : begun + 3] == [100, 101, 102]
    assert [len(message[2]) for message, _ in given[begun : begun + 3]] == [1, 0, 1]


def test_a_link_that_is_full_before_the_script_begins_makes_no_frame_late(played):
    class Full:
        """A link whose loop takes nothing for a minute, while it gets ready."""

        def __init__(self, clock):
            self.clock, self.given, self.asked = clock, [], [None]

        def poll(self):
            if len(self.given) == 20:
                self.asked = [None]
            return bool(self.asked)

        def recv(self):
            return self.asked.pop()

        def send(self, message):
            if len(self.given) == 10:
                self.clock.now += 60.0
            if message is not None:
                self.given.append(message)
            if len(self.given) > 200:
                raise EOFError

    clock = Clock()
    link, numbers = Full(clock), np.full(SLOTS, -1)
    images = np.zeros((SLOTS, 2, 3), np.uint8)
    late = []
    with pytest.raises(EOFError):
        late.extend(play(played, images, numbers, link, clock, clock.sleep))
    assert late == []
    np.testing.assert_allclose(np.diff([message[1] for message in link.given[12:]]), 1 / RATE)


def test_a_recording_is_played_over_and_over_faster_and_its_numbers_go_on(monkeypatch):
    class Session:
        frames, path = 3, "a.h5"

        def columns(self):
            return {"frames/captured": np.array([5.0, 5.1, 5.2])}

        def row(self, index):
            return index

    clock, waits = Clock(), []
    from rig.recording import playback
    from rig.system.frame import Frame

    monkeypatch.setattr(playback.time, "monotonic", clock)
    monkeypatch.setattr(playback.time, "sleep", lambda s: (waits.append(s), clock.sleep(s)))
    monkeypatch.setattr(playback, "frame", lambda row: Frame(row, 0.0, np.full((2, 3), row)))
    source = Repeated(Session())
    frames = [source.grab(1.0) for _ in range(7)]
    assert [frame.sequence for frame in frames] == list(range(1, 8))
    assert [int(frame.image[0, 0]) for frame in frames] == [0, 1, 2, 0, 1, 2, 0]
    np.testing.assert_allclose([wait for wait in waits if wait], 0.1 / FASTER)
