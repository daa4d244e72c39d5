"""A deformed image as the points of a reference read it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dic.arrays import AnyArray
from dic.images.prefilter import Prefilter
from dic.images.spline import prefilter


@dataclass(frozen=True)
class DeformedImage:
    """A deformed image.

    Attributes
    ----------
    image : (H, W), grey levels
        As it came.
    pixels : (H, W), or (H + 2 PAD, W + 2 PAD) float32
        The image, of which the parts around the points pass the prefilter and are turned into
        coefficients where they are read; or, if `filtered`, its coefficients.
    filtered : bool
    """

    image: AnyArray
    pixels: AnyArray
    filtered: bool


def read_parts(image: AnyArray) -> DeformedImage:
    """Make a frame of which only the parts around points are read."""
    pixels = image if image.dtype == np.uint8 else image.astype(np.float32)
    return DeformedImage(image, pixels, False)


def read_whole(image: AnyArray, gaussian: Prefilter) -> DeformedImage:
    """Make a frame of which all is read."""
    smooth = gaussian.apply(image)
    grey = np.subtract(smooth, smooth.mean(dtype=np.float64), dtype=np.float32)
    return DeformedImage(image, prefilter(grey), True)
