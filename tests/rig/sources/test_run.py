"""The loop as a program's iterator: frames of a scene, and nothing open once it has ended."""

import logging
import signal
import threading
from contextlib import contextmanager
from datetime import UTC, datetime, timedelta

import numpy as np
import pytest

import rig
from rig.calibration.store import LatencyEntry
from rig.projector import show as show_module
from rig.projector.content import Image
from rig.projector.display_log import DisplayLog
from rig.recording.session import open_session
from rig.sources import open_loop
from rig.sources.twin import build_twin

REFERENCE = range(16)


class Source:
    """Frames of the twin, and whether it was closed."""

    def __init__(self, source, at=None):
        self._source, self._at = source, at or {}
        self.status, self.grabs, self.closed = source.status, 0, False

    def grab(self, timeout):
        self.grabs += 1
        if act := self._at.get(self.grabs):
            act()
        return self._source.grab(timeout)


@pytest.fixture
def scene(small):
    return small({"touches.max_touches": 1})


@pytest.fixture
def opened(scene, in_hand, monkeypatch):
    """Give the twin without a process to every run: `opened(sequences)` is its source."""
    twin = build_twin(scene)

    def make(sequences, at=None):
        source = Source(in_hand(twin, [*REFERENCE, *sequences]), at)

        @contextmanager
        def open_input(scene, say, use_board):
            try:
                yield source, None
            finally:
                source.closed = True

        monkeypatch.setattr(open_loop, "open_input", open_input)
        return source

    return make


def test_frames_come_with_touches_and_the_end_of_the_source_ends_them(scene, opened):
    source = opened([20, 75, 76])
    frames = list(rig.run(scene))
    assert [frame.sequence for frame in frames] == [20, 75, 76]
    assert frames[0].time < frames[1].time < frames[2].time
    assert frames[0].touches == ()
    assert frames[0].status == "no touch"
    assert frames[0].image.shape == (320, 384)
    (touch,) = frames[2].touches
    assert touch.identity == 1
    assert abs(touch.x - 127.0) < 4 * touch.sigma_x
    assert abs(touch.y - 101.5) < 4 * touch.sigma_y
    assert abs(touch.force - 2.0) < 4 * touch.sigma_force
    assert source.closed


def test_nothing_is_opened_before_the_first_frame_is_asked_for(scene, opened):
    source = opened([20])
    run = rig.run(scene)
    assert source.grabs == 0
    with pytest.raises(ValueError, match="no figures before its first frame"):
        run.summary()
    next(run)
    assert run.summary()["frames"] == 1
    run.close()
    assert source.closed


def test_break_closes_what_was_open(scene, opened):
    source = opened([20, 21, 22])
    for _ in rig.run(scene):
        break
    assert source.closed


def test_an_error_in_the_loop_of_the_user_closes_what_was_open(scene, opened):
    source = opened([20, 21, 22])

    def body():
        for _ in rig.run(scene):
            raise RuntimeError

    with pytest.raises(RuntimeError):
        body()
    assert source.closed


def test_a_block_closes_what_was_open_and_figures_stay(scene, opened):
    source = opened([20, 21, 22])
    with rig.run(scene) as run:
        next(run)
        assert not source.closed
    assert source.closed
    assert run.summary()["frames"] == 1
    assert list(run) == []


def test_a_script_renews_the_reference_while_frames_go_on(scene, opened):
    opened(range(20, 60))
    run = rig.run(scene)
    with pytest.raises(ValueError, match="before its first frame"):
        run.tare()
    with run:
        assert next(run).notice == ""
        run.tare()
        assert "touch nothing" in next(run).notice


@pytest.mark.parametrize("grab", [3, 18])
def test_ctrl_c_while_a_frame_is_waited_for_closes_what_was_open(scene, opened, grab):
    handler = signal.getsignal(signal.SIGINT)
    source = opened([20, 21, 22], {grab: lambda: signal.raise_signal(signal.SIGINT)})
    with pytest.raises(KeyboardInterrupt):
        list(rig.run(scene))
    assert source.closed
    assert signal.getsignal(signal.SIGINT) is handler


def test_a_thread_runs_the_loop_as_well(scene, opened):
    source, frames = opened([20, 21]), []
    thread = threading.Thread(target=lambda: frames.extend(rig.run(scene)))
    thread.start()
    thread.join()
    assert len(frames) == 2
    assert source.closed


def test_a_recording_is_whole_once_the_run_has_ended(scene, opened, tmp_path):
    opened([20, 75, 76])
    known = rig.Calibration(
        latency=LatencyEntry(date=datetime.now(UTC), error=0.001, median=0.05, p95=0.06)
    )
    for frame in rig.run(scene, record=tmp_path / "session.h5", calibration=known):
        if frame.touches:
            break
    with open_session(tmp_path / "session.h5") as session:
        assert session.frames == 2
        assert session.scene == scene
        assert '"median":0.05' in session.calibration


