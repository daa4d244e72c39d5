"""A folder of images and the list of their presses, which grows by one press at a time.

It is what ``touchplate calibrate bench --presses … --images …`` takes: the untouched images first,
then those of each press, and a line of the list for a press when all of its images are there. So a
collection that was stopped has all presses before, and goes on. What lies in the folder is never
written over, and nothing is deleted that was there before.
"""

from __future__ import annotations

import csv
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field
from io import StringIO
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
        Images of the untouched plate that come first; they are written with the first press.
    listed : list of Listed
        Presses that are kept.
    """

    path: Path
    still: int
    listed: list[Listed]
    _images: int
    _untouched: list[AnyArray] = field(default_factory=list[AnyArray])

    @property
    def list_path(self) -> Path:
        """The list."""
        return self.path / LIST

    @property
    def has_reference(self) -> bool:
        """Whether the images of the untouched plate are there."""
        return bool(self.listed) or len(self._untouched) >= self.still

    def left(self, targets: Sequence[fe.Touch]) -> tuple[fe.Touch, ...]:
        """Targets that no press of the list is at."""
        done = {(one.place, one.force) for one in self.listed}
        return tuple(t for t in targets if ((t.x, t.y), t.force) not in done)

    def keep_still(self, image: AnyArray) -> None:
        """Keep an image (H, W) of the untouched plate, until there are enough."""
        if not self.has_reference:
            self._untouched.append(image)

    def keep(self, press: fe.Touch, images: Sequence[AnyArray]) -> None:
        """Keep a press and its images (H, W).

        Raises
        ------
        OSError
            The disk is full or may not be written to, or another program wrote in the folder.
        """
        self._write([*self._untouched, *images])
        self._untouched = []
        number, frames = str(len(self.listed) + 1), (self._images - len(images), self._images - 1)
        self.listed.append(Listed(number, frames, (press.x, press.y), press.force))
        _add_line(self.list_path, self.listed[-1])

    def _write(self, images: Sequence[AnyArray]) -> None:
        """Write images after those that are there; none of them stays where one cannot be."""
        written: list[Path] = []
        try:
            for number, image in enumerate(images, self._images):
                path = self.path / _NAME.format(number)
                with path.open("xb") as file:  # never over another's
                    written.append(path)
                    file.write(cv2.imencode(".png", image)[1].tobytes())
        except BaseException:
            for path in written:
                path.unlink()
            raise
        self._images += len(written)


def open_press_folder(path: Path, still: int) -> PressFolder:
    """Open the presses of a folder, which may be new.

    Raises
    ------
    OSError
        The folder cannot be made or read, or holds other images.
    ValueError
        Its list is damaged or another's, or its first press is not preceded by `still` images.
    """
    if path.exists() and not path.is_dir():
        raise OSError(
            f"'{path}' is no folder to keep presses in; name one that is empty or new, or take the"
            " presses of a video by their list with --list"
        )
    path.mkdir(parents=True, exist_ok=True)
    there = {one.name for one in path.iterdir() if one.suffix.lower() in SUFFIXES}
    listed = _read(path / LIST)
    if there and not listed:
        raise OSError(
            f"folder '{path}' holds images and no {LIST} that lists them; name one that is empty or"
            " new"
        )
    _require_own(path, there)
    named = max((one.frames[1] for one in listed), default=-1)
    if named >= len(there):
        raise ValueError(
            f"'{path / LIST}' names frame {named}, and {len(there)} images lie beside it, counted"
            " from 0; put the others back, or name another folder"
        )
    first = min((one.frames[0] for one in listed), default=still)
    if first < still:
        raise ValueError(
            f"'{path}' has {first} untouched images and the scene wants {still}"
            " (dic.reference_frames); name another folder"
        )
    # Images of a press that was cut short are in no list, and stay: what comes is numbered on.
    return PressFolder(path, still, listed, len(there))


def _require_own(path: Path, there: set[str]) -> None:
    """Refuse images of a folder that are not numbered as those of a collection."""
    others = sorted(there - {_NAME.format(number) for number in range(len(there))})
    if not others:
        return
    more = f" and {len(others) - 1} more" if len(others) > 1 else ""
    raise OSError(
        f"folder '{path}' holds images that no collection wrote ({others[0]}{more}); name one that"
        f" is empty or new, or take the presses of its list with --list '{path / LIST}' --images"
        f" '{path}'"
    )


def _read(path: Path) -> list[Listed]:
    """Read the list; none if there is no file or no press in it yet."""
    if not path.exists():
        return []
    lines = path.read_bytes().splitlines()
    if lines[:1] != [",".join(COLUMNS).encode()]:
        raise ValueError(
            f"'{path}' is no list that a collection wrote, whose first line is"
            f" {','.join(COLUMNS)}; name another folder"
        )
    return read_list(path) if len(lines) > 1 else []


def _add_line(path: Path, one: Listed) -> None:
    """Add a press to a list, which stays as it is where that fails."""
    line = StringIO(newline="")
    rows = csv.writer(line)
    if not path.exists():
        rows.writerow(COLUMNS)
    rows.writerow((one.press, *one.frames, *(one.place or ("", "")), one.force))
    before = path.read_bytes() if path.exists() else b""
    gap = b"\r\n" if before and not before.endswith(b"\n") else b""
    with export.aside(path) as draft:
        draft.write_bytes(before + gap + line.getvalue().encode())


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
