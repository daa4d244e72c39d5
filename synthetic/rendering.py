"""Exact pictures of a deformed plate: every sample is looked up on the plate, none in a picture."""

from collections.abc import Iterable
from itertools import product

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from synthetic.exposure import Exposure
from synthetic.inverse import Displacement, invert
from synthetic.pattern import Pattern
from synthetic.points import Array, at_height
from synthetic.sensor import Sensor
from synthetic.telecentric import AnyCamera

# A blurred picture is made of light at so many places a side of a pixel: off by 0.002 grey levels
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
) -> NDArray:
    """Take a picture of the deformed plate.

    A pixel is the mean light over its square, by `samples` × `samples` Gauss-Legendre points. For
    each of them the material point that is seen there is found on the deformed face, to 1e-4 px.

    Parameters
    ----------
    displacement : maps (K, 2) mm plate points to (K, 3) mm displacement of the face; None for the
        plate at rest. It is asked for points of the plate alone.
    sensor : None returns 255 × light as float64, neither quantised nor noisy.
    rng : source of the noise; None takes a picture without noise.
    z : height of the face over the plate's middle plane, mm; half the thickness.
    samples : points a side of a pixel. With 4 the pixels of the default speckle are off by 0.01
        grey levels of 255 (standard deviation); edges of spots below 2 px need 5. Not used where
        the exposure blurs.
    exposure : blur, light and what stands before the plate; None for a sharp, evenly lit picture.

    Returns
    -------
    (H, W) uint8, uint16 or float64, grey levels.

    Raises
    ------
    ValueError
        The plate lies outside the picture or is not before the camera, the displacement is of
        wrong shape, not finite or jumps, or the deformed plate hides parts of itself.
    """
    optics = exposure.optics if exposure is not None else None
    if optics is not None and optics.reach > 0:
        border = optics.reach
        fine = fine_light(pattern, camera, displacement, z, BLUR_PLACES, 1, border)
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
    samples: int = 4,
    offset: tuple[float, float] = (0.0, 0.0),
    border: int = 0,
) -> Array:
    """Mean light over pixels, as `render` sees it.

    Parameters
    ----------
    offset : moves all pixels by (x, y) px.
    border : pixels added on each side of the picture.

    Returns
    -------
    (H + 2 border, W + 2 border) float64, 0 to 1.
    """
    check_in_picture(camera, pattern.speckle.size, z)
    inverse = None
    if displacement is not None:
        inverse = invert(camera, displacement, pattern.speckle.size, z, border)
    width, height = camera.size
    columns, rows = np.arange(-border, width + border), np.arange(-border, height + border)
    weights, offsets = _samples(samples)
    offsets = offsets + offset
    light = np.ones((len(rows), len(columns)))  # the bare ground
    for first in range(0, len(rows), STRIP_ROWS):
        strip = slice(first, first + STRIP_ROWS)
        x, y = np.meshgrid(columns, rows[strip])
        pixels = np.column_stack([x.ravel(), y.ravel()]).astype(np.float64)
        if inverse is None:
            looked = (camera.on_plate(pixels + o, z) for o in offsets)
            light[strip] = _mean(pattern, weights, looked).reshape(x.shape)
        else:
            covered = inverse.covers(pixels)
            looked = inverse.follow(pixels[covered], offsets)
            light[strip][covered.reshape(x.shape)] = _mean(pattern, weights, looked)
    return light


def fine_light(
    pattern: Pattern,
    camera: AnyCamera,
    displacement: Displacement | None,
    z: float,
    places: int,
    samples: int,
    border: int,
) -> Array:
    """Light as a function of place, at `places` places a side of a pixel.

    Parameters
    ----------
    samples : points a side, for the mean over a pixel around each place; 1 for the light there.

    Returns
    -------
    ((H + 2 border) places, (W + 2 border) places) float64, 0 to 1.
    """
    width, height = (length + 2 * border for length in camera.size)
    fine = np.empty((height, places, width, places))
    for i, j in product(range(places), repeat=2):
        offset = (j / places, i / places)
        fine[:, i, :, j] = mean_light(pattern, camera, displacement, z, samples, offset, border)
    return fine.reshape(height * places, width * places)


def _samples(count: int) -> tuple[Array, Array]:
    """Weights (count²,) and offsets (count², 2) px of the Gauss-Legendre points of a pixel."""
    places, weights = np.polynomial.legendre.leggauss(count)
    y, x = np.meshgrid(places / 2, places / 2, indexing="ij")
    return np.outer(weights, weights).ravel() / 4, np.column_stack([x.ravel(), y.ravel()])


def _mean(pattern: Pattern, weights: Array, looked: Iterable[Array]) -> Array:
    light = [w * pattern.intensity(points) for w, points in zip(weights, looked, strict=True)]
    return np.sum(light, axis=0)


def check_in_picture(camera: AnyCamera, size: tuple[float, float], z: float) -> None:
    """Raise ValueError when no part of the plate can be in the picture."""
    corners = np.array(list(product((0, size[0]), (0, size[1]))), dtype=np.float64)
    px = camera.project(at_height(corners, z))
    if np.any(px.max(axis=0) < 0) or np.any(px.min(axis=0) > np.array(camera.size) - 1):
        raise ValueError(
            f"the plate lies outside the picture of {camera.size} px: its corners are seen from "
            f"{px.min(axis=0).round().tolist()} to {px.max(axis=0).round().tolist()} px; "
            "turn the camera to the plate"
        )
