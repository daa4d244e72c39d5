"""What a camera measures, without images: motion of material points, linear if it is small."""

import numpy as np
from numpy.typing import ArrayLike

from synthetic.arrays import F64
from synthetic.points import at_height, checked
from synthetic.telecentric import AnyCamera


def image_motion(camera: AnyCamera, points: ArrayLike, displacement: ArrayLike, z: float) -> F64:
    """Image displacement of material points, exact for any size of displacement.

    Parameters
    ----------
    points : (K, 2) float64, mm, plate points of the undeformed face.
    displacement : (K, 3) float64, mm, displacement of that face.
    z : height of the face over the plate's middle plane, mm.

    Returns
    -------
    (K, 2) float64, px.
    """
    start = at_height(checked(points, 2, "plate points", "mm"), z)
    moved = checked(displacement, 3, "displacement", "mm")
    if len(moved) != len(start):
        raise ValueError(f"displacement must have {len(start)} rows, got {len(moved)}")
    return camera.project(start + moved) - camera.project(start)


def image_motion_basis(
    camera: AnyCamera, px: ArrayLike, value: ArrayLike, slope: ArrayLike, z: float
) -> F64:
    """Image displacement per unit of each of K deflection fields, to first order.

    The face at height z of a thin plate moves by (−z w,x, −z w,y, w); the camera sees that
    through its Jacobian at the plate point of each pixel. The term of w is the apparent
    stretch of a pinhole and is absent on the optical axis alone.

    Parameters
    ----------
    px : (N, 2) float64, px, where the undeformed plate is watched.
    value : (N, K) float64, w along +z of each field at `camera.on_plate(px, z)`, mm per unit.
    slope : (N, K, 2) float64, w,x and w,y there, mm/mm per unit.
    z : height of the watched face over the plate's middle plane, mm.

    Returns
    -------
    (N, 2, K) float64, px per unit.
    """
    w, dw = np.asarray(value, dtype=np.float64), np.asarray(slope, dtype=np.float64)
    points = camera.on_plate(px, z)
    if w.ndim != 2 or len(w) != len(points) or dw.shape != (*w.shape, 2):
        raise ValueError(
            f"field values and slopes must have shapes ({len(points)}, K) and "
            f"({len(points)}, K, 2), got {w.shape} and {dw.shape}"
        )
    J = camera.jacobian(at_height(points, z))
    bending = J[:, :, :2] @ dw.transpose(0, 2, 1)
    return J[:, :, 2:] * w[:, None, :] - z * bending


def rigid_motion_basis(camera: AnyCamera, px: ArrayLike) -> F64:
    """Image displacement when the image shifts, turns or grows about its middle.

    These four unknowns stand for a camera that moves a little during a measurement.

    Parameters
    ----------
    px : (N, 2) float64, px.

    Returns
    -------
    (N, 2, 4) float64: px per px of shift in x, per px of shift in y, per rad of rotation
    (x towards y), per unit of relative scale.
    """
    px = checked(px, 2, "pixel coordinates", "px")
    x, y = (px - (np.array(camera.size) - 1) / 2).T
    one, none = np.ones_like(x), np.zeros_like(x)
    return np.stack(
        [np.stack([one, none, -y, x], axis=-1), np.stack([none, one, x, y], axis=-1)], axis=1
    )
