"""Photographs that a command reads, and a sentence where one is not taken as it is."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from rig.commands.output import say

if TYPE_CHECKING:
    import numpy as np

    from rig.series.frames import Frames


def read(path: Path) -> np.ndarray:
    """Read an image (H, W); say where its luminance, or its first page, stands for it.

    Raises
    ------
    OSError, ValueError
        It is no image that can be read.
    """
    from rig.series.photograph import is_coloured, pages_of, read_photograph

    image = read_photograph(path)
    if is_coloured(path):
        say(f"{path.name} is stored in colour; its luminance is taken")
    pages = pages_of(path).whole
    if pages > 1:
        say(f"{path.name} has {pages} pages; the first one is taken")
    return image


def read_stills(named: str) -> list[np.ndarray]:
    """Read the image that is the reference, or several of a folder or pattern, in their order.

    Raises
    ------
    OSError, ValueError
        One of them is no image that can be read.
    """
    from rig.series.frames import open_frames

    path = Path(named)
    if not path.is_dir() and (path.exists() or not any(letter in named for letter in "*?[")):
        return [read(path)]
    frames = open_frames(named)
    say_if_coloured(frames)
    stills = [frames.read(number) for number in range(len(frames.names))]
    for name, still in zip(frames.names, stills, strict=True):
        _require_size(still, name, stills[0], frames.names[0])
    if len(stills) > 1:
        say(f"the reference is the mean of {len(stills)} images, from {frames.names[0]} on")
    return stills


def _require_size(still: np.ndarray, name: str, first: np.ndarray, first_name: str) -> None:
    """Refuse a still (H, W) that is not of the size of the first."""
    if still.shape != first.shape:
        raise ValueError(
            f"'{name}' is {still.shape[1]}x{still.shape[0]} px and '{first_name}'"
            f" {first.shape[1]}x{first.shape[0]} px; stills must come from one camera setting"
        )


def say_if_coloured(frames: Frames | None) -> None:
    """Say that the luminance of frames is taken, by the first file that is stored in colour."""
    from rig.series.frames import coloured_file

    if frames is not None and (name := coloured_file(frames)):
        say(f"{name} is stored in colour; of such frames the luminance is taken")
