"""Recordings on the page: each frame at its time, with what was found in it then."""

import h5py
import numpy as np
import pytest

from rig.page.player import PagePlayer, Player, RecordedFrames, newest
from rig.recording.paths import recordings
from rig.recording.session import open_session

PRESSED = [*range(30, 34), *range(60, 66)]
TIMES = np.array([0.0, 0.5, 1.0, 3.0])


class Publisher:
    """Keeps what is published, and asks at chosen looks."""

    def __init__(self, wishes):
        self.wishes, self.looks, self.given = wishes, 0, []

    def asked(self):
        self.looks += 1
        yield from self.wishes.get(self.looks, ())

    def publish(self, snapshot, controls):
        self.given.append((snapshot, controls))


class Over(Exception):  # noqa: N818
    """Nobody watches any more."""


def watch(path, wishes, step=0.1, steps=30):
    """Play with a clock that goes on by `step` at each look."""
    now, left = [100.0], iter(range(steps))

    def sleep(_):
        now[0] += step
        if next(left, None) is None:
            raise Over

    publisher = Publisher(wishes)
    with pytest.raises(Over):
        PagePlayer(publisher, lambda: now[0], sleep).play(path)
    return publisher.given


@pytest.fixture
def recorded(session, tmp_path):
    """Give the path of a recording, of which a frame comes each 0.1 s, and its snapshots."""
    path = tmp_path / "first.h5"
    _, shots, _ = session(path, PRESSED)
    return path, shots


def test_a_player_runs_pauses_and_seeks():
    player = Player(TIMES, clock=10.0)
    assert [player.index(10.0 + age) for age in (0.0, 0.4, 0.6, 2.9, 3.0, 50.0)] == [
        0, 0, 1, 2, 3, 3,
    ]  # fmt: skip
    paused = player.toggled(10.7)
    assert (paused.running, paused.seconds(20.0)) == (False, pytest.approx(0.7))
    assert paused.toggled(20.0).seconds(20.2) == pytest.approx(0.9)
    assert paused.sought(2.0, 30.0).index(99.0) == 2
    assert player.sought(-5.0, 30.0).seconds(30.0) == 0.0
    assert player.toggled(99.0).seconds(99.0) == 0.0  # the end was reached: once more


def test_frames_are_shown_with_what_was_found_then(recorded):
    path, shots = recorded
    with open_session(path) as session:
        frames = RecordedFrames(session)
        shown = [frames.snapshot(index, float(index)) for index in range(len(shots))]
    for one, shot in zip(shown, shots, strict=True):
        np.testing.assert_array_equal(one.image, shot.image)
        assert one.truth == shot.truth
        np.testing.assert_allclose(one.T_px_plate, shot.T_px_plate)
        assert [(mark.x, mark.y, mark.force) for mark in one.touches] == [
            (*xy, force)
            for xy, force in zip(shot.estimate.xy.tolist(), shot.estimate.force, strict=True)
        ]
        assert [m.identity for m in one.touches] == [m.identity for m in shot.touches]
        np.testing.assert_array_equal(one.strain.exx, shot.strain.exx)
        np.testing.assert_array_equal(one.strain.xs, shot.strain.xs)
        np.testing.assert_array_equal(one.strain.ys, shot.strain.ys)
    assert {len(one.touches) for one in shown} == {0, 1}
    assert all(np.isnan(one.strain.sigma).all() for one in shown)
    assert all(mark.sigma[0] == np.inf for one in shown for mark in one.from_strain)
    assert [one.dropped for one in shown] == [*[0] * 4, *[26] * 6]
    assert [one.captured for one in shown] == [float(n) for n in range(len(shots))]


def test_the_page_plays_pauses_seeks_and_opens_another(recorded, tmp_path):
    path, _ = recorded
    (tmp_path / "second.h5").write_bytes(path.read_bytes())
    with open_session(path) as session:
        end = float(RecordedFrames(session).times[-1])
    wishes = {
        2: [{"do": "play"}],
        8: [{"do": "seek", "to": end}, {"do": "seek", "to": "x"}, {"do": "seek", "to": np.nan}],
        16: [{"do": "set", "key": "recording", "value": "../first.h5"}],
        20: [{"do": "set", "key": "recording", "value": "second.h5"}],
    }
    given = watch(path, wishes, step=0.01, steps=90)
    first, later = given[0], given[-1]
    assert first[0].status == "frame 1 of 10 in first.h5: no touch"
    assert first[1].settings[0].choices == recordings(tmp_path)
    assert set(recordings(tmp_path)) == {"first.h5", "second.h5"}
    sought = [one for one in given if one[0].status.startswith("frame 10 of 10 in first.h5")]
    assert sought
    assert not sought[0][1].played.running
    assert sought[0][1].played.seconds == pytest.approx(end)
    assert " in second.h5: " in later[0].status
    captured = [snapshot.captured for snapshot, _ in given]
    assert captured == sorted(captured)


def test_a_damaged_image_is_left_out_and_said(recorded):
    path, _ = recorded
    with h5py.File(path) as file:
        chunk = file["frames/image"].id.get_chunk_info(4)
    with path.open("r+b") as raw:
        raw.seek(chunk.byte_offset)
        raw.write(b"\x55" * chunk.size)
    with open_session(path) as session:
        at = float(RecordedFrames(session).times[4])
    given = watch(path, {1: [{"do": "play"}], 4: [{"do": "seek", "to": at}]})
    assert "frame 4 of recording" in given[-1][1].notes[0]
    assert given[-1][0].status.startswith("frame 1 of 10 in first.h5")


def test_a_file_that_is_no_recording_is_said_and_the_one_before_goes_on(recorded, tmp_path):
    path, _ = recorded
    (tmp_path / "wrong.h5").write_bytes(b"no recording")
    wishes = {3: [{"do": "set", "key": "recording", "value": "wrong.h5"}]}
    given = watch(path, wishes)
    assert "wrong.h5" in given[-1][1].notes[0]
    assert " in first.h5: " in given[-1][0].status


def test_the_newest_of_a_folder_is_opened_and_an_empty_one_is_a_sentence(tmp_path):
    with pytest.raises(OSError, match="holds no recording"):
        newest(tmp_path)
    (tmp_path / "a.h5").touch()
    assert newest(tmp_path).name == "a.h5"
