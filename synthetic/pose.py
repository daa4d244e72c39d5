"""Where a camera stands and looks: rigid transforms from the plate to the camera."""

from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from synthetic.arrays import F64

Face = Literal["top", "bottom"]
"""A face of the plate: the touched one or its underside, as `fe` names them."""

# Height of a face in thicknesses, along z out of the touched face.
_HEIGHT: dict[Face, float] = {"top": 0.5, "bottom": -0.5}


def face_height(face: Face, thickness: float) -> float:
    """Height of a face of a plate over its middle plane, mm: negative for the underside."""
    return _HEIGHT[face] * thickness


def look_at(
    position: ArrayLike, target: ArrayLike, up: tuple[float, float, float] = (0.0, 1.0, 0.0)
) -> F64:
    """Pose of a camera that looks from one point of the plate frame at another.

    Parameters
    ----------
    position, target : (3,) float64, mm, plate frame.
    up : direction that points up in the image; image rows run down.

    Returns
    -------
    (4, 4) float64, T_cam_plate.

    Raises
    ------
    ValueError
        The points coincide, or `up` lies along the view.
    """
    centre = np.asarray(position, dtype=np.float64)
    ahead = np.asarray(target, dtype=np.float64) - centre
    right = np.cross(ahead, up)
    lengths = np.linalg.norm(ahead), np.linalg.norm(right)
    if not 0 < lengths[0] < np.inf or not lengths[1] > 1e-9 * lengths[0]:
        raise ValueError(
            f"a view needs a position apart from its target and from its line upwards, got "
            f"{centre.tolist()} and {np.asarray(target).tolist()} mm with {tuple(up)} upwards"
        )
    z, x = ahead / lengths[0], right / lengths[1]
    R = np.stack([x, np.cross(z, x), z])
    return _transform(R, -R @ centre)


def facing(face: Face, plate_size: tuple[float, float], stand_off: float) -> F64:
    """Pose straight before the middle of a face of a plate, with plate y up in the image.

    Plate x runs right above the plate and left below it: the underside is seen turned over.
    """
    if not all(0 < length < np.inf for length in plate_size):
        raise ValueError(f"plate size must be positive, got {plate_size} mm")
    if not 0 < stand_off < np.inf:
        raise ValueError(f"stand-off must be positive, got {stand_off} mm")
    x, y = plate_size[0] / 2, plate_size[1] / 2
    return look_at((x, y, 2.0 * face_height(face, stand_off)), (x, y, 0.0))


def fit(
    plate_size: tuple[float, float], pixels: tuple[int, int], margin: float
) -> tuple[float, tuple[float, float]]:
    """Millimetres per pixel with which a plate fills the image, and the middle of the image.

    Parameters
    ----------
    margin : fraction of the image left free on each side in the tighter direction.
    """
    if not 0 <= margin < 0.5:
        raise ValueError(f"margin must lie in 0 ≤ margin < 0.5, got {margin} of the image")
    (a, b), (width, height) = plate_size, pixels
    if min(pixels) < 1:
        raise ValueError(f"image size must be positive, got {pixels} px")
    scale = 1 / ((1 - 2 * margin) * min(width / a, height / b))
    return scale, ((width - 1) / 2, (height - 1) / 2)


def rotated(T_cam_plate: ArrayLike, rotation: ArrayLike, about: tuple[float, float, float]) -> F64:
    """Pose after the plate was turned under the camera.

    Parameters
    ----------
    T_cam_plate : (4, 4) float64, the pose before.
    rotation : (3,) float64, rad, axis times angle in the plate frame.
    about : (x, y, z) of a point that stays, mm, plate frame.
    """
    axis = np.asarray(rotation, dtype=np.float64)
    angle = np.linalg.norm(axis)
    x, y, z = axis / angle if angle > 0 else axis
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    # Rodrigues' formula.
    R = np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross
    return np.asarray(T_cam_plate, dtype=np.float64) @ _transform(R, about - R @ about)


def rigid_transform(pose: ArrayLike) -> F64:
    """Return a read-only copy of a (4, 4) transform, or say that it is not rigid."""
    pose = np.array(pose, dtype=np.float64)
    if not _is_rigid(pose):
        raise ValueError(
            "T_cam_plate must be a rigid (4, 4) transform with a right-handed rotation, "
            f"got {pose.tolist()}"
        )
    pose.flags.writeable = False
    return pose


def _transform(R: F64, t: F64) -> F64:
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = R, t
    return pose


def _is_rigid(pose: F64) -> bool:
    if pose.shape != (4, 4) or not np.isfinite(pose).all():
        return False
    R = pose[:3, :3]
    return bool(
        np.allclose(R @ R.T, np.eye(3), atol=1e-9)
        and np.linalg.det(R) > 0
        and np.array_equal(pose[3], [0, 0, 0, 1])
    )
