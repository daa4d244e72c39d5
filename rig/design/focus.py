"""What of a plate is out of focus: the circles that its nearest and its farthest point become.

A thin lens of aperture A, focused at s₀, makes of a point at s a circle of A f |s − s₀| / (s s₀),
with f the distance of the image behind it (Ray, Applied Photographic Optics, 3rd ed., ch. 22).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

import synthetic
from rig.design.setup import Setup


@dataclass(frozen=True)
class Blur:
    """Circles out of focus.

    Attributes
    ----------
    depths : (near, far), mm
        From the lens to the nearest and to the farthest point of the face, along the optical axis.
    circles : (near, far), px
        Diameters.
    """

    depths: tuple[float, float]
    circles: tuple[float, float]


def blur_of(given: Setup) -> Blur | None:
    """Say how far the face of the plate is out of focus; None where nothing is said of the lens."""
    lens, view, (a, b) = given.camera.lens, given.camera.build(given.plate), given.plate.size
    if lens is None or not isinstance(view, synthetic.Camera):
        return None
    height = view.face_height(given.plate.thickness)
    corners = np.array([(x, y, height) for x in (0.0, a) for y in (0.0, b)])
    depth = corners @ view.T_cam_plate[2, :3] + view.T_cam_plate[2, 3]
    near, far = float(depth.min()), float(depth.max())
    aperture = lens.focal / lens.f_number
    circles = [aperture * view.focal * abs(s - lens.focus) / (s * lens.focus) for s in (near, far)]
    return Blur((near, far), (circles[0], circles[1]))


def sharpest(given: Setup) -> float:
    """Distance, mm, focused at which the nearest and the farthest point are equally sharp.

    That of the camera where the scene says nothing of a lens, for then all is sharp.
    """
    blur = blur_of(given)
    if blur is None:
        return given.camera.stand_off
    near, far = blur.depths
    return 2 * near * far / (near + far)
