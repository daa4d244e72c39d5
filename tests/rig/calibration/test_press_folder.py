"""The folder in which a collection keeps its presses."""

from types import SimpleNamespace

import cv2
import numpy as np
import pytest

import fe
from rig.calibration.bench_presses import read_list
from rig.calibration.collect import Taken
from rig.calibration.press_folder import KeptFrames, open_press_folder

TARGETS = (fe.Touch(60.0, 50.0, 2.0), fe.Touch(180.0, 120.0, 1.5), fe.Touch(90.0, 80.0, 1.0))


def images(count, value):
    return [np.full((12, 20), value, np.uint8)] * count


def filled(path, presses):
    folder = open_press_folder(path, 3)
    for image in images(5, 10):
        folder.keep_still(image)
    for number, press in enumerate(TARGETS[:presses]):
        folder.keep(press, images(4, 20 + number))
    return folder


def test_it_holds_the_untouched_images_and_a_line_for_each_press(tmp_path):
    folder = filled(tmp_path / "p", 2)
    listed = read_list(folder.list_path)
    assert [one.frames for one in listed] == [(3, 6), (7, 10)]
    assert [(one.place, one.force) for one in listed] == [
        ((t.x, t.y), t.force) for t in TARGETS[:2]
    ]
    assert len(list((tmp_path / "p").glob("*.png"))) == 11


def test_a_collection_that_was_stopped_goes_on_where_it_was(tmp_path):
    filled(tmp_path, 1)
    cut = tmp_path / "000007.png"  # of a press whose line was not written
    cut.write_bytes(b"half")
    folder = open_press_folder(tmp_path, 3)
    assert folder.has_reference
    assert not cut.exists()
    assert folder.left(TARGETS) == TARGETS[1:]
    folder.keep(TARGETS[1], images(2, 30))
    assert read_list(folder.list_path)[1].frames == (7, 8)


def test_one_that_was_stopped_before_its_first_press_begins_anew(tmp_path):
    open_press_folder(tmp_path, 3).keep_still(images(1, 10)[0])
    folder = open_press_folder(tmp_path, 3)
    assert not folder.has_reference
    assert not list(tmp_path.glob("*.png"))


@pytest.mark.parametrize(("rate", "frames"), [(30.0, 12), (3.0, 4)])
def test_as_many_images_of_a_press_are_kept_as_frames_count(tmp_path, rate, frames):
    """The last ones before it is complete, however slow the machine is."""
    folder = open_press_folder(tmp_path, 3)
    kept = KeptFrames(folder)
    for number in range(30):
        image = np.full((12, 20), number, np.uint8)
        snapshot = SimpleNamespace(fresh=True, captured=number / rate, image=image)
        taken = Taken(TARGETS[0], np.zeros(3), np.ones(3), frames) if number == 29 else None
        kept(snapshot, taken)
    (one,) = folder.listed
    assert one.frames == (3, 2 + frames)
    written = [cv2.imread(str(path), 0)[0, 0] for path in sorted(tmp_path.glob("*.png"))]
    assert written == [0, 1, 2, *range(30 - frames, 30)]


def test_images_of_others_are_never_touched(tmp_path):
    (tmp_path / "holiday.png").write_bytes(b"x")
    with pytest.raises(OSError, match=r"holds images and no presses\.csv"):
        open_press_folder(tmp_path, 3)
    assert (tmp_path / "holiday.png").exists()


def test_another_number_of_untouched_images_is_one_sentence(tmp_path):
    filled(tmp_path, 1)
    with pytest.raises(ValueError, match="has 3 untouched images and the scene wants 8"):
        open_press_folder(tmp_path, 8)
