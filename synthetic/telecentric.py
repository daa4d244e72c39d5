"""A telecentric camera: parallel rays, so that distance does not change what is seen."""

from dataclasses import dataclass
from typing import ClassVar, Literal

import numpy as np
from numpy.typing import ArrayLike

from synthetic.arrays import F64
from synthetic.camera import Camera
from synthetic.points import checked, descend, in_camera
from synthetic.pose import Face, face_height, facing, fit, rigid_transform


@dataclass(frozen=True, eq=False)
class Telecentric:
    """A camera whose rays all run along its own +z.

    Motion along the view leaves no trace: over a plate seen straight on, no term of w.

    Attributes
    ----------
    size : (width, height) of the image, px.
    scale : millimetres per pixel across the view.
    centre : (x, y) where the camera's own z axis is seen, px.
    T_cam_plate : (4, 4) float64, maps plate coordinates to camera coordinates, mm.

    Raises
    ------
    ValueError
        A size or scale that is not positive, or a pose that is not rigid.
    """

    kind: ClassVar[Literal["telecentric"]] = "telecentric"

    size: tuple[int, int]
    scale: float
    centre: tuple[float, float]
    T_cam_plate: F64

    def __post_init__(self):
        if min(self.size) < 1:
            raise ValueError(f"image size must be positive, got {self.size} px")
        if not 0 < self.scale < np.inf:
            raise ValueError(f"scale must be positive, got {self.scale} mm per px")
        object.__setattr__(self, "T_cam_plate", rigid_transform(self.T_cam_plate))

    @property
    def face(self) -> Face:
        """Face of the plate that it sees: "top" where it looks down, "bottom" where up."""
        return "top" if self.T_cam_plate[2, 2] < 0 else "bottom"

    def face_height(self, thickness: float) -> float:
        """Height of the face that it sees over the middle plane of a plate, mm, signed."""
        return face_height(self.face, thickness)

    def project(self, points: ArrayLike) -> F64:
        """See plate points (K, 3) mm: (K, 2) px. Raises as `Camera.project`."""
        return in_camera(self.T_cam_plate, points)[:, :2] / self.scale + self.centre

    def jacobian(self, points: ArrayLike) -> F64:
        """How the image of points (K, 3) mm moves with them: (K, 2, 3) px per mm, all equal."""
        count = len(in_camera(self.T_cam_plate, points))
        return np.tile(self.T_cam_plate[:2, :3] / self.scale, (count, 1, 1))

    def on_plate(self, px: ArrayLike, z: ArrayLike = 0.0) -> F64:
        """Find the points (K, 2) mm of the plane at height z that pixels (K, 2) see.

        Parameters and errors as of `Camera.on_plate`.
        """
        across = (checked(px, 2, "pixel coordinates", "px") - self.centre) * self.scale
        R, t = self.T_cam_plate[:3, :3], self.T_cam_plate[:3, 3]
        start = R[:2].T @ (across - t[:2]).T - R[2][:, None] * t[2]
        return descend(start, R[2][:, None], z)


AnyCamera = Camera | Telecentric
"""A camera of either projection."""


def telecentric_above(
    plate_size: tuple[float, float],
    pixels: tuple[int, int] = (1024, 1024),
    margin: float = 0.02,
    stand_off: float = 500.0,
) -> Telecentric:
    """Stand a telecentric camera where `pinhole_above` stands its own; same arguments.

    `stand_off` only has to be larger than the plate can bend.
    """
    return _facing("top", plate_size, pixels, margin, stand_off)


def telecentric_below(
    plate_size: tuple[float, float],
    pixels: tuple[int, int] = (1024, 1024),
    margin: float = 0.02,
    stand_off: float = 500.0,
) -> Telecentric:
    """Stand a telecentric camera where `pinhole_below` stands its own; same arguments."""
    return _facing("bottom", plate_size, pixels, margin, stand_off)


def _facing(
    face: Face,
    plate_size: tuple[float, float],
    pixels: tuple[int, int],
    margin: float,
    stand_off: float,
) -> Telecentric:
    pose = facing(face, plate_size, stand_off)
    scale, middle = fit(plate_size, pixels, margin)
    return Telecentric(pixels, scale, middle, pose)
