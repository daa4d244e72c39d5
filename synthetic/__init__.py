"""What a camera would see: speckle, camera, light and sensor, with exact truth."""

from importlib import import_module
from typing import TYPE_CHECKING

from synthetic.camera import Camera, pinhole_above
from synthetic.view import motion, rigid, seen

if TYPE_CHECKING:
    from synthetic.sensor import Sensor

__all__ = ["Camera", "Sensor", "motion", "pinhole_above", "rigid", "seen"]

# An estimator needs the camera alone: what compiles kernels is imported when it is first asked for.
_LATER = {"Sensor": "synthetic.sensor"}


def __getattr__(name: str):
    if name not in _LATER:
        raise AttributeError(f"module 'synthetic' has no attribute {name!r}")
    return getattr(import_module(_LATER[name]), name)
