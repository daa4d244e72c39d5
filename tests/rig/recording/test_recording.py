"""A session on disk: everything that was seen and said, whole after any end, found again."""

import csv
import dataclasses
import os
import resource
import signal
import subprocess
import sys
import threading
import time
from contextlib import suppress
from pathlib import Path

import h5py
import numpy as np
import pytest

from rig.live.noise_curve import COUNT
from rig.live.tracker import FrameProcessor
from rig.page.player import RecordedFrames
from rig.recording.export import to_csv
from rig.recording.fit import recorded_sentence
from rig.recording.playback import Playback
from rig.recording.recorder import RESERVE, SessionRecorder
from rig.recording.replay import replay
from rig.recording.session import open_session, reported
from rig.recording.swmr_flag import SUPERBLOCK, unmarked
from rig.system.timing import Stopwatch

PRESSED = [*range(30, 34), *range(60, 66), *range(480, 490)]  # nobody, one finger, two fingers


def again(path, bench):
    with open_session(path) as recording:
        return list(replay(recording, bench, Stopwatch(time.monotonic)))


def replay_at_equilibrium(path, bench):
    return again(path, dataclasses.replace(bench, in_time=None))


def test_a_replay_finds_the_same_touches_bit_for_bit(session, tmp_path):
    path = tmp_path / "session.h5"
    bench, shots, recorder = session(path, PRESSED)
    assert recorder.dropped == 0
    replayed = again(path, bench)
    assert len(replayed) == len(shots) == recorder.summary()["frames"]
    assert all(one.same for one in replayed)
    assert {len(shot.touches) for shot in shots} == {0, 1, 2}
    for one, shot in zip(replayed, shots, strict=True):
        found, then = one.frame_estimate.estimate, shot.estimate
        np.testing.assert_array_equal(found.xy, then.xy)
        np.testing.assert_array_equal(found.covariance, then.covariance)
        assert one.frame.sequence == shot.sequence
        np.testing.assert_array_equal(one.frame.image, shot.image)
        assert [(t.x, t.y, t.force) for t in one.frame.truth] == [
            (mark.x, mark.y, mark.force) for mark in shot.truth
        ]


@pytest.mark.slow
def test_a_replay_on_a_bench_of_which_nothing_is_known_reports_the_same(session, tmp_path):
    """Touches by the causes that a frame shows, and none that only one frame shows."""
    path, changes = tmp_path / "session.h5", {"comparison": None, "estimator.bench": "usual"}
    bench, shots, _ = session(path, PRESSED[:10], changes=changes)
    replayed = again(path, bench)
    assert all(one.same for one in replayed)
    assert sum(len(shot.touches) for shot in shots) > 5
    far = [one.frame_estimate.estimate.systematic is not None for one in replayed]
    assert any(far)


@pytest.mark.slow
def test_a_replay_of_a_plate_that_rings_follows_it_as_the_run_did(session, tmp_path):
    changes = {
        "comparison": None,
        "plate.thickness": 1.0,
        "plate.theory": "linear",
        "camera.rate": 120.0,
        "touches.force": [1.0, 1.5],
        "source.rings": True,
        "source.script": "taps",
        "dynamics.density": 1400.0,
        "dynamics.exposure": "6 ms",
    }
    path = tmp_path / "session.h5"
    bench, shots, _ = session(path, range(112, 160), changes=changes)
    replayed = again(path, bench)
    assert all(one.same for one in replayed)
    (tap,) = (tap for shot in shots for tap in shot.taps)
    (found,) = (tap for one in replayed for tap in one.frame_estimate.state.past.taps)
    assert (found.x, found.y, found.force) == (tap.x, tap.y, tap.force)
    # Frame by frame at equilibrium the ringing shows touches that nobody makes.
    still = replay_at_equilibrium(path, bench)
    assert sum(one.frame_estimate.estimate.count for one in still) > sum(
        one.frame_estimate.estimate.count for one in replayed
    )


