"""The folder in which a collection keeps its presses."""

from types import SimpleNamespace

import cv2
import numpy as np
import pytest

import fe
from rig.calibration.bench_presses import COLUMNS, read_list
from rig.calibration.collect import Taken
from rig.calibration.press_folder import KeptFrames, open_press_folder
from rig.calibration.press_images import read_press_images

TARGETS = (fe.Touch(60.0, 50.0, 2.0), fe.Touch(180.0, 120.0, 1.5), fe.Touch(90.0, 80.0, 1.0))


def images(count, value):
    return [np.full((12, 20), value, np.uint8)] * count


def contents(path):
    return {one.name: one.read_bytes() for one in path.iterdir()}


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
    assert folder.left(TARGETS) == TARGETS[1:]
    folder.keep(TARGETS[1], images(2, 30))
    assert read_list(folder.list_path)[1].frames == (8, 9)
    assert cut.read_bytes() == b"half"
    found = read_press_images(tmp_path, 3, [one.frames for one in folder.listed])
    assert [mean[0, 0] for mean in found.means] == [20, 30]


def test_one_that_was_stopped_before_its_first_press_begins_anew(tmp_path):
    open_press_folder(tmp_path, 3).keep_still(images(1, 10)[0])
    folder = open_press_folder(tmp_path, 3)
    assert not folder.has_reference
    assert not list(tmp_path.iterdir())


def test_a_press_that_cannot_be_written_leaves_the_folder_as_it_was(tmp_path):
    folder = filled(tmp_path, 1)
    before = contents(tmp_path)
    taken = tmp_path / "000008.png"
    taken.write_bytes(b"another program was here first")
    with pytest.raises(FileExistsError):
        folder.keep(TARGETS[1], images(4, 30))
    assert contents(tmp_path) == before | {taken.name: taken.read_bytes()}


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


def test_images_of_others_beside_a_list_are_never_touched(tmp_path, rng):
    """Any number of them, of any names, listed or not."""
    for count in rng.integers(4, 40, 8):
        folder = tmp_path / str(count)
        folder.mkdir(exist_ok=True)
        first = int(rng.integers(0, 4))
        named = [f"shot_{first + k:06d}.png" for k in range(count)]
        for name in named[int(rng.integers(0, 2)) :]:
            (folder / name).write_bytes(rng.bytes(20))
        last = int(rng.integers(3, count))
        (folder / "presses.csv").write_text(f"{','.join(COLUMNS)}\n1,3,{last},60.0,50.0,2.0\n")
        before = contents(folder)
        with pytest.raises(OSError, match=r"holds images that no collection wrote \(shot_00"):
            open_press_folder(folder, 3)
        assert contents(folder) == before


def test_images_after_those_of_a_list_stay_as_they_are(tmp_path):
    """They are numbered as a collection would: nobody can tell whose they are."""
    folder = filled(tmp_path, 1)
    for number in range(7, 12):
        (tmp_path / f"{number:06d}.png").write_bytes(b"mine")
    (tmp_path / "notes.txt").write_text("keep")
    before = contents(tmp_path)
    folder = open_press_folder(tmp_path, 3)
    assert contents(tmp_path) == before
    folder.keep(TARGETS[1], images(2, 30))
    assert contents(tmp_path).items() >= (before.items() - {("presses.csv", before["presses.csv"])})
    assert contents(tmp_path)["presses.csv"].startswith(before["presses.csv"])
    assert folder.listed[1].frames == (12, 13)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("my notes\n", r"is no list that a collection wrote"),
        (
            f"{','.join(COLUMNS)},remark\n1,3,4,60,50,2,firm\n",
            r"is no list that a collection wrote",
        ),
        (f"{','.join(COLUMNS)}\n1,3,4,60,50,2\n", r"names frame 4, and 0 images lie beside it"),
    ],
)
def test_a_list_of_others_is_never_touched(tmp_path, text, says):
    (tmp_path / "presses.csv").write_text(text)
    with pytest.raises(ValueError, match=says):
        open_press_folder(tmp_path, 3)
    assert contents(tmp_path) == {"presses.csv": text.encode()}


def test_a_video_is_no_folder_to_keep_presses_in(tmp_path):
    (tmp_path / "v.avi").write_bytes(b"RIFF")
    with pytest.raises(OSError, match=r"is no folder to keep presses in; .* with --list"):
        open_press_folder(tmp_path / "v.avi", 3)


def test_another_number_of_untouched_images_is_one_sentence(tmp_path):
    filled(tmp_path, 1)
    with pytest.raises(ValueError, match="has 3 untouched images and the scene wants 8"):
        open_press_folder(tmp_path, 8)
