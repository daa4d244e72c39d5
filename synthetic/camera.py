"""A pinhole camera over the plate: where a point is seen, and which point a pixel sees."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Camera:
    """A pinhole camera without distortion that looks along its own +z.

    Attributes
    ----------
    size : (width, height) of the picture, px.
    focal : focal length, px.
    centre : (x, y) of the principal point, px; (0, 0) is the centre of the top-left pixel.
    T_cam_plate : (4, 4) float64, maps plate coordinates to camera coordinates, mm.

    Raises
    ------
    ValueError
        A size or focal length that is not positive, or a pose that is not rigid.
    """

    size: tuple[int, int]
    focal: float
    centre: tuple[float, float]
    T_cam_plate: Array

    def __post_init__(self):
        if min(self.size) < 1:
            raise ValueError(f"picture size must be positive, got {self.size} px")
        if not 0 < self.focal < np.inf:
            raise ValueError(f"focal length must be positive, got {self.focal} px")
        pose = np.array(self.T_cam_plate, dtype=np.float64)
        if not _is_rigid(pose):
            raise ValueError(
                "T_cam_plate must be a rigid (4, 4) transform with a right-handed rotation, "
                f"got {pose.tolist()}"
            )
        pose.flags.writeable = False
        object.__setattr__(self, "T_cam_plate", pose)

    @property
    def position(self) -> Array:
        """(3,) float64, optical centre in the plate frame, mm."""
        return -self.T_cam_plate[:3, :3].T @ self.T_cam_plate[:3, 3]

    @property
    def scale(self) -> float:
        """Millimetres per pixel where the optical axis meets the plane z = 0 of the plate."""
        along = self.T_cam_plate[2, 2]
        if along * self.position[2] >= 0:
            raise ValueError("optical axis does not meet the plate; turn the camera to the plate")
        return float(-self.position[2] / along / self.focal)

    def project(self, points: ArrayLike) -> Array:
        """See plate points.

        Parameters
        ----------
        points : (K, 3) float64, mm, plate frame.

        Returns
        -------
        (K, 2) float64, px.

        Raises
        ------
        ValueError
            A point of wrong shape, not finite, or not in front of the camera.
        """
        local = self._in_camera(points)
        return local[:, :2] * (self.focal / local[:, 2:]) + self.centre

    def jacobian(self, points: ArrayLike) -> Array:
        """How the picture of a point moves with the point.

        Parameters
        ----------
        points : (K, 3) float64, mm, plate frame.

        Returns
        -------
        (K, 2, 3) float64, px per mm along plate x, y, z.
        """
        local = self._in_camera(points)
        R = self.T_cam_plate[:3, :3]
        ray = local[:, :2] / local[:, 2:]
        return (R[:2] - ray[:, :, None] * R[2]) * (self.focal / local[:, 2])[:, None, None]

    def on_plate(self, px: ArrayLike, z: ArrayLike = 0.0) -> Array:
        """Find the point of the plane at height z that a pixel sees.

        Parameters
        ----------
        px : (K, 2) float64, px.
        z : height of the plane over the plate's middle plane, mm; one number or (K,).

        Returns
        -------
        (K, 2) float64, mm, plate frame.

        Raises
        ------
        ValueError
            The ray of a pixel does not meet the plane in front of the camera.
        """
        x, y = ((checked(px, 2, "pixel coordinates", "px") - self.centre) / self.focal).T
        R = self.T_cam_plate[:3, :3]
        ray = R[0][:, None] * x + R[1][:, None] * y + R[2][:, None]
        position = self.position
        drop = np.asarray(z, dtype=np.float64) - position[2]
        if np.any(drop * ray[2] <= 0):
            raise ValueError(
                "a pixel does not see the plane of the plate in front of the camera; "
                "move the camera to the touched side and turn it to the plate"
            )
        return (position[:2, None] + ray[:2] * (drop / ray[2])).T

    def _in_camera(self, points: ArrayLike) -> Array:
        points = checked(points, 3, "plate points", "mm")
        local = points @ self.T_cam_plate[:3, :3].T + self.T_cam_plate[:3, 3]
        if len(local) and local[:, 2].min() <= 0:
            raise ValueError(
                f"plate points must lie in front of the camera, got a depth of "
                f"{local[:, 2].min():.6g} mm; move the camera away from the plate"
            )
        return local


def pinhole_above(
    plate_size: tuple[float, float],
    stand_off: float = 500.0,
    pixels: tuple[int, int] = (1024, 1024),
    margin: float = 0.02,
) -> Camera:
    """Stand a camera over the centre of the plate, looking straight down on the touched face.

    Plate x runs right in the picture and plate y runs up, so the pose is half a turn about x.

    Parameters
    ----------
    plate_size : (a, b) of the plate, mm.
    stand_off : distance of the optical centre from the plate's middle plane, mm.
    pixels : (width, height) of the picture, px.
    margin : fraction of the picture left free on each side of the plate in the tighter direction.

    Returns
    -------
    Camera

    Raises
    ------
    ValueError
        A plate or stand-off that is not positive, or a margin outside 0 ≤ margin < 0.5.
    """
    if not all(0 < length < np.inf for length in plate_size):
        raise ValueError(f"plate size must be positive, got {plate_size} mm")
    if not 0 < stand_off < np.inf:
        raise ValueError(f"stand-off must be positive, got {stand_off} mm")
    if not 0 <= margin < 0.5:
        raise ValueError(f"margin must lie in 0 ≤ margin < 0.5, got {margin} of the picture")
    (a, b), (width, height) = plate_size, pixels
    focal = (1 - 2 * margin) * min(width / a, height / b) * stand_off
    pose = np.diag([1.0, -1.0, -1.0, 1.0])
    pose[:3, 3] = -a / 2, b / 2, stand_off
    return Camera((width, height), focal, ((width - 1) / 2, (height - 1) / 2), pose)


def at_height(points: Array, z: float) -> Array:
    """Lift plate points (K, 2) mm to height z mm: (K, 3)."""
    return np.column_stack([points, np.full(len(points), z)])


def checked(values: ArrayLike, width: int, name: str, unit: str) -> Array:
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


def _is_rigid(pose: Array) -> bool:
    if pose.shape != (4, 4) or not np.isfinite(pose).all():
        return False
    R = pose[:3, :3]
    return bool(
        np.allclose(R @ R.T, np.eye(3), atol=1e-9)
        and np.linalg.det(R) > 0
        and np.array_equal(pose[3], [0, 0, 0, 1])
    )
