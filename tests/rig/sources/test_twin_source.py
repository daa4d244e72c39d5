"""The twin as a camera: newest frame first, lost ones counted, and nothing left behind."""

import multiprocessing
import os
import signal
import subprocess
import sys
import threading
import time
from contextlib import ExitStack
from dataclasses import replace
from multiprocessing.shared_memory import SharedMemory
from pathlib import Path

import numpy as np
import pytest

from rig.live.bench import build_bench
from rig.live.loop import Loop
from rig.sources import twin_source
from rig.sources.script import STILL
from rig.sources.twin import build_twin
from rig.sources.twin_source import SLOTS, TwinSource, _play, _views, open_twin

PATIENCE = 30.0  # s


def child():
    """Return the process of the twin that this process has started."""
    (process,) = (p for p in multiprocessing.active_children() if p.name == "touchplate-twin")
    return process


def drain(source):
    """Grab until the source raises."""
    while True:
        source.grab(PATIENCE)


@pytest.fixture
def ring():
    """Source whose twin is the test: the far end of its link, images and numbers."""
    here, there = multiprocessing.Pipe()
    images = np.zeros((SLOTS, 3, 4), np.uint8)
    numbers = np.full(SLOTS, -1)
    source = TwinSource(here, images, numbers)
    there.send(None)  # ready

    def deliver(sequence):
        images[sequence % SLOTS] = sequence
        numbers[sequence % SLOTS] = sequence
        there.send((sequence, 0.5 * sequence, ()))

    with here, there:
        yield source, there, deliver, numbers


def test_the_time_of_the_twin_begins_with_the_first_grab(ring):
    source, there, deliver, _ = ring
    assert not there.poll()
    assert source.grab(0.0) is None
    assert there.recv() is None
    deliver(0)
    frame = source.grab(1.0)
    assert (frame.sequence, frame.captured, frame.truth) == (0, 0.0, ())


def test_the_newest_frame_wins(ring):
    source, _, deliver, _ = ring
    for sequence in (0, 1, 2, 5):
        deliver(sequence)
    frame = source.grab(1.0)
    assert frame.sequence == 5
    np.testing.assert_array_equal(frame.image, np.full((3, 4), 5))
    assert source.grab(0.0) is None


def test_a_frame_is_a_copy_that_the_next_one_leaves_alone(ring):
    source, _, deliver, _ = ring
    deliver(1)
    first = source.grab(1.0)
    deliver(1 + SLOTS)
    source.grab(1.0)
    assert (first.image == 1).all()


@pytest.mark.parametrize("number", [-1, 1 + SLOTS])
def test_a_frame_that_is_being_overwritten_is_left_for_the_next(ring, number):
    source, _, deliver, numbers = ring
    deliver(1)
    numbers[1] = number
    assert source.grab(0.0) is None
    deliver(1)
    numbers[1] = number
    deliver(2)
    assert source.grab(1.0).sequence == 2


def test_frames_from_before_the_script_are_over_when_it_begins(ring):
    source, there, deliver, _ = ring
    deliver(0)
    assert source.grab(1.0).sequence == 0
    deliver(1)
    deliver(2)
    there.send(None)  # heard
    deliver(40)
    source.begin()
    assert [there.recv() for _ in range(2)] == [None, None]  # of the first grab and of the begin
    assert source.grab(1.0).sequence == 40


def test_a_base_bends_when_the_flat_plate_was_taken(ring):
    source, there, deliver, _ = ring
    there.send(None)  # heard
    deliver(7)
    source.bend()
    assert [there.recv() for _ in range(2)] == [None, "bend"]
    assert source.grab(1.0).sequence == 7


def test_a_twin_that_has_ended_is_reported_by_the_grab_and_not_by_the_begin(ring):
    source, there, _, _ = ring
    there.close()
    source.begin()
    with pytest.raises(OSError, match="the twin's process has ended"):
        drain(source)


def test_a_sentence_from_the_twin_is_raised(ring):
    source, there, _, _ = ring
    there.send("the pattern is too coarse; draw a finer one")
    with pytest.raises(OSError, match=r"^the pattern is too coarse; draw a finer one$"):
        source.grab(1.0)


def test_a_twin_that_is_never_ready_is_given_up(ring, monkeypatch):
    source, _, _, _ = ring
    source._link.recv()
    monkeypatch.setattr(twin_source, "START_LIMIT", 0.01)
    with pytest.raises(OSError, match=r"was not ready within 0\.01 s"):
        source.grab(0.0)


def test_frames_are_those_of_the_twin_in_order_and_at_its_rate(small):
    scene = small({"source.script": "random", "camera.rate": 40})
    twin = build_twin(scene)
    with open_twin(scene) as source:
        frames = [source.grab(PATIENCE) for _ in range(5)]
        source.begin()
        time.sleep(1.2)  # frames are lost meanwhile
        frames += [source.grab(PATIENCE) for _ in range(5)]
    sequences = [frame.sequence for frame in frames]
    assert sequences[0] < 5
    assert (np.diff(sequences) >= 1).all()
    assert sequences[5] - sequences[4] > 20
    assert frames[0].truth == ()
    assert len(frames[-1].truth) == 1
    for frame in (frames[0], frames[-1]):
        np.testing.assert_array_equal(frame.image, twin.frame(frame.sequence, frame.truth))
    begun = np.array([frame.captured - frame.sequence / 40 for frame in frames])
    assert np.ptp(begun) < 0.5  # s; a frame comes when it is due, however many were lost