@pytest.mark.slow
def test_a_recording_plays_with_the_times_of_then_however_late_it_is_read(session, tmp_path):
    path = tmp_path / "session.h5"
    session(path, PRESSED[:8])
    with open_session(path) as recording:
        taken = recording.columns()["frames/captured"]
        played = Playback(recording)
        frames = [played.grab(10.0)]
        time.sleep(2.0 * (taken[-1] - taken[0]))  # all others are late
        frames += [played.grab(10.0) for _ in taken[1:]]
    captured = np.array([frame.captured for frame in frames])
    np.testing.assert_allclose(np.diff(captured), np.diff(taken), atol=1e-6)
    assert all(frame.given >= frame.captured for frame in frames)
    assert frames[-1].late > 0.5 * (taken[-1] - taken[0])


@pytest.mark.slow
def test_a_slow_disk_leaves_frames_out_and_the_others_are_found_again(
    session, tmp_path, monkeypatch
):
    path = tmp_path / "session.h5"
    calls, left_out, put = iter(range(1000)), threading.Event(), SessionRecorder.put

    def watched(recorder, shot):
        put(recorder, shot)
        if recorder.dropped:
            left_out.set()

    def slow(_):
        if next(calls) == 3:  # as slow as it takes
            assert left_out.wait(60.0)
        return 2 * RESERVE

    monkeypatch.setattr(SessionRecorder, "put", watched)

    bench, shots, recorder = session(path, PRESSED, free=slow, waiting=1)
    assert recorder.dropped > 0
    replayed = again(path, bench)
    assert len(replayed) == len(shots) - recorder.dropped
    assert all(one.same for one in replayed)


def test_the_noise_by_grey_level_comes_back_and_an_older_recording_has_none(session, tmp_path):
    path = tmp_path / "session.h5"
    session(path, PRESSED[:2])
    with open_session(path) as stored:
        curve = stored.reference.curve
    assert curve.shape == (COUNT,)
    assert curve[8] == pytest.approx(4.0 * (1 + 1 / 16), rel=0.05)  # σ is 2 grey levels
    with h5py.File(path, "r+") as file:
        del file["reference"].attrs["curve"]
        del file["tares/curve"]
    with open_session(path) as stored:
        assert stored.reference.curve is None


def test_variances_that_cannot_be_are_said(session, tmp_path):
    path = tmp_path / "session.h5"
    session(path, PRESSED[:2])
    with h5py.File(path, "r+") as file:
        file["reference"].attrs["curve"] = -np.ones((COUNT,))
    with (
        pytest.raises(OSError, match="variances by grey level are none"),
        open_session(path),
    ):
        pass


@pytest.mark.slow
def test_the_file_opens_without_this_program(session, tmp_path):
    path = tmp_path / "session.h5"
    _, shots, _ = session(path, PRESSED)
    with h5py.File(path) as file:
        assert file.attrs["format"] == b"touchplate session"
        assert b'"plate"' in file.attrs["scene"]
        images, places = file["frames/image"], file["touches/place"]
        assert images.shape == (len(PRESSED), 320, 384)
        assert images.chunks == (1, 320, 384)
        assert images.compression == "gzip"
        assert images.id.get_storage_size() < images.size
        simple = {"u", "i", "f"}
        file.visititems(lambda _, x: None if not hasattr(x, "dtype") or x.dtype.kind in simple
                        else pytest.fail(f"{x} is not of a simple type"))  # fmt: skip
        one = next(k for k, shot in enumerate(shots) if len(shot.touches) == 1)
        mark = shots[one].touches[0]  # of a touch that landed just now: the mean of one estimate
        np.testing.assert_allclose(places[one, 0], (mark.x, mark.y, mark.force), rtol=1e-12)
        assert np.isnan(places[one, 1]).all()
        assert file["touches/identity"][one].tolist() == [mark.identity, -1]


FIT = ("result", "p_value", "chi2", "dof", "sentence")


