"""Images of presses, out of a folder, a video or files: those at rest, and the mean of each."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from rig.camera.files import image_paths, named_images, open_video, read_grey
from rig.system.arrays import F32, Grey


@dataclass(frozen=True, eq=False)
class PressImages:
    """What a folder or video holds of a list of presses.

    Attributes
    ----------
    reference : list of (H, W) uint8
        The first images, in which nothing touches the plate.
    means : list of (H, W) float32
        Of the frames of each press.
    """

    reference: list[Grey]
    means: list[F32]


def read_press_images(source: Path, references: int, frames: list[tuple[int, int]]) -> PressImages:
    """Read the first images, and the mean of each press from its first frame to its last.

    Parameters
    ----------
    source : Path
        Folder of grey images of 8 bit, a video, or names of images with ``*`` and ``?``.
    references : int
    frames : list of (int, int)
        First and last of each press, counted from 0 over all images.

    Raises
    ------
    OSError
        If there is no such folder or video, or it has fewer images than are listed.
    """
    ranges = [range(first, last + 1) for first, last in frames]
    reference: list[Grey] = []
    sums: dict[int, F32] = {}
    for number, image in _numbered(source, set(range(references)).union(*ranges)):
        if number < references:
            reference.append(image)
        for press, one in enumerate(ranges):
            if number in one:
                sums[press] = sums.get(press, 0.0) + image.astype(np.float32)
    means = [sums[press] / np.float32(len(one)) for press, one in enumerate(ranges)]
    return PressImages(reference, means)


def ordered_images(folder: Path, last: int) -> list[Path]:
    """Return the images of a folder in the order in which `run` takes them.

    Raises
    ------
    OSError
        If there is no such folder, or it has no image of number `last`.
    """
    return _as_far_as(folder, image_paths(folder), last)


def _as_far_as(source: Path, paths: list[Path], last: int) -> list[Path]:
    if last >= len(paths):
        raise _too_few(source, len(paths), last)
    return paths


def _numbered(source: Path, wanted: Iterable[int]) -> Iterator[tuple[int, Grey]]:
    """Give the images of these numbers, in their order."""
    numbers = sorted(wanted)
    if source.is_file():
        yield from _of_video(source, numbers)
        return
    if source.exists():
        paths = image_paths(source)
    elif any(mark in str(source) for mark in "*?"):
        paths = named_images(source)
    else:
        raise OSError(f"there is no folder or video '{source}'; check the path")
    paths = _as_far_as(source, paths, numbers[-1])
    for number in numbers:
        yield number, read_grey(paths[number])


def _of_video(path: Path, numbers: list[int]) -> Iterator[tuple[int, Grey]]:
    video, chosen = open_video(path), set(numbers)
    for number in range(numbers[-1] + 1):
        try:
            frame = video.read(0.0)
        except EOFError:
            raise _too_few(path, number, numbers[-1]) from None
        if frame is not None and number in chosen:
            yield number, frame.image


def _too_few(source: Path, count: int, last: int) -> OSError:
    return OSError(
        f"'{source}' holds {count} images, counted from 0, and the list names frame {last}; correct"
        " the list"
    )
