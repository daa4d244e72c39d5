"""A field of a whole test over its reference: a plot a frame, or a video, on one scale."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import cv2
import numpy as np

from dic import export
from rig.series.read import SeriesResult
from rig.system.arrays import AnyArray

CODEC, RATE = "mp4v", 10.0  # frames/s
_SAMPLED = 40  # frames that the limits of the colours are taken from


def to_png(
    result: SeriesResult, folder: Path, field: str, report: Callable[[int, int], None]
) -> list[Path]:
    """Draw a field with its colour bar, a PNG a frame; the colours are those of all frames."""
    paths: list[Path] = []
    for number, plot in enumerate(_plots(result, field, report)):
        paths.append(folder / f"{field}-{number:06d}.png")
        if not cv2.imwrite(str(paths[-1]), plot):
            raise OSError(f"plot '{paths[-1]}' cannot be written; check whether the disk is full")
    return paths


def to_mp4(
    result: SeriesResult, folder: Path, field: str, report: Callable[[int, int], None]
) -> list[Path]:
    """Draw a field with its colour bar as a video of ten frames a second."""
    path, video = folder / f"{field}.mp4", None
    for plot in _plots(result, field, report):
        even = plot[: plot.shape[0] // 2 * 2, : plot.shape[1] // 2 * 2]  # what the codec takes
        if video is None:
            size = even.shape[1], even.shape[0]
            video = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*CODEC), RATE, size)
            if not video.isOpened():
                raise OSError(f"video '{path}' cannot be written with codec {CODEC}; export as png")
        video.write(even)
    if video is not None:
        video.release()
    return [path]


def _plots(
    result: SeriesResult, field: str, report: Callable[[int, int], None]
) -> Iterator[AnyArray]:
    """Draw all frames in turn, (H, W, 3) uint8 BGR."""
    limits = limits_of(result, field)
    for number in range(len(result.names)):
        yield paint_frame(result, field, number, limits)
        report(number + 1, len(result.names))


def paint_frame(
    result: SeriesResult, field: str, number: int, limits: tuple[float, float]
) -> AnyArray:
    """Draw a field of one frame with its colour bar, (H, W, 3) uint8 BGR."""
    values = result.field(field, number).ravel().astype(np.float64)
    if field == "status":  # a frame that was left out has none
        values[values < 0] = np.nan
    name = result.names[number]
    drawn = export.paint(result.image, field, values, result.grid, limits, name)
    return np.ascontiguousarray(drawn[..., ::-1])


def limits_of(result: SeriesResult, field: str) -> tuple[float, float]:
    """Return limits for the colours of a field over all frames, in the unit that it is drawn in."""
    count = len(result.names)
    numbers = np.unique(np.linspace(0, count - 1, min(count, _SAMPLED)).astype(int))
    values = np.concatenate([result.field(field, n).ravel() for n in numbers.tolist()])
    return export.colour_limits(field, values)
