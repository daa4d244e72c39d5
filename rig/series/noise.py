"""Noise of the images of a test, from what a reference and a frame leave over of each other."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

import dic
from rig.system.arrays import AnyArray

_SUBSET = 31  # px: large enough for a dim image
_ALONG = 18  # points along the shorter side of the image
_FEWEST = 12  # points from which a median is taken


@dataclass(frozen=True)
class ImageNoise:
    """Noise of the images of a test.

    Attributes
    ----------
    level : float, grey levels
        Standard deviation.
    source : str
        What it was measured from.
    """

    level: float
    source: str


def image_noise(reference: AnyArray, frame: AnyArray | None, name: str) -> ImageNoise:
    """Measure the noise of images between a reference and a frame called `name`.

    Where there is no frame, or the pattern is not found again in it, the spectrum of the reference
    must do, and the source says so.

    Raises
    ------
    ValueError
        The reference cannot be used.
    """
    if frame is not None and frame.shape == reference.shape:
        try:
            level = noise_between(reference, frame)
        except ValueError:  # the frame is of no use; the reference has its say below
            level = float("nan")
        if np.isfinite(level):
            return ImageNoise(level, f"from what {name} leaves over")
    spectrum = dic.prepare(reference).prefilter.noise
    return ImageNoise(spectrum, "a lower bound, from the spectrum of the reference alone")


def noise_between(reference: AnyArray, frame: AnyArray) -> float:
    """Measure the standard deviation of the noise of two images of one pattern, grey levels.

    Some subsets are followed from one image to the other, and the σ that the residual of each
    gives is compared with that of a noise of one grey level. So all that the frame differs by
    counts: noise of the camera, light, and what no subset can follow, as the edges of a sharp
    print. The spectrum of the reference, which stands in where there is no frame, gives a lower
    bound: it takes as much for pattern as a pattern may have.

    Returns
    -------
    float
        NaN where too few subsets are found again.

    Raises
    ------
    ValueError
        An image cannot be used, or they differ in size.
    """
    side = min(_SUBSET, min(reference.shape) // 4 * 2 - 1)
    ref = dic.prepare(reference, max(side, 5), max(min(reference.shape) // _ALONG, 5))
    found = dic.correlate(ref, frame)
    if np.count_nonzero(found.valid) < _FEWEST:
        return float("nan")
    bias = ref.prefilter.bias**2
    unit = dic.expected_sigma(ref, 1.0)[found.valid] ** 2 - bias
    stated = np.column_stack([found.sigma_u, found.sigma_v])[found.valid] ** 2 - bias
    return float(np.sqrt(np.nanmedian(np.maximum(stated, 0) / unit)))
