"""Frames of two cameras, by the time at which they were taken."""

import numpy as np
import pytest
from hypothesis import given, strategies as st

import rig
from rig.sources.frame_pairs import PATIENCE, matched
from rig.system.frame import Frame

IMAGE = np.zeros((3, 4), np.uint8)


class Listed:
    """A source that took frames at known times, and ends."""

    def __init__(self, times):
        self._frames = [Frame(k, time, IMAGE) for k, time in enumerate(times)]
        self.status = "a list"

    def grab(self, timeout):
        if not self._frames:
            raise EOFError(self.status)
        return self._frames.pop(0)


class Silent:
    status = "camera 7 is open"

    def grab(self, timeout):
        return None


@given(
    lost=st.tuples(st.sets(st.integers(0, 19)), st.sets(st.integers(0, 19))),
    jitter=st.lists(st.floats(-4e-4, 4e-4), min_size=20, max_size=20),
)
def test_frames_of_one_moment_meet_whatever_either_camera_lost(lost, jitter):
    first, second = (
        {k: k / 30 + (late if camera else 0.0) for k, late in enumerate(jitter) if k not in gone}
        for camera, gone in enumerate(lost)
    )
    found = list(matched(Listed(first.values()), Listed(second.values()), 1e-3))
    both = sorted(set(first) & set(second))
    assert [pair.first.captured for pair in found] == [first[k] for k in both]
    assert [pair.second.captured for pair in found] == [second[k] for k in both]
    assert all(abs(pair.apart) <= 1e-3 for pair in found)


def test_frames_without_a_partner_are_counted():
    first, second = Listed([0.0, 0.1, 0.2, 0.3]), Listed([0.0, 0.3])
    assert [pair.alone for pair in matched(first, second, 1e-3)] == [0, 2]


def test_cameras_that_run_freely_and_one_that_is_silent_are_one_sentence():
    times = np.arange(PATIENCE) / 30
    pairs = matched(Listed(times), Listed(times + 0.01), 1e-3)
    with pytest.raises(OSError, match=r"within 1 ms, the nearest 10 ms; trigger both cameras"):
        next(pairs)
    with pytest.raises(OSError, match=r"no frame came in 2 s: camera 7 is open"):
        next(matched(Silent(), Silent(), 1e-3))


def test_two_scenes_are_opened_and_closed_again(tmp_path):
    import cv2

    for side in ("left", "right"):
        (tmp_path / side).mkdir()
        for k in range(3):
            cv2.imwrite(str(tmp_path / side / f"{k}.png"), np.full((40, 60), k, np.uint8))
    scenes = [
        rig.load("twin", {"source": {"kind": "folder", "path": str(tmp_path / side)}})
        for side in ("left", "right")
    ]
    # Images of a folder were taken when they are read.
    pairs = list(rig.frame_pairs(*scenes, within=30.0))
    assert [(p.first.image[0, 0], p.second.image[0, 0]) for p in pairs] == [(0, 0), (1, 1), (2, 2)]
    with pytest.raises(ValueError, match="within must be more than 0 s"):
        next(rig.frame_pairs(*scenes, within=0.0))
