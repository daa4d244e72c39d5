"""The scale of `touchplate correlate`: from `--scale` or `--board`, `--camera`, or both."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import synthetic
    from rig.calibration.board import CharucoBoard
    from rig.series.scale import Scale

_LENGTH = r"\s*(\d*\.?\d+)\s*"
_BOARD = re.compile(rf"(.+)=\s*(\d+)x(\d+)\s*,{_LENGTH},{_LENGTH}mm\s*")


def scale_of(
    text: str | None, board: str | None, camera: Path | None, shape: tuple[int, ...]
) -> Scale | None:
    """Return the scale of images (H, W); None where none is named.

    Two points alone scale the image, and a board in an image the plane that it lies on; with a
    camera the distortion of its lens is taken out first; a camera alone needs its pose over the
    plate.

    Raises
    ------
    OSError, ValueError
        A file that cannot be used, a camera of other images, or a scale that is none.
    """
    if text is None and board is None and camera is None:
        return None
    from rig.series.scale import PlatePlane, two_points

    if text is not None and board is not None:
        raise ValueError("--scale and --board both scale the images; leave out one")
    lens, posed = (None, False) if camera is None else _camera(camera, shape)
    if text is not None:
        return two_points(text, lens)
    if board is not None:
        return _on_board(board, lens, shape)
    if camera is None or lens is None:
        return None
    if not posed:
        raise ValueError(
            f"'{camera}' holds no pose of the plate; run `touchplate calibrate pose`, or give two"
            " points with --scale"
        )
    return PlatePlane(lens, f"lens and pose of {camera.name}")


def _on_board(text: str, lens: synthetic.Camera | None, shape: tuple[int, ...]) -> Scale:
    """Find the plane on which an image shows a board."""
    import cv2
    import numpy as np

    from rig.series.photograph import read_photograph
    from rig.series.scale import board_plane

    path, board = _board(text)
    image = read_photograph(path)
    if image.shape != shape:
        raise ValueError(
            f"'{path}' has {image.shape[1]}x{image.shape[0]} px and the reference"
            f" {shape[1]}x{shape[0]} px; both must come from one camera setting"
        )
    grey = np.empty(image.shape, np.uint8)  # all that the detector takes
    cv2.normalize(image, grey, 0, 255, cv2.NORM_MINMAX, cv2.CV_8U)
    view = board.find(grey)
    if view is None:
        mirrored = " but in a mirror" if board.is_mirrored(grey) else ""
        columns, rows = board.squares
        raise ValueError(
            f"'{path}' shows no board of {columns} × {rows} squares{mirrored}; light it evenly, or"
            f" say what was printed, such as --board '{path.name}=9x6,12,9 mm'"
        )
    return board_plane(view.mm, view.px, lens, path.name)


def _board(text: str) -> tuple[Path, CharucoBoard]:
    """Read ``IMAGE`` or ``IMAGE=COLUMNSxROWS,SQUARE,MARKER mm``; the board printed as it comes."""
    from rig.calibration.board import CharucoBoard

    found = _BOARD.fullmatch(text)
    if found is None:
        return Path(text), CharucoBoard()
    image, columns, rows, square, marker = found.groups()
    return Path(image), CharucoBoard((int(columns), int(rows)), float(square), float(marker))


def _camera(path: Path, shape: tuple[int, ...]) -> tuple[synthetic.Camera, bool]:
    """Camera of a calibration, at its pose or, where that is not known, at none."""
    import numpy as np

    from rig.calibration.store import read_calibration

    if not path.is_file():
        raise FileNotFoundError(f"calibration '{path}' does not exist; check the path")
    calibration = read_calibration(path)
    camera = calibration.camera()
    lens = camera or calibration.known_lens().camera(np.eye(4))
    height, width = shape[:2]
    if lens.size != (width, height):
        raise ValueError(
            f"'{path}' is of images of {lens.size[0]}x{lens.size[1]} px and the reference has"
            f" {width}x{height} px; calibrate the lens at this size"
        )
    return lens, camera is not None
