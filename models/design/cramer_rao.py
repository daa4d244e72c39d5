"""The Cramér-Rao bound: how well any estimator can do with the pixels of one frame."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

import fe
import synthetic
from dic import prepare_tiles, spline_coefficients, spline_gradient
from models.arrays import F64
from models.forward.tile_pattern import (
    TilePattern,
    prepare_motions,
    prepare_pattern,
)
from models.inverse.levenberg_marquardt import covariance

PIXELS = 4  # side of the tiles over which motion counts as constant, px
_NUDGE, _SIGNS = 0.1, (1.0, -1.0)  # mm by which a touch is moved for a derivative
_FINER = 2  # elements in the place of one: what a place changes is steeper than what a force does


def pixel_level(
    modes: fe.Modes,
    camera: synthetic.AnyCamera,
    height: float,
    image: F64,
    moves: Callable[[synthetic.AnyCamera, F64], F64] = synthetic.rigid_motion_basis,
) -> TilePattern:
    """Information of every pixel, with motion resolved over 4 px.

    Parameters
    ----------
    image : (H, W) float64, grey levels
        The undeformed pattern without noise.
    moves : callable
        ImageMotions of the camera that are unknown: see `prepare_motions`.
    """
    reference = prepare_tiles(image, size=PIXELS)
    motions = prepare_motions(modes, camera, height, reference.tiles, moves=moves)
    return prepare_pattern(motions, reference)


def cramer_rao(pattern: TilePattern, touches: F64, noise: float) -> F64:
    """Smallest covariance of x, y, F of all touches that one frame allows.

    The camera's motions and the light (gain, offset) are unknown too. The reference is taken as
    known; a mean of N frames adds a fraction 1/N.

    Parameters
    ----------
    pattern : TilePattern
        From `pixel_level`.
    touches : (n, 3) float64
        x, y (mm) and F (N).
    noise : float, grey levels
        Standard deviation of a pixel.

    Returns
    -------
    (3n, 3n) float64, mm and N
    """
    touches = np.asarray(touches, dtype=np.float64)
    return covariance(pattern.forward(noise).read(touches)[1])


def pixel_bound(
    plate: fe.Plate,
    camera: synthetic.AnyCamera,
    height: float,
    image: F64,
    touches: F64,
    noise: float,
    moves: Callable[[synthetic.AnyCamera, F64], F64] = synthetic.rigid_motion_basis,
) -> F64:
    """Smallest covariance of small touches, from elements that are fine where these are.

    As `cramer_rao`, and right near edges, in corners and for touches close together, which a few
    hundred modes take for less different than they are. No border is left out, and no tile
    takes motion for even; it costs some seconds each time.

    Parameters
    ----------
    plate : Plate
    camera : synthetic.AnyCamera
    height : float, mm
        Height of the seen face over the plate's middle plane.
    image : (H, W) float64, grey levels
        The undeformed pattern without noise.
    touches : (n, 3) float64
        x, y (mm) and F (N).
    noise : float, grey levels
        Standard deviation of a pixel.
    moves : callable
        As for `pixel_level`.

    Returns
    -------
    (3n, 3n) float64, mm and N
    """
    touches, image = (np.asarray(array, dtype=np.float64) for array in (touches, image))
    rows, columns = image.shape
    px = np.indices((columns, rows)).reshape(2, -1, order="F").T.astype(np.float64)
    points = camera.on_plate(px, height)
    on_plate = ((points >= 0.0) & (points <= plate.size)).all(axis=1)
    value, slope = np.zeros((len(px), touches.size)), np.zeros((len(px), touches.size, 2))
    value[on_plate], slope[on_plate] = _derivatives(plate, points[on_plate], touches)
    motions = synthetic.image_motion_basis(camera, px, value, slope, height)
    motions = np.concatenate([motions, moves(camera, px)], axis=2)
    gradient = np.stack(
        [np.ravel(part) for part in spline_gradient(spline_coefficients(image))], axis=1
    )
    seen = np.einsum("nd,ndk->kn", gradient, motions)
    equations = np.concatenate([seen, [image.ravel(), np.ones(image.size)]])
    units = np.linalg.norm(equations, axis=1)
    normal = (equations @ equations.T) / np.outer(units, units)
    inverse = np.linalg.inv(normal) / np.outer(units, units)
    return noise**2 * inverse[: touches.size, : touches.size]


def _derivatives(plate: fe.Plate, points: F64, touches: F64) -> tuple[F64, F64]:
    """Differentiate deflection (N, 3n) and slope (N, 3n, 2) by x, y and F of each touch."""
    pressed = [fe.Touch(*touch) for touch in touches.tolist()]
    solver = fe.Linear(plate, fe.scaled_mesh(fe.touch_mesh(plate, pressed), _FINER))
    values, slopes = list[F64](), list[F64]()
    for x, y, force in touches.tolist():
        alone = solver.deflect([fe.Touch(x, y, 1.0)])
        for axis in (0, 1):
            dx, dy = _NUDGE * np.eye(2)[axis]
            ends = [solver.deflect([fe.Touch(x + s * dx, y + s * dy, 1.0)]) for s in _SIGNS]
            step = force / (2.0 * _NUDGE)
            values.append(step * (ends[0].deflection(points) - ends[1].deflection(points)))
            slopes.append(step * (ends[0].slope(points) - ends[1].slope(points)))
        values.append(alone.deflection(points))
        slopes.append(alone.slope(points))
    return np.stack(values, axis=1), np.stack(slopes, axis=1)
