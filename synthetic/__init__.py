"""What a camera would see: speckle, camera, light and sensor, with exact truth."""

from importlib import import_module
from typing import TYPE_CHECKING

from synthetic.camera import Camera, pinhole_above
from synthetic.distortion import Distortion
from synthetic.pose import looking, turned
from synthetic.telecentric import AnyCamera, Telecentric, telecentric_above
from synthetic.view import motion, rigid, seen

if TYPE_CHECKING:
    from synthetic.pattern import Pattern, Speckle, speckle
    from synthetic.rendering import render
    from synthetic.sensor import Sensor
    from synthetic.warp import Warper, prepare_warp

__all__ = [
    "AnyCamera",
    "Camera",
    "Distortion",
    "Pattern",
    "Sensor",
    "Speckle",
    "Telecentric",
    "Warper",
    "looking",
    "motion",
    "pinhole_above",
    "prepare_warp",
    "render",
    "rigid",
    "seen",
    "speckle",
    "telecentric_above",
    "turned",
]

# An estimator needs the camera alone: what compiles kernels is imported when it is first asked for.
_LATER = {
    "Pattern": "pattern",
    "Sensor": "sensor",
    "Speckle": "pattern",
    "Warper": "warp",
    "prepare_warp": "warp",
    "render": "rendering",
    "speckle": "pattern",
}


def __getattr__(name: str):
    if name not in _LATER:
        raise AttributeError(f"module 'synthetic' has no attribute {name!r}")
    return getattr(import_module(f"synthetic.{_LATER[name]}"), name)
