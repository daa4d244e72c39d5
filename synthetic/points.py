"""Points as arrays: checked where they come in, lifted to a plane, carried to a camera."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from synthetic.arrays import F64


def checked(values: ArrayLike, width: int, name: str, unit: str) -> F64:
    """Return `values` as a finite (K, width) float64 array or say what is wrong with them."""
    array = np.asarray(values, dtype=np.float64)
    if array.ndim != 2 or array.shape[1] != width:
        raise ValueError(f"{name} must have shape (K, {width}) in {unit}, got {array.shape}")
    if not np.isfinite(array).all():
        raise ValueError(
            f"{name} must be finite, got {int((~np.isfinite(array)).sum())} values that are not, "
            f"in {unit}"
        )
    return array


def at_height(points: F64, z: float) -> F64:
    """Lift plate points (K, 2) mm to height z mm: (K, 3)."""
    return np.column_stack([points, np.full(len(points), z)])


def in_camera(T_cam_plate: F64, points: ArrayLike) -> F64:
    """Carry plate points (K, 3) mm to the camera frame: (K, 3) mm, all of positive depth."""
    points = checked(points, 3, "plate points", "mm")
    local = points @ T_cam_plate[:3, :3].T + T_cam_plate[:3, 3]
    if len(local) and local[:, 2].min() <= 0:
        raise ValueError(
            f"plate points must lie in front of the camera, got a depth of "
            f"{local[:, 2].min():.6g} mm; move the camera away from the plate"
        )
    return local


def descend(start: F64, ray: F64, z: ArrayLike) -> F64:
    """Follow rays to the plane at height z.

    Parameters
    ----------
    start, ray : (3,) or (3, K) float64, mm, plate frame; coordinates first.
    z : mm; one number or (K,).

    Returns
    -------
    (K, 2) float64, mm.
    """
    drop = np.asarray(z, dtype=np.float64) - start[2]
    if np.any(drop * ray[2] <= 0):
        raise ValueError(
            "a pixel does not see the plane of the plate in front of the camera; "
            "move the camera to the side of the face that it watches and turn it to the plate"
        )
    along = drop / ray[2]
    return np.column_stack([start[0] + ray[0] * along, start[1] + ray[1] * along])


def polynomial_value(coefficients: F64, x: F64, y: F64) -> F64:
    """Σ c[i, j] x^i y^j at K places, (K,)."""
    value: Any = np.polynomial.polynomial.polyval2d(x, y, coefficients)
    return value
