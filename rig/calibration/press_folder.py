"""A folder of images and the list of their presses, which grows by one press at a time.

It is what ``touchplate calibrate bench --presses … --images …`` takes: the untouched images first,
then those of each press, and a line of the list for a press when all of its images are there. So a
collection that was stopped has all presses before, and goes on.
"""

from __future__ import annotations

import csv
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2

import fe
from dic import export
from rig.calibration.bench_presses import COLUMNS, Listed, read_list
from rig.calibration.collect import FRAMES, HOLD, Taken
from rig.camera.files import SUFFIXES
from rig.live.snapshot import Snapshot
from rig.system.arrays import AnyArray

LIST = "presses.csv"
_NAME = "{:06d}.png"


@dataclass
class PressFolder:
    """Use `open_press_folder`.

    Attributes
    ----------
    path : Path
    still : int
        Images of the untouched plate that come first.
    listed : list of Listed
        Presses that are kept.
    """

    path: Path
    still: int
    listed: list[Listed]
    _images: int

    @property
    def list_path(self) -> Path:
        """The list."""
        return self.path / LIST

    @property
    def has_reference(self) -> bool:
        """Whether the images of the untouched plate are there."""
        return self._images >= self.still

    def left(self, targets: Sequence[fe.Touch]) -> tuple[fe.Touch, ...]:
        """Targets that no press of the list is at."""
        done = {(one.place, one.force) for one in self.listed}
        return tuple(t for t in targets if ((t.x, t.y), t.force) not in done)

    def keep_still(self, image: AnyArray) -> None:
        """Keep an image (H, W) of the untouched plate, until there are enough."""
        if not self.has_reference:
            self._write(image)

    def keep(self, press: fe.Touch, images: Sequence[AnyArray]) -> None:
        """Keep a press and its images (H, W).

        Raises
        ------
        OSError
            The disk is full or may not be written to.
        """
        first = self._images
        for image in images:
            self._write(image)
        number, frames = str(len(self.listed) + 1), (first, self._images - 1)
        self.listed.append(Listed(number, frames, (press.x, press.y), press.force))
        _write_list(self.list_path, self.listed)

    def _write(self, image: AnyArray) -> None:
        path = self.path / _NAME.format(self._images)
        if not cv2.imwrite(str(path), image):
            raise OSError(f"'{path}' cannot be written; check the disk and its rights")
        self._images += 1


def open_press_folder(path: Path, still: int) -> PressFolder:
    """Open the presses of a folder, which may be new.

    Raises
    ------
    OSError
        The folder cannot be made or read, or holds other images.
    ValueError
        Its list is damaged, or its first press is not preceded by `still` images.
    """
    path.mkdir(parents=True, exist_ok=True)
    there = {one for one in path.iterdir() if one.suffix.lower() in SUFFIXES}
    if there and not (path / LIST).exists():
        raise OSError(f"folder '{path}' holds images and no {LIST}; name one that is empty or new")
    listed = _read(path / LIST)
    if listed and listed[0].frames[0] < still:
        raise ValueError(
            f"'{path}' has {listed[0].frames[0]} untouched images and the scene wants {still}"
            " (dic.reference_frames); name another folder"
        )
    images = listed[-1].frames[1] + 1 if listed else 0
    # Images of a press that was cut short are in no list.
    for left_over in there - {path / _NAME.format(number) for number in range(images)}:
        left_over.unlink()
    _write_list(path / LIST, listed)
    return PressFolder(path, still, listed, images)


def _read(path: Path) -> list[Listed]:
    """Read the list; none if there is no file or no press in it yet."""
    if not path.exists() or len(path.read_text(encoding="utf-8").splitlines()) < 2:
        return []
    return read_list(path)


def _write_list(path: Path, listed: Sequence[Listed]) -> None:
    with export.aside(path) as draft, draft.open("w", newline="", encoding="utf-8") as file:
        rows = csv.writer(file)
        rows.writerow(COLUMNS)
        for one in listed:
            rows.writerow((one.press, *one.frames, *(one.place or ("", "")), one.force))


class KeptFrames:
    """Keeps the images of presses in a folder: call it with each frame.

    Parameters
    ----------
    folder : PressFolder or None
        None keeps nothing.
    """

    def __init__(self, folder: PressFolder | None):
        self._folder = folder
        self._recent: deque[tuple[float, AnyArray]] = deque()

    def __call__(self, snapshot: Snapshot, taken: Taken | None) -> None:
        """Keep a frame of the untouched plate, or the press that a frame completes."""
        if self._folder is None or not snapshot.fresh:
            return
        if not self._folder.has_reference:
            self._folder.keep_still(snapshot.image)
        self._recent.append((snapshot.captured, snapshot.image))
        while len(self._recent) > FRAMES and snapshot.captured - self._recent[0][0] > HOLD / 2:
            self._recent.popleft()
        if taken is not None:
            images = [image for _, image in self._recent]
            self._folder.keep(taken.press, images[-taken.frames :])
