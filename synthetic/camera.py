"""A pinhole camera before the plate: where a point is seen, and which point a pixel sees."""

from dataclasses import dataclass
from typing import ClassVar, Literal

import numpy as np
from numpy.typing import ArrayLike

from synthetic.arrays import F64
from synthetic.distortion import Distortion
from synthetic.points import checked, descend, in_camera
from synthetic.pose import Face, face_height, facing, fit, rigid_transform


@dataclass(frozen=True, eq=False)
class Camera:
    """A pinhole camera that looks along its own +z.

    Attributes
    ----------
    size : (width, height) of the image, px.
    focal : focal length, px.
    centre : (x, y) of the principal point, px; (0, 0) is the centre of the top-left pixel.
    T_cam_plate : (4, 4) float64, maps plate coordinates to camera coordinates, mm.
    distortion : what the lens does to the rays; None for a perfect one.

    Raises
    ------
    ValueError
        A size or focal length that is not positive, or a pose that is not rigid.
    """

    kind: ClassVar[Literal["pinhole"]] = "pinhole"

    size: tuple[int, int]
    focal: float
    centre: tuple[float, float]
    T_cam_plate: F64
    distortion: Distortion | None = None

    def __post_init__(self):
        if min(self.size) < 1:
            raise ValueError(f"image size must be positive, got {self.size} px")
        if not 0 < self.focal < np.inf:
            raise ValueError(f"focal length must be positive, got {self.focal} px")
        object.__setattr__(self, "T_cam_plate", rigid_transform(self.T_cam_plate))

    @property
    def position(self) -> F64:
        """(3,) float64, optical centre in the plate frame, mm."""
        return -self.T_cam_plate[:3, :3].T @ self.T_cam_plate[:3, 3]

    @property
    def face(self) -> Face:
        """Face of the plate that it sees: "top" from above, "bottom" from below."""
        return "top" if self.position[2] > 0 else "bottom"

    def face_height(self, thickness: float) -> float:
        """Height of the face that it sees over the middle plane of a plate, mm, signed."""
        return face_height(self.face, thickness)

    @property
    def scale(self) -> float:
        """Millimetres per pixel where the optical axis meets the plane z = 0 of the plate."""
        along = self.T_cam_plate[2, 2]
        if along * self.position[2] >= 0:
            raise ValueError("optical axis does not meet the plate; turn the camera to the plate")
        return float(-self.position[2] / along / self.focal)

    def project(self, points: ArrayLike) -> F64:
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
            A point of wrong shape, not finite, not in front of the camera, or so far off the axis
            that the lens model does not hold.
        """
        local = in_camera(self.T_cam_plate, points)
        ray = local[:, :2] / local[:, 2:]
        if self.distortion is not None:
            ray = self.distortion.bend(ray)
        return ray * self.focal + self.centre

    def jacobian(self, points: ArrayLike) -> F64:
        """How the image of a point moves with the point.

        Parameters
        ----------
        points : (K, 3) float64, mm, plate frame.

        Returns
        -------
        (K, 2, 3) float64, px per mm along plate x, y, z.
        """
        local = in_camera(self.T_cam_plate, points)
        R = self.T_cam_plate[:3, :3]
        ray = local[:, :2] / local[:, 2:]
        J = (R[:2] - ray[:, :, None] * R[2]) * (self.focal / local[:, 2])[:, None, None]
        return J if self.distortion is None else self.distortion.jacobian(ray) @ J

    def on_plate(self, px: ArrayLike, z: ArrayLike = 0.0) -> F64:
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
            The ray of a pixel does not meet the plane in front of the camera, or the lens sends no
            ray to it.
        """
        ray = (checked(px, 2, "pixel coordinates", "px") - self.centre) / self.focal
        if self.distortion is not None:
            ray = self.distortion.straighten(ray)
        R = self.T_cam_plate[:3, :3]
        return descend(self.position, R[:2].T @ ray.T + R[2][:, None], z)


def pinhole_above(
    plate_size: tuple[float, float],
    stand_off: float = 500.0,
    pixels: tuple[int, int] = (1024, 1024),
    margin: float = 0.02,
    distortion: Distortion | None = None,
) -> Camera:
    """Stand a camera over the centre of the plate, looking straight down on the touched face.

    Plate x runs right in the image and plate y runs up, so the pose is half a turn about x.

    Parameters
    ----------
    plate_size : (a, b) of the plate, mm.
    stand_off : distance of the optical centre from the plate's middle plane, mm.
    pixels : (width, height) of the image, px.
    margin : fraction of the image left free on each side of the plate in the tighter direction.
    distortion : of the lens; it changes what lies away from the middle of the image.

    Returns
    -------
    Camera

    Raises
    ------
    ValueError
        A plate or stand-off that is not positive, or a margin outside 0 ≤ margin < 0.5.
    """
    return _facing("top", plate_size, stand_off, pixels, margin, distortion)


def pinhole_below(
    plate_size: tuple[float, float],
    stand_off: float = 500.0,
    pixels: tuple[int, int] = (1024, 1024),
    margin: float = 0.02,
    distortion: Distortion | None = None,
) -> Camera:
    """Stand a camera under the centre of the plate, looking straight up at its underside.

    Plate x runs *left* in the image and plate y up, as who lies below sees them: the pose is half a
    turn about y. No image is mirrored. Arguments and errors as of `pinhole_above`.
    """
    return _facing("bottom", plate_size, stand_off, pixels, margin, distortion)


def _facing(
    face: Face,
    plate_size: tuple[float, float],
    stand_off: float,
    pixels: tuple[int, int],
    margin: float,
    distortion: Distortion | None,
) -> Camera:
    pose = facing(face, plate_size, stand_off)
    scale, middle = fit(plate_size, pixels, margin)
    return Camera(pixels, stand_off / scale, middle, pose, distortion)
