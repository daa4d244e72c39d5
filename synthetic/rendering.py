"""Exact images of a deformed plate: every sample is points up on the plate, none in an image."""

from itertools import product

import numpy as np
from numpy.random import Generator

from synthetic.arrays import F64, AnyArray
from synthetic.exposure import Exposure
from synthetic.inverse import Displacement, invert
from synthetic.pattern import Pattern
from synthetic.points import at_height
from synthetic.sensor import Sensor
from synthetic.telecentric import AnyCamera

# A blurred image is made of light at so many places a side of a pixel: off by 0.002 grey levels
# of 255, by 0.016 at worst.
BLUR_PLACES = 4
# Arrays of this many rows stay in the cache of a core.
STRIP_ROWS = 16


def render(
    pattern: Pattern,
    camera: AnyCamera,
    displacement: Displacement | None,
    sensor: Sensor | None,
    rng: Generator | None,
    z: float = 0.0,
    samples: int = 4,
    exposure: Exposure | None = None,
) -> AnyArray:
    """Take an image of the deformed plate.

    A pixel is the mean light over its square, by `samples` × `samples` Gauss-Legendre points. For
    each of them the material point that is seen there is found on the deformed face, to 1e-4 px.

    Parameters
    ----------
    displacement : maps (K, 2) mm plate points to (K, 3) mm displacement of the face; None for the
        plate at rest. It is asked for points of the plate alone.
    sensor : None returns 255 × light as float64, neither quantised nor noisy.
    rng : source of the noise; None takes an image without noise.
    z : height of the seen face over the plate's middle plane, mm: `camera.face_height(thickness)`.
    samples : points a side of a pixel. With 4 the pixels of the default speckle are off by 0.01
        grey levels of 255 (standard deviation); edges of spots below 2 px need 5. Not used where
        the exposure blurs.
    exposure : blur, light and what stands before the plate; None for a sharp, evenly lit image.

    Returns
    -------
    (H, W) uint8, uint16 or float64, grey levels.

    Raises
    ------
    ValueError
        The plate lies outside the image or is not before the camera, the displacement is of
        wrong shape, not finite or jumps, or the deformed plate hides parts of itself.
    """
    optics = exposure.optics if exposure is not None else None
    if optics is not None and optics.reach > 0:
        border = optics.reach
        fine = mean_light(pattern, camera, displacement, z, 1, BLUR_PLACES, border)
        inside = slice(border * BLUR_PLACES, -border * BLUR_PLACES, BLUR_PLACES)
        light = optics.blur(fine, BLUR_PLACES)[inside, inside]
    else:
        light = mean_light(pattern, camera, displacement, z, samples)
    if exposure is not None:
        light = exposure.apply(light, camera, z, rng)
    return 255 * light if sensor is None else sensor.capture(light, rng)


def mean_light(
    pattern: Pattern,
    camera: AnyCamera,
    displacement: Displacement | None,
    z: float,
    samples: int,
    places: int = 1,
    border: int = 0,
) -> F64:
    """Mean light over pixels, as `render` sees it, and over the same squares between pixels.

    Parameters
    ----------
    samples : points a side of the square; 1 for the light in its middle.
    places : squares for each pixel in each direction, from its own middle on.
    border : pixels added on each side of the image.

    Returns
    -------
    ((H + 2 border) places, (W + 2 border) places) float64, 0 to 1.
    """
    check_in_view(camera, pattern.speckle.size, z)
    inverse = None
    if displacement is not None:
        inverse = invert(camera, displacement, pattern.speckle.size, z, border)
    width, height = (length + 2 * border for length in camera.size)
    weights, offsets = _samples(samples, places)
    light = np.ones((height, places, width, places))  # the bare ground
    for first in range(0, height, STRIP_ROWS):
        strip = light[first : first + STRIP_ROWS]
        y, x = (part.ravel() - border for part in np.indices((len(strip), width)))
        pixels = np.column_stack([x, y + first]).astype(np.float64)
        if inverse is None:
            covered = np.ones(len(pixels), dtype=bool)
            points = (camera.on_plate(pixels + offset, z) for offset in offsets)
        else:
            covered = inverse.covers(pixels)
            points = inverse.follow(pixels[covered], offsets)
        mean = _mean(weights, [pattern.intensity(points) for points in points])
        inside = covered.reshape(len(strip), width)
        strip.transpose(1, 3, 0, 2)[:, :, inside] = mean.reshape(places, places, -1)
    return light.reshape(height * places, width * places)


def _samples(count: int, places: int) -> tuple[F64, F64]:
    """Weights (count²,) and offsets (places² count², 2) px of the Gauss-Legendre points."""
    nodes, weights = np.polynomial.legendre.leggauss(count)
    within, between = (
        np.stack(np.meshgrid(line, line), axis=-1).reshape(-1, 2)
        for line in (nodes / 2, np.arange(places) / places)
    )
    offsets = between[:, None] + within
    return np.outer(weights, weights).ravel() / 4, offsets.reshape(-1, 2)


def _mean(weights: F64, light: list[F64]) -> F64:
    """Mean of groups of images (K,) by weights: (groups, K)."""
    groups = [light[first : first + len(weights)] for first in range(0, len(light), len(weights))]
    return np.array([weights @ np.array(group) for group in groups])


def check_in_view(camera: AnyCamera, size: tuple[float, float], z: float) -> None:
    """Raise ValueError when no part of the plate can be in the image."""
    corners = np.array(list(product((0, size[0]), (0, size[1]))), dtype=np.float64)
    px = camera.project(at_height(corners, z))
    if np.any(px.max(axis=0) < 0) or np.any(px.min(axis=0) > np.array(camera.size) - 1):
        raise ValueError(
            f"the plate lies outside the image of {camera.size} px: its corners are seen from "
            f"{px.min(axis=0).round().tolist()} to {px.max(axis=0).round().tolist()} px; "
            "turn the camera to the plate"
        )