def test_a_recording_holds_how_well_touches_explained_a_frame(session, tmp_path):
    path = tmp_path / "session.h5"
    _, shots, _ = session(path, PRESSED[:8])
    with open_session(path) as recording:
        rows = [recording.row(k) for k in range(recording.frames)]
    assert {len(shot.touches) for shot in shots} == {0, 1}
    for row, shot in zip(rows, shots, strict=True):
        found, kept = reported(row), shot.estimate
        assert (found.chi2, found.dof, found.p_value) == (kept.chi2, kept.dof, kept.p_value)
        assert found.result is kept.result
        assert bytes(row["touches/sentence"]).rstrip(b"\0").decode() == shot.status


def test_a_long_sentence_is_cut_between_two_letters(session, tmp_path, monkeypatch):
    path = tmp_path / "session.h5"
    monkeypatch.setattr(FrameProcessor, "sentence", lambda *_: "x" + 300 * "σ")
    session(path, PRESSED[:1])
    with open_session(path) as recording:
        assert recorded_sentence(recording.row(0)) == "x" + 199 * "σ"


def test_a_recording_of_the_release_before_has_empty_cells(session, tmp_path):
    path = tmp_path / "session.h5"
    _, shots, _ = session(path, PRESSED[:8])
    with h5py.File(path, "r+") as file:
        for name in (f"touches/{name}" for name in FIT):
            del file[name]
        del file["frames/check"]
    with open_session(path) as recording:
        to_csv(recording, tmp_path, lambda done, total: None)
        shown = RecordedFrames(recording).snapshot(0, 1.0)
    assert shown.status.endswith("frame 1 of 8 in session.h5: no touch")
    with (tmp_path / "touches.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == len(shots)
    assert {row["sentence"] + row["p_value"] + row["result"] for row in rows} == {""}


@pytest.mark.parametrize(
    ("name", "value", "wrong"),
    [("result", 3, "result is 3"), ("p_value", 1.5, "p_value is 1.5"), ("dof", 0, "of 0")],
)
def test_a_fit_that_cannot_be_is_refused(session, tmp_path, name, value, wrong):
    path = tmp_path / "session.h5"
    session(path, PRESSED[:2])
    with h5py.File(path, "r+") as file:
        file[f"touches/{name}"][1] = value
        del file["frames/check"]
    with open_session(path) as recording:
        recording.row(0)
        with pytest.raises(OSError, match=wrong):
            recording.row(1)
    with h5py.File(path, "r+") as file:
        del file[f"touches/{name}"]
    with pytest.raises(OSError, match=f"touches/{name} is missing"), open_session(path):
        pass


@pytest.mark.parametrize("forged", [-1.0, 1e300])
def test_a_covariance_that_cannot_be_is_refused(session, tmp_path, forged):
    path = tmp_path / "session.h5"
    session(path, PRESSED)
    with h5py.File(path, "r+") as file:
        known = np.isfinite(file["touches/covariance"][:, 0, 0, 0])
        frame = int(np.flatnonzero(known)[0])
        file["touches/covariance"][frame, 0, 1, 1] = forged
        del file["frames/check"]
    with open_session(path) as recording:
        recording.row(0)
        with pytest.raises(OSError, match="touches/covariance is no covariance"):
            recording.row(frame)


def test_the_number_of_frames_of_the_reference_comes_back(session, tmp_path):
    path = tmp_path / "session.h5"
    bench, _, _ = session(path, PRESSED[:2])
    with open_session(path) as stored:
        assert stored.reference.frames == bench.reference_frames
    with h5py.File(path, "r+") as file:
        del file["reference"].attrs["frames"], file["tares/frames"]
    with open_session(path) as stored:
        assert stored.reference.frames == 0, "as in recordings of the release before"
        assert stored.reference.own_noise is None


def test_a_disk_that_fills_up_ends_the_recording_and_not_the_loop(session, tmp_path):
    path = tmp_path / "session.h5"
    calls = iter([RESERVE * 2] * 5)
    _, shots, recorder = session(path, PRESSED, free=lambda _: next(calls, 0))
    assert len(shots) == len(PRESSED)
    assert recorder.dropped == len(PRESSED) - 5
    assert "256 MB are free there); free space and start a new one" in recorder.status
    assert recorder.failure.startswith(f"recording to '{path}' has ended with 5 frames (")
    assert not recorder.summary()["complete"]
    with open_session(path) as recording:
        assert recording.frames == 5


WRITE = """
import os, sys
from pathlib import Path
import numpy as np
from rig.recording.layout import LAST
from rig.recording.writer import Writer
from rig.live.baseline import ReferenceFrame
layout = {
    "frames/image": ((60, 80), "u1"), "frames/captured": ((), "f8"),
    "frames/truth": ((10, 4), "f8"), "frames/truth_known": ((), "u1"),
    "touches/place": ((2, 3), "f8"), "touches/covariance": ((2, 3, 3), "f8"),
    "touches/identity": ((2,), "i8"), "start/motion": ((3,), "f8"), "start/rest": ((3,), "f8"),
    "start/touches": ((2, 3), "f8"), "start/from_strain": ((2, 3), "f8"), LAST: ((), "i8"),
}
still = {name: np.zeros(shape, kind) for name, (shape, kind) in layout.items()}
scene = '{"title": "a test"}'
zero = ReferenceFrame(np.ones((60, 80), np.float32), 2.0)

def write(path):
    writer = Writer(Path(path), {"scene": scene}, zero, layout)
    rng = np.random.default_rng(0)
    for k in range(100000):
        image = rng.integers(0, 255, (60, 80), np.uint8) | (k % 2)
        place = np.full((2, 3), float(k))
        try:
            writer.append(
                {**still, "frames/image": image, "touches/place": place, LAST: np.asarray(k)}
            )
        except OSError as error:
            writer.abandon()
            sys.exit(str(error))
        print(k, flush=True)
"""
ONE = WRITE + "write(sys.argv[1])"
# One process after another, each whole in itself, without the imports of the one before.
IN_TURN = (
    WRITE
    + """
for path in sys.argv[1:]:
    if not (child := os.fork()):
        write(path)
    print("begun", child, flush=True)
    os.waitpid(child, 0)
"""
)


def writing(*paths, program=ONE, **options):
    return subprocess.Popen(
        [sys.executable, "-c", program, *map(str, paths)],
        stdout=subprocess.PIPE, text=True, **options,
    )  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("frames", [1, 7, 40])
def test_a_writer_that_is_killed_leaves_every_whole_frame(tmp_path, frames):
    path = tmp_path / "killed.h5"
    process = writing(path)
    for _ in range(frames):
        process.stdout.readline()
    os.kill(process.pid, signal.SIGKILL)
    said = frames + len(process.stdout.read().split())
    process.wait()
    with open_session(path) as recording:
        assert said <= recording.frames <= said + 1
        for k in (0, recording.frames // 2, recording.frames - 1):
            row = recording.row(k)
            assert row["frames/sequence"] == k
            assert (row["frames/image"] % 2 >= k % 2).all()
            assert (row["touches/place"] == k).all()


def test_other_programs_open_what_a_killed_writer_leaves(tmp_path):
    """At once, but for a kill within a flush, 1 of 20 of these: HDF5 has put its mark on then."""
    paths, opened = [tmp_path / f"{number}.h5" for number in range(8)], []
    with writing(*paths, program=IN_TURN) as process:
        for number, path in enumerate(paths):
            while not (line := process.stdout.readline()).startswith("begun"):
                pass  # what the one before wrote up to its end
            for _ in range(20 + number):
                process.stdout.readline()
            os.kill(int(line.split()[1]), signal.SIGKILL)
            with suppress(OSError), h5py.File(path) as file:
                opened.append(file["frames/image"][19].size and file["frames/sequence"][19] == 19)
    assert sum(opened) >= 5


def test_other_programs_open_what_is_still_written(tmp_path):
    path = tmp_path / "written.h5"
    process = writing(path)
    for _ in range(5):
        process.stdout.readline()
    os.kill(process.pid, signal.SIGSTOP)
    with open_session(path) as recording:
        assert recording.frames >= 4
    process.kill()
    process.communicate()


@pytest.mark.parametrize("size", [0, 1, 1000, 70_000])
def test_a_file_that_hdf5_has_closed_bears_no_mark(tmp_path, size):
    """Its own checksum is the truth for ours."""
    with h5py.File(tmp_path / "one.h5", "x", libver="latest") as file:
        file["numbers"] = np.arange(size)
    superblock = (tmp_path / "one.h5").read_bytes()[:SUPERBLOCK]
    assert unmarked(superblock) == superblock


@pytest.mark.slow
def test_a_file_that_may_not_grow_keeps_its_whole_frames(tmp_path):
    path = tmp_path / "full.h5"

    def small_files():
        resource.setrlimit(resource.RLIMIT_FSIZE, (200_000, 200_000))

    process = writing(path, preexec_fn=small_files, stderr=subprocess.PIPE)
    said, errors = process.communicate()
    assert "write" in errors.lower()
    with open_session(path) as recording:
        assert recording.frames >= len(said.split()) > 10
        last = recording.row(len(said.split()) - 1)
        assert last["frames/sequence"] == len(said.split()) - 1


@pytest.mark.slow
def test_a_file_that_lost_its_end_keeps_the_frames_before_it(session, tmp_path):
    path = tmp_path / "session.h5"
    session(path, [*PRESSED, *range(600, 660)])  # more than one chunk of small numbers
    whole, rows = path.read_bytes(), read_all(path)
    kept = []
    for part in (0.999, 0.9, 0.5, 0.2):
        path.write_bytes(whole[: int(part * len(whole))])
        with open_session(path) as recording:
            kept.append(recording.frames)
            assert f"lacks its end: {recording.frames} of {len(rows)} frames" in recording.cut
            for k in range(recording.frames):
                row = recording.row(k)
                assert all(np.array_equal(row[name], rows[k][name], True) for name in row)
    assert kept == sorted(kept, reverse=True)
    assert kept[1] >= 0.8 * len(rows)
    assert kept[3] > 0


@pytest.mark.parametrize("bytes_left", [3, 40, 3000])
def test_a_file_of_which_hardly_anything_is_left_is_one_sentence(session, tmp_path, bytes_left):
    path = tmp_path / "session.h5"
    session(path, PRESSED[:4])
    path.write_bytes(path.read_bytes()[:bytes_left])
    with pytest.raises(OSError, match=r"session\.h5' cannot be read .*cut off"):
        read_all(path)


def read_all(path):
    with open_session(path) as recording:
        return [recording.row(k) for k in range(recording.frames)]


def test_what_is_known_of_traces_is_there_whole_or_not_at_all(session, tmp_path):
    path = tmp_path / "session.h5"
    bench, shots, _ = session(path, PRESSED[:8])
    with h5py.File(path, "r+") as file:
        kept = file["start/trace"][:]
        del file["start/trace"]
    with pytest.raises(OSError, match="start/trace is missing"), open_session(path):
        pass
    with h5py.File(path, "r+") as file:
        file["start/trace"] = kept[:, None]
    with pytest.raises(OSError, match="start/trace is float64"), open_session(path):
        pass
    with h5py.File(path, "r+") as file:
        del file["start/trace"], file["start/trace_scatter"], file["start/moved"]
        del file["frames/check"]
    assert len(again(path, bench)) == len(shots), "as in recordings of the release before"


def test_what_is_no_recording_is_one_sentence(tmp_path):
    path = tmp_path / "other.h5"
    with pytest.raises(OSError, match="does not exist; check the path"), open_session(path):
        pass
    with h5py.File(path, "w") as file:
        file["x"] = 1
    with pytest.raises(OSError, match="is no recording of touchplate"), open_session(path):
        pass
    Path(path).write_text("touches")
    with pytest.raises(OSError, match="cannot be read"), open_session(path):
        pass