def test_the_twin_ends_with_its_context(small, ended, shared_memory):
    with open_twin(small()) as source:
        source.grab(PATIENCE)
        process = child()
        memory = shared_memory(process.pid)
        assert memory
    assert not ended([process.pid])
    assert not [name for name in memory if Path(name).exists()]
    with pytest.raises(OSError, match="closed"):
        source.grab(0.0)


def test_the_twin_ends_while_it_is_still_getting_ready(small, ended):
    with open_twin(small()):
        pid = child().pid
    assert not ended([pid])


def test_a_twin_that_is_killed_is_one_sentence(small):
    with open_twin(small()) as source:
        source.grab(PATIENCE)
        child().kill()
        with pytest.raises(OSError, match="the twin's process has ended; start the run again"):
            drain(source)


@pytest.mark.parametrize("grabs", [0, 3])
def test_the_twin_ends_when_its_loop_is_killed(small, small_settings, ended, shared_memory, grabs):
    code = f"""
import multiprocessing, rig, time
from rig.sources.twin_source import open_twin
settings = [text.removeprefix("--set=") for text in {small_settings!r}]
with open_twin(rig.load("twin", rig.scene.parse_overrides(settings))) as source:
    for _ in range({grabs}):
        source.grab({PATIENCE})
    print(multiprocessing.active_children()[0].pid, flush=True)
    time.sleep({PATIENCE})
"""
    loop = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True)
    with loop:
        pid = int(loop.stdout.readline())
        memory = shared_memory(loop.pid)
        os.kill(loop.pid, signal.SIGKILL)
    assert not ended([pid], limit=20.0)
    assert memory
    end = time.monotonic() + 10.0
    while [name for name in memory if Path(name).exists()] and time.monotonic() < end:
        time.sleep(0.02)
    assert not [name for name in memory if Path(name).exists()]


def test_a_damaged_pattern_in_the_cache_is_drawn_again(small, tmp_path, monkeypatch):
    scene = small()
    monkeypatch.setenv("TOUCHPLATE_CACHE", str(tmp_path))
    build_twin(scene)
    (stored,) = (tmp_path / "sharp-pattern").iterdir()
    whole = stored.read_bytes()
    stored.write_bytes(whole[:5000])
    with open_twin(scene) as source:
        assert source.grab(PATIENCE)
    assert stored.read_bytes() == whole


class Hurried:
    """A clock that goes on by so many seconds whenever it is looked at, twice a frame."""

    def __init__(self, seconds):
        self.now, self._seconds = 0.0, seconds

    def __call__(self):
        self.now += self._seconds
        return self.now


@pytest.fixture
def hurried():
    """Give the twin of a scene, in a thread, that takes so many seconds a frame by its clock."""
    with ExitStack() as opened:

        def start(scene, seconds):
            twin = build_twin(scene)
            width, height = twin.warper.camera.size
            memory = SharedMemory(create=True, size=SLOTS * (width * height + 8))
            opened.callback(memory.unlink)
            here, there = multiprocessing.Pipe()
            clock = Hurried(seconds / 2)

            def play():
                with pytest.raises((ConnectionError, EOFError)):
                    _play(twin, memory, there, clock, lambda seconds: None)

            thread = threading.Thread(target=play)
            thread.start()
            opened.callback(thread.join)
            opened.callback(here.close)
            return TwinSource(here, *_views(memory, (height, width)))

        yield start


FEW = {"source.script": "random", "touches.force": [2.0, 4.0]}


@pytest.mark.parametrize("series", [1, 3])
@pytest.mark.parametrize("seconds", [0.5, 3.0])
def test_however_slow_it_is_the_reference_is_untouched_and_then_touches_come(
    small, hurried, monkeypatch, seconds, series
):
    moved = iter([True] * (series - 1) + [False])
    monkeypatch.setattr("rig.live.first_frames.moved_during_reference", lambda images: next(moved))
    scene = small(FEW)
    source = hurried(scene, seconds)
    loop = Loop(build_bench(scene, lambda done, total: None), source)
    loop.get_ready()
    assert not source.grab(PATIENCE).truth  # it waits still
    source.begin()
    shots = iter(loop)
    while not (shot := next(shots)).truth:
        pass
    (mark,) = shot.touches
    assert shot.position_error < 5 * mark.sigma[0]


def test_a_script_begins_at_its_beginning(small, hurried):
    scene = small(FEW)
    source, twin = hurried(scene, 0.001), build_twin(scene)
    still = [source.grab(PATIENCE) for _ in range(40)]
    source.begin()
    while not (frame := source.grab(PATIENCE)).truth:
        pass
    assert not any(frame.truth for frame in still)
    assert still[-1].sequence > STILL * twin.rate
    begun = [k for k in range(60) if twin.touches(k) == frame.truth]
    assert begun
    assert replace(twin, rest=frame.sequence - begun[0]).touches(frame.sequence) == frame.truth


@pytest.mark.parametrize("changes", [{"dic.reference_frames": 31}, {"camera.rate": 2}])
def test_a_reference_may_take_longer_than_a_script_is_at_rest(small, hurried, changes):
    scene = small(FEW | changes)
    loop = Loop(build_bench(scene, lambda done, total: None), hurried(scene, 0.01))
    loop.get_ready()


def test_a_scene_without_a_source_is_refused_before_the_start(small):
    scene = small().model_copy(update={"source": None})
    with pytest.raises(ValueError, match=r"has no source of frames; add \[source\]"):
        open_twin(scene).__enter__()
