"""Exact pictures of a deformed plate: every sample is looked up on the plate, none in a picture."""

from collections.abc import Callable
from itertools import product

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from synthetic.pattern import Pattern
from synthetic.points import Array, at_height
from synthetic.sensor import Sensor
from synthetic.telecentric import AnyCamera

Displacement = Callable[[Array], Array]

# A ray is followed until its plate point is seen this close to the pixel it belongs to.
TOLERANCE_PX = 1e-4
# The iteration gains the slope of the plate a step, 1e-2 at most for a plate that bends; a map
# that needs more steps than these is about to fold.
MOST_STEPS = 60
# A fold is looked for on a grid of this many cells a side of the plate.
FOLD_CELLS = 200
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
) -> NDArray:
    """Take a picture of the deformed plate.

    A pixel is the mean light over its square, by `samples` × `samples` Gauss-Legendre points. For
    each of them the material point that is seen there is found on the deformed face.

    Parameters
    ----------
    displacement : maps (K, 2) mm plate points to (K, 3) mm displacement of the face; None for the
        plate at rest. It is asked for points of the plate alone.
    sensor : None returns 255 × light as float64, neither quantised nor noisy.
    rng : source of the noise; None takes a picture without noise.
    z : height of the face over the plate's middle plane, mm; half the thickness.
    samples : points a side of a pixel. With 4 the pixels of the default speckle are off by 0.01
        grey levels of 255 (standard deviation).

    Returns
    -------
    (H, W) uint8, uint16 or float64, grey levels.

    Raises
    ------
    ValueError
        The plate lies outside the picture or is not before the camera, the displacement is of
        wrong shape or not finite, or the deformed plate hides parts of itself.
    """
    light = mean_light(pattern, camera, displacement, z, samples)
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
    if displacement is not None:
        _check_unfolded(camera, displacement, pattern.speckle.size, z)
    (width, height), (dx, dy) = camera.size, offset
    columns, rows = np.arange(-border, width + border), np.arange(-border, height + border)
    light = np.empty((len(rows), len(columns)))
    for first in range(0, len(rows), STRIP_ROWS):
        strip = slice(first, first + STRIP_ROWS)
        x, y = np.meshgrid(columns + dx, rows[strip] + dy)
        pixels = np.column_stack([x.ravel(), y.ravel()]).astype(np.float64)
        mean = _mean_light(pattern, camera, displacement, pixels, z, samples)
        light[strip] = mean.reshape(-1, len(columns))
    return light


def _mean_light(
    pattern: Pattern,
    camera: AnyCamera,
    displacement: Displacement | None,
    pixels: Array,
    z: float,
    samples: int,
) -> Array:
    places, weights = np.polynomial.legendre.leggauss(samples)
    light, moved = np.zeros(len(pixels)), np.zeros((len(pixels), 3))
    for i, j in product(range(samples), repeat=2):
        px = pixels + np.array([places[j] / 2, places[i] / 2])
        if displacement is None:
            points = camera.on_plate(px, z)
        else:
            # The displacement at the last sample is a start that is off by its slope alone.
            points, moved = _material_points(pattern, camera, displacement, px, z, moved)
        light += weights[i] * weights[j] / 4 * pattern.intensity(points)
    return light


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


def _material_points(
    pattern: Pattern,
    camera: AnyCamera,
    displacement: Displacement,
    px: Array,
    z: float,
    moved: Array,
) -> tuple[Array, Array]:
    """Material points X with project(X + U(X)) = px, and their displacement U(X).

    Follows the ray of the pixel to the height at which its material point now lies and goes
    back by the in-plane displacement. Converges where the deformed face does not hide itself.
    """
    reach = TOLERANCE_PX * camera.scale
    points, step = camera.on_plate(px, z + moved[:, 2]) - moved[:, :2], np.inf
    for _ in range(MOST_STEPS):
        moved = _displaced(displacement, np.clip(points, 0, pattern.speckle.size))
        before, points = points, camera.on_plate(px, z + moved[:, 2]) - moved[:, :2]
        step = np.abs(points - before).max()
        if step < reach:
            return points, moved
    raise ValueError(
        f"plate points behind the pixels must be found in {MOST_STEPS} steps, the last one still "
        f"moved them by {step:.3g} mm; use a smaller displacement"
    )


def _check_unfolded(
    camera: AnyCamera, displacement: Displacement, size: tuple[float, float], z: float
) -> None:
    """Raise ValueError when a part of the deformed face turns its back to the camera."""
    places = [np.linspace(0, length, FOLD_CELLS + 1) for length in size]
    points = np.stack(np.meshgrid(*places), axis=-1).reshape(-1, 2)
    rest = at_height(points, z)
    turned = _areas(camera, rest) * _areas(camera, rest + _displaced(displacement, points)) <= 0
    if turned.any():
        raise ValueError(
            f"the displacement folds the picture in {turned.mean():.2%} of the plate; "
            "use a smaller displacement"
        )


def _areas(camera: AnyCamera, points: Array) -> Array:
    """Signed areas of the cells of a square grid of points in the picture, px²."""
    px = camera.project(points).reshape(FOLD_CELLS + 1, FOLD_CELLS + 1, 2)
    (ux, uy), (vx, vy) = (px[1:, 1:] - px[:-1, :-1]).T, (px[1:, :-1] - px[:-1, 1:]).T
    return (ux * vy - uy * vx) / 2


def _displaced(displacement: Displacement, points: Array) -> Array:
    moved = np.asarray(displacement(points), dtype=np.float64)
    if moved.shape != (len(points), 3):
        raise ValueError(
            f"displacement must return ({len(points)}, 3) mm for ({len(points)}, 2) mm points, "
            f"got {moved.shape}"
        )
    if not np.isfinite(moved).all():
        raise ValueError("displacement must be finite, got NaN or infinite values in mm")
    return moved
