"""What a camera would see: speckle, camera, light and sensor, with exact truth."""

from importlib import import_module
from typing import TYPE_CHECKING

from synthetic.camera import Camera, pinhole_above
from synthetic.distortion import Distortion
from synthetic.pose import looking, turned
from synthetic.telecentric import AnyCamera, Telecentric, telecentric_above
from synthetic.view import motion, rigid, seen

if TYPE_CHECKING:
    from synthetic import formulas
    from synthetic.batch import BatchWarper, prepare_batch
    from synthetic.exposure import Exposure
    from synthetic.gauges import Gauges, displacement_gauges, strain_gauges, texture_at
    from synthetic.hand import Hand
    from synthetic.light import Light, polynomial_light, projected_discs
    from synthetic.optics import Optics
    from synthetic.pattern import Pattern, Speckle, speckle
    from synthetic.printing import print_pattern
    from synthetic.rendering import render
    from synthetic.sensor import Sensor
    from synthetic.warp import Warper, prepare_warp

# An estimator needs the camera alone: what compiles kernels is imported when it is first asked for.
_HOMES = {
    "batch": ("BatchWarper", "prepare_batch"),
    "exposure": ("Exposure",),
    "gauges": ("Gauges", "displacement_gauges", "strain_gauges", "texture_at"),
    "hand": ("Hand",),
    "light": ("Light", "polynomial_light", "projected_discs"),
    "optics": ("Optics",),
    "pattern": ("Pattern", "Speckle", "speckle"),
    "printing": ("print_pattern",),
    "rendering": ("render",),
    "sensor": ("Sensor",),
    "warp": ("Warper", "prepare_warp"),
}
_HOME_OF = {name: module for module, names in _HOMES.items() for name in names}

__all__ = [
    "AnyCamera",
    "BatchWarper",
    "Camera",
    "Distortion",
    "Exposure",
    "Gauges",
    "Hand",
    "Light",
    "Optics",
    "Pattern",
    "Sensor",
    "Speckle",
    "Telecentric",
    "Warper",
    "displacement_gauges",
    "formulas",
    "looking",
    "motion",
    "pinhole_above",
    "polynomial_light",
    "prepare_batch",
    "prepare_warp",
    "print_pattern",
    "projected_discs",
    "render",
    "rigid",
    "seen",
    "speckle",
    "strain_gauges",
    "telecentric_above",
    "texture_at",
    "turned",
]


def __getattr__(name: str):
    if name == "formulas":
        return import_module("synthetic.formulas")
    if name not in _HOME_OF:
        raise AttributeError(f"module 'synthetic' has no attribute {name!r}")
    return getattr(import_module(f"synthetic.{_HOME_OF[name]}"), name)