def test_a_scene_by_its_file_has_the_calibration_beside_it(
    scene, opened, tmp_path, monkeypatch, caplog
):
    monkeypatch.chdir(tmp_path)
    old = datetime.now(UTC) - timedelta(days=60)
    part = LatencyEntry(date=old, error=0.001, median=0.05, p95=0.06)
    (tmp_path / "twin.calibration.json").write_text(
        rig.Calibration(latency=part).model_dump_json(exclude_none=True)
    )
    monkeypatch.setattr("rig.sources.run.load", lambda name: scene)
    opened([20])
    with caplog.at_level(logging.WARNING, "touchplate"):
        list(rig.run("twin"))
    assert "calibration of latency is 60 days old; repeat it" in caplog.messages
    caplog.clear()
    opened([20])
    list(rig.run(scene))
    assert not any("calibration" in message for message in caplog.messages)


def test_a_scene_that_is_not_there_is_refused_at_once():
    with pytest.raises(ValueError, match="no scene is called 'nowhere'"):
        rig.run("nowhere")


class Window:
    """A projector's window that remembers what it was given."""

    alive, status = True, "open"

    def __init__(self):
        self.shown, self.given = DisplayLog(), []

    def __call__(self, content):
        self.given.append(content)


@pytest.fixture
def projector(small, monkeypatch):
    """Give a scene with a projector, and the window that it opens."""
    window = Window()

    @contextmanager
    def open_projector(screen, *place):
        window.open = True
        try:
            yield window
        finally:
            window.open = False

    monkeypatch.setattr(show_module, "open_projector", open_projector)
    size = {"projector.size": [40, 30], "projector.content": "ripples"}
    return small({"touches.max_touches": 1} | size), window


def test_a_program_writes_marks_and_images_to_the_projector(projector, opened):
    scene, window = projector
    opened([20, 21, 76])
    image = np.arange(30 * 40 * 3, dtype=np.uint8).reshape(30, 40, 3)
    with rig.run(scene) as run:
        run.open_projector()
        next(run)
        assert set(window.given) == {()}  # dark, and not the demo of the scene
        run.show([rig.Mark(30.0, 40.0, 2.0)])
        assert window.given[-1] == (rig.Mark(30.0, 40.0, 2.0),)
        run.show(image[..., 0])
        image[:] = 0  # what is shown was taken before
        next(run)
        shown = window.given[-1]
        assert isinstance(shown, Image)
        assert shown.pixels[3, 5].tolist() == [(3 * (3 * 40 + 5)) % 256] * 3
        run.show(next(run).touches)
        assert len(window.given[-1]) == 1
        assert window.open
    assert not window.open


def test_what_is_shown_is_given_to_the_window_with_each_frame(projector, opened):
    scene, window = projector
    opened([20, 21, 22])
    with rig.run(scene) as run:
        run.open_projector()
        next(run)
        run.show([rig.Mark(30.0, 40.0, 2.0)])
        count = len(window.given)
        next(run)
        assert window.given[count:] == [(rig.Mark(30.0, 40.0, 2.0),)]


@pytest.mark.parametrize("shape", [(40, 30), (30, 40, 4), (30,)])
def test_an_image_of_another_size_than_the_projector_is_refused(projector, opened, shape):
    scene, _ = projector
    opened([20, 21])
    with rig.run(scene) as run:
        run.open_projector()
        next(run)
        with pytest.raises(ValueError, match=r"give uint8 of 30 x 40 \(grey\) or 30 x 40 x 3"):
            run.show(np.zeros(shape, np.uint8))
        with pytest.raises(ValueError, match="30 x 40 float64"):
            run.show(np.zeros((30, 40)))


def test_what_is_no_mark_is_refused_and_so_is_more_than_a_pipe_holds(projector, opened):
    scene, _ = projector
    opened([20, 21])
    mark = rig.Mark(30.0, 40.0, 2.0)
    with rig.run(scene) as run:
        run.open_projector()
        next(run)
        with pytest.raises(ValueError, match="holds a tuple; give marks, such as"):
            run.show([mark, (1.0, 2.0)])
        with pytest.raises(ValueError, match="is 201 marks, and 200 are shown at the most"):
            run.show([mark] * 201)


def test_a_projector_is_opened_before_the_first_frame_or_refused(projector, scene, opened):
    opened([20, 21])
    with rig.run(projector[0]) as run:
        with pytest.raises(ValueError, match="call open_projector and ask for the first frame"):
            run.show(())
        next(run)
        with pytest.raises(ValueError, match="call open_projector before it"):
            run.open_projector()
    bare = scene.model_copy(update={"projector": None})
    with pytest.raises(ValueError, match="has no projector to show something with"):
        rig.run(bare).open_projector()


def test_callbacks_have_each_frame_and_one_that_throws_is_logged_once(scene, opened, caplog):
    opened([20, 21, 22])
    seen, failures = [], []
    run = rig.run(scene)

    @run.on_frame
    def fragile(frame):
        failures.append(frame.sequence)
        raise KeyError("left")

    run.on_frame(lambda frame: seen.append(frame.sequence))
    assert [frame.sequence for frame in run] == [20, 21, 22]
    assert seen == failures == [20, 21, 22]
    (record,) = [one for one in caplog.records if one.levelno == logging.ERROR]
    assert "fragile' failed in frame 20 (KeyError: 'left'); frames go on" in record.getMessage()
    assert record.exc_info[1].args == ("left",)


def test_ctrl_c_in_a_callback_ends_the_run(scene, opened):
    source = opened([20, 21, 22])

    def interrupt(frame):
        raise KeyboardInterrupt

    run = rig.run(scene)
    run.on_frame(interrupt)
    with pytest.raises(KeyboardInterrupt):
        next(run)
    assert source.closed
