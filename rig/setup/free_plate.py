"""Whether the plate lies free and still, so that nothing has to be asked of a person."""

from __future__ import annotations

from collections.abc import Sequence

from rig.calibration.board import CharucoBoard
from rig.live.baseline import moved_during_reference
from rig.system.arrays import Grey

FRAMES = 16  # half a second at 30 images a second


def in_the_way(frames: Sequence[Grey], board: CharucoBoard) -> str:
    """Say in a sentence what is in the way of a free plate; empty where nothing is.

    Parameters
    ----------
    frames : sequence of (H, W) uint8
        In a row, four or more.
    board : CharucoBoard
        That lay on the plate.
    """
    if board.find(frames[-1]) is not None:
        return "the board is still in view; take it away"
    if moved_during_reference(frames):
        return "something moves in the image; take your hands off the plate"
    return ""
