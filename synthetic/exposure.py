"""What happens to the light between the plate and the sensor; what is None is left out."""

from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

from synthetic.arrays import F64
from synthetic.light import Light
from synthetic.occluder import Occluder
from synthetic.optics import Optics
from synthetic.telecentric import AnyCamera


@dataclass(frozen=True)
class Exposure:
    """The circumstances of an image.

    Attributes
    ----------
    optics : blur and dark corners, or None for a sharp and even lens.
    light : on the plate, or None for even and steady light.
    occluder : what stands before the plate, as a hand, or None.
    """

    optics: Optics | None = None
    light: Light | None = None
    occluder: Occluder | None = None

    def apply(self, light: F64, camera: AnyCamera, z: float, rng: Generator | None) -> F64:
        """Light up, hide and darken the pixels of an image that is already blurred.

        Light and occluder vary slowly over a pixel: they are taken in its middle, the light where
        that is seen on the plate at rest.

        Parameters
        ----------
        light : (H, W) float64, light of the evenly lit plate, 0 to 1.
        camera, z, rng : as in `render`.

        Returns
        -------
        (H, W) float64, more than 1 where the light is stronger than even light.
        """
        if self.light is not None:
            y, x = np.indices(light.shape, dtype=np.float64)
            points = camera.on_plate(np.column_stack([x.ravel(), y.ravel()]), z)
            light = light * self.light.at(points, rng).reshape(light.shape)
        if self.occluder is not None:
            light = self.occluder.cover(light)
        if self.optics is not None and self.optics.vignetting > 0:
            light = light * self.optics.falloff(camera.size)
        return light
