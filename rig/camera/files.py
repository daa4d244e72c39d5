"""Images of a folder, of any names, or of a video in the place of a camera, one after the other."""

from __future__ import annotations

import csv
import re
import time
from collections.abc import Callable, Iterator, Sequence
from itertools import pairwise
from math import isfinite
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import dic
from rig.camera.controls import ControlSetting
from rig.system.frame import Frame

SUFFIXES = {".png", ".tif", ".tiff", ".bmp", ".jpg", ".jpeg", ".pgm"}


class ImageSequence:
    """A `Device` that gives grey images in order, at a pace or as fast as they are read.

    Parameters
    ----------
    name : str
        What the user knows the source by.
    images : iterator of (H, W) uint8
    rate : float or None, frames a second
        Images that are read late keep their number, their turn and the time at which they were due;
        None waits for nothing, and an image is as old as it was read.
    clock : callable
        Monotonic time, s.
    sleep : callable
        Lets a time pass, s.
    times : sequence of float, s, or None
        When each image was taken; in the place of a rate.
    """

    settings: tuple[ControlSetting, ...] = ()

    def __init__(
        self,
        name: str,
        images: Iterator[NDArray[np.uint8]],
        rate: float | None,
        clock: Callable[[], float] = time.monotonic,
        sleep: Callable[[float], object] = time.sleep,
        times: Sequence[float] | None = None,
    ):
        self.name = name
        self._clock, self._sleep = clock, sleep
        self._images = images
        self._period, self._times = 1.0 / rate if rate else 0.0, times
        self._start: float | None = None
        self._number = 0
        self._shape: tuple[int, ...] | None = None

    def read(self, timeout: float) -> Frame | None:
        """See `Device.read`."""
        now = self._clock()
        self._start = now if self._start is None else self._start
        due = self._start + self._due()
        wait = due - now
        if wait > timeout:
            self._sleep(timeout)
            return None
        self._sleep(max(0.0, wait))
        image = next(self._images, None)
        if image is None:
            raise EOFError(f"{self.name} has ended after {self._number} images")
        self._number += 1
        self._check_shape(image.shape)
        read = self._clock()
        captured = due if self._period or self._times is not None else read
        return Frame(self._number - 1, captured, image, late=read - captured)

    def _check_shape(self, shape: tuple[int, ...]) -> None:
        self._shape = self._shape or shape
        if shape != self._shape:
            (rows, columns), (high, wide) = shape, self._shape
            raise OSError(
                f"image {self._number} of {self.name} has {columns} x {rows} px, those before have"
                f" {wide} x {high}; leave it out"
            )

    def _due(self) -> float:
        """Time of the next image from the first, s."""
        if self._times is None:
            return self._number * self._period
        return self._times[min(self._number, len(self._times) - 1)] - self._times[0]

    def close(self) -> None:
        """See `Device.close`."""


def open_folder(folder: str | Path, rate: float | None = None) -> ImageSequence:
    """Open the images of a folder, in the order of the numbers in their names.

    Parameters
    ----------
    folder : str or Path
        With grey images of 8 bit.
    rate : float or None, frames a second
        Pace; None gives each image as soon as it is asked for.

    Raises
    ------
    OSError
        If there is no such folder, or no image in it; later, if an image is damaged.
    ValueError
        If the rate is not positive.
    """
    _check_rate(rate)
    return ImageSequence(str(folder), map(read_grey, image_paths(folder)), rate)


def image_paths(folder: str | Path) -> list[Path]:
    """Return the images of a folder, in the order of the numbers in their names.

    Raises
    ------
    OSError
        If there is no such folder, or no image in it.
    """
    folder = Path(folder)
    if not folder.is_dir():
        raise OSError(f"folder {folder} does not exist; check the path")
    paths = sorted((p for p in folder.iterdir() if p.suffix.lower() in SUFFIXES), key=_in_order)
    if not paths:
        raise OSError(f"folder {folder} holds no images; PNG, TIFF, BMP and JPEG are read")
    return paths


