"""The scale of `touchplate correlate`: from `--scale`, from `--camera`, or from both."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import synthetic
    from rig.series.scale import Scale


def scale_of(text: str | None, camera: Path | None, shape: tuple[int, ...]) -> Scale | None:
    """Return the scale of images (H, W); None where none is named.

    Two points alone scale the image; with a camera the distortion of its lens is taken out first;
    a camera alone needs its pose over the plate.

    Raises
    ------
    OSError, ValueError
        A file that cannot be used, a camera of other images, or a scale that is none.
    """
    if text is None and camera is None:
        return None
    from rig.series.scale import PlatePlane, two_points

    if camera is None:
        return None if text is None else two_points(text, None)
    lens, posed = _camera(camera, shape)
    if text is not None:
        return two_points(text, lens)
    if not posed:
        raise ValueError(
            f"'{camera}' holds no pose of the plate; run `touchplate calibrate pose`, or give two"
            " points with --scale"
        )
    return PlatePlane(lens, f"lens and pose of {camera.name}")


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
