"""The camera that a stored model was trained for, as its calibration has it."""

from __future__ import annotations

import synthetic
from rig.calibration.store import parse
from rig.scene import Scene


def camera_of(scene: Scene, calibration: str) -> synthetic.AnyCamera | None:
    """Return the camera of a calibration (JSON), where a scene's gauges are read by one like it."""
    if not calibration or scene.camera is None:
        return None
    camera = parse(calibration, "of the model").camera()
    return camera if camera is not None and camera.size == scene.camera.pixels else None