def open_files(
    pattern: str | Path, rate: float | None = None, times: str | Path | None = None
) -> ImageSequence:
    """Open the images that a pattern of names finds, in the order of the numbers in them.

    Parameters
    ----------
    pattern : str or Path
        Such as ``frames/cam0_*.png``; ``*`` stands for any letters, ``?`` for one, ``**`` for any
        folders.
    rate : float or None, frames a second
        Pace; None gives each image as soon as it is asked for.
    times : str or Path or None
        CSV file that says when each image was taken, see `read_times`; it overrules the rate.

    Raises
    ------
    OSError
        If there is no such image or file; later, if an image is damaged.
    ValueError
        If the rate is not positive, or the times do not fit the images.
    """
    _check_rate(rate)
    paths = named_images(pattern)
    given = read_times(times, len(paths)) if times is not None else None
    return ImageSequence(str(pattern), map(read_grey, paths), rate, times=given)


def named_images(pattern: str | Path) -> list[Path]:
    """Return the images that a pattern of names finds, in the order of the numbers in them.

    Raises
    ------
    OSError
        If there is none.
    """
    base = Path(Path(pattern).anchor)
    found = base.glob(str(Path(pattern).relative_to(base)))
    paths = sorted((path for path in found if path.suffix.lower() in SUFFIXES), key=_in_order)
    if not paths:
        raise OSError(f"no image is called '{pattern}'; PNG, TIFF, BMP and JPEG are read")
    return paths


def read_times(path: str | Path, count: int) -> list[float]:
    """Read when images were taken: one line each, in s, in the first column or that of `time_s`.

    Raises
    ------
    OSError
        If the file cannot be read.
    ValueError
        If it has another number of lines than `count`, or times that do not grow.
    """
    try:
        with Path(path).open(newline="", encoding="utf-8") as file:
            lines = [line for line in csv.reader(file) if line]
    except FileNotFoundError:
        raise OSError(f"file {path} of the times does not exist; check the path") from None
    except UnicodeDecodeError:
        raise ValueError(f"file {path} of the times is no text; save it as CSV in UTF-8") from None
    column = lines[0].index("time_s") if lines and "time_s" in lines[0] else 0
    rows = lines[1:] if lines and _number(lines[0], column) is None else lines
    times = [_number(row, column) for row in rows]
    if len(times) != count:
        raise ValueError(
            f"file {path} has {len(times)} times and there are {count} images; give one each"
        )
    found = [time for time in times if time is not None and isfinite(time)]
    if len(found) != count or any(late <= early for early, late in pairwise(found)):
        raise ValueError(f"times of file {path} must be numbers in s that grow; correct them there")
    return found


def _number(row: list[str], column: int) -> float | None:
    try:
        return float(row[column])
    except (ValueError, IndexError):
        return None


def open_video(path: str | Path, rate: float | None = None) -> ImageSequence:
    """Open a video file; its colours become brightness. Parameters as in `open_folder`.

    Raises
    ------
    OSError
        If the file does not exist or holds no video that OpenCV reads.
    ValueError
        If the rate is not positive.
    """
    import cv2

    from rig.camera.quiet import quiet

    _check_rate(rate)
    if not Path(path).is_file():
        raise OSError(f"video {path} does not exist; check the path")
    with quiet():
        capture = cv2.VideoCapture(str(path), cv2.CAP_FFMPEG)
    if not capture.isOpened():
        raise OSError(f"{path} is no video that can be read; convert it to AVI or MP4")

    def images() -> Iterator[NDArray[np.uint8]]:
        while True:
            there, colour = capture.read()
            if not there:
                return capture.release()
            yield np.asarray(cv2.cvtColor(colour, cv2.COLOR_BGR2GRAY), np.uint8)

    return ImageSequence(str(path), images(), rate)


def _check_rate(rate: float | None) -> None:
    if rate is not None and not rate > 0:
        raise ValueError(f"rate must be positive, got {rate:g} frames a second; give 30 or None")


def _in_order(path: Path) -> list[str | int]:
    """Sorting key: frame 9 comes before frame 10."""
    return [int(part) if part.isdigit() else part for part in re.split(r"(\d+)", path.name)]


def read_grey(path: Path) -> NDArray[np.uint8]:
    """Read an image of 8 bit, (H, W) uint8; an OSError says why it is none."""
    try:
        image = dic.read_image(path)
    except ValueError as error:  # in colour, say
        raise OSError(str(error)) from None
    if image.dtype != np.uint8:
        raise OSError(f"image {path} has {image.dtype} values; convert it to 8 bit")
    return image
