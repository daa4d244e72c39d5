"""The frames of a test: images by a pattern or in a folder, pages of a TIFF, or a video."""

from __future__ import annotations

import re
from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import accumulate
from pathlib import Path
from threading import Lock
from typing import Protocol

import numpy as np

from rig.series.content import digest_of
from rig.series.photograph import Pages, is_coloured, pages_of, read_page, read_photograph
from rig.system.arrays import AnyArray

_TIFF = (".tif", ".tiff")
_IMAGES = {".png", ".tif", ".tiff", ".bmp", ".jpg", ".jpeg", ".pgm"}
_ONE = Pages(1)
_VIDEOS = {".avi", ".mp4", ".mov", ".mkv", ".m4v"}


class Frames(Protocol):
    """Frames that are read one by one, in any order."""

    @property
    def names(self) -> tuple[str, ...]:
        """What each frame is called, in the order in which they were taken."""
        ...

    def read(self, number: int) -> AnyArray:
        """Read a frame (H, W), grey levels; OSError or ValueError in one sentence."""
        ...

    def contents(self) -> tuple[str, ...]:
        """Digest of the file that holds each frame: equal where the frames are the same."""
        ...


@dataclass(frozen=True)
class ImageFiles:
    """Images, a file each; those in colour are read by their luminance."""

    paths: tuple[Path, ...]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the files."""
        return tuple(path.name for path in self.paths)

    def read(self, number: int) -> AnyArray:
        """Read the image of a file."""
        return read_photograph(self.paths[number])

    def contents(self) -> tuple[str, ...]:
        """Digests of the files."""
        return tuple(digest_of(path) for path in self.paths)


@dataclass(frozen=True)
class TiffPages:
    """Pages of one TIFF; of those that it was cut short by, one frame says so."""

    path: Path
    pages: Pages

    @property
    def names(self) -> tuple[str, ...]:
        """Name of the file and number of the page, from 1 on."""
        count = self.pages.whole + self.pages.cut
        return tuple(f"{self.path.name} {n + 1}" for n in range(count))

    def read(self, number: int) -> AnyArray:
        """Read a page."""
        if number >= self.pages.whole:
            raise OSError(
                f"{self.path.name} is cut short after page {self.pages.whole}, those after it are"
                " lost; copy or record it again"
            )
        return read_page(self.path, number)

    def contents(self) -> tuple[str, ...]:
        """Digest of the file, for each page."""
        return (digest_of(self.path),) * len(self.names)


class Joined:
    """Frames of several sources, one after the other."""

    def __init__(self, sources: Sequence[Frames]) -> None:
        self.sources = tuple(sources)
        self._names = tuple(name for source in sources for name in source.names)
        self._first = [0, *accumulate(len(source.names) for source in sources)]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all of them."""
        return self._names

    def read(self, number: int) -> AnyArray:
        """Read a frame of the source that holds it."""
        source = bisect_right(self._first, number) - 1
        return self.sources[source].read(number - self._first[source])

    def contents(self) -> tuple[str, ...]:
        """Digests of all of them."""
        return tuple(digest for source in self.sources for digest in source.contents())


class Video:
    """Frames of a video, read one after the other; colour becomes grey."""

    def __init__(self, path: Path) -> None:
        import cv2

        from rig.camera.quiet import quiet

        self._path, self._lock, self._next = path, Lock(), 0
        with quiet():
            self._video = cv2.VideoCapture(str(path))
        self._count = int(self._video.get(cv2.CAP_PROP_FRAME_COUNT))
        if not self._video.isOpened() or self._count < 1:
            raise OSError(f"{path} is not a video that can be read; convert it to AVI or images")

    @property
    def names(self) -> tuple[str, ...]:
        """Name of the file and number of the frame, from 1 on."""
        return tuple(f"{self._path.name} {n + 1}" for n in range(self._count))

    def read(self, number: int) -> AnyArray:
        """Read a frame."""
        import cv2

        with self._lock:
            if number != self._next:
                self._video.set(cv2.CAP_PROP_POS_FRAMES, number)
            done, image = self._video.read()
            self._next = number + 1
        if not done:
            raise OSError(f"frame {number + 1} of {self._path} cannot be read; convert the video")
        return np.asarray(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY))

    def contents(self) -> tuple[str, ...]:
        """Digest of the file, for each frame."""
        return (digest_of(self._path),) * self._count


def coloured_file(frames: Frames) -> str | None:
    """Name the first file of frames that are read by their luminance; None where there is none.

    What a video is stored as is not known.
    """
    match frames:
        case ImageFiles(paths):
            return next((path.name for path in paths if is_coloured(path)), None)
        case TiffPages(path=path):
            return path.name if is_coloured(path) else None
        case Joined(sources=sources):
            return next((name for one in sources if (name := coloured_file(one))), None)
        case _:
            return None


def open_frames(what: str) -> Frames:
    """Open the frames that a path or a pattern such as ``frames/*.tif`` names.

    Of each TIFF all pages are frames.

    Raises
    ------
    OSError
        Nothing has that name, or it cannot be read.
    """
    path = Path(what)
    if path.is_dir():
        paths = [p for p in path.iterdir() if p.suffix.lower() in _IMAGES]
        if not paths:
            raise FileNotFoundError(
                f"folder '{what}' holds no image; PNG, TIFF, BMP and JPEG are read"
            )
        return _files(paths, what)
    if not path.is_file():
        found = Path(path.anchor).glob(str(path.relative_to(path.anchor)))
        return _files([p for p in found if p.is_file()], what)
    if path.suffix.lower() in _VIDEOS:
        return Video(path)
    return _images([path])


def _files(paths: list[Path], what: str) -> Frames:
    if not paths:
        raise FileNotFoundError(f"no image is called '{what}'; check the folder and the pattern")
    return _images(sorted(paths, key=_in_order))


def _images(paths: list[Path]) -> Frames:
    """Return images as frames, and all pages of those that have several."""
    pages = [pages_of(path) if path.suffix.lower() in _TIFF else _ONE for path in paths]
    if all(one == _ONE for one in pages):
        return ImageFiles(tuple(paths))
    sources = zip(paths, pages, strict=True)
    return Joined([ImageFiles((p,)) if one == _ONE else TiffPages(p, one) for p, one in sources])


def _in_order(path: Path) -> list[tuple[int, str]]:
    """Sort numbers in a name by their value: frame 2 before frame 10."""
    parts = re.split(r"(\d+)", str(path))
    return [(int(part), "") if part.isdigit() else (-1, part) for part in parts]
