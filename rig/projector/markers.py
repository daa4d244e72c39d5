"""What the projector shows: a soft, dim spot for each touch and a ring for its uncertainty.

Projected light falls on the speckle that is being measured. A spot with a soft edge at a quarter
of full brightness moves the correlation by less than 0.1 px, a hard bright disc by more than 1 px;
so nothing here is bright, nothing has a hard edge, and the ground stays black.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import cv2
import numpy as np
from numpy.typing import NDArray

from rig.live.snapshot import Mark
from rig.system.arrays import F64, Grey

PEAK = 64  # grey levels of 255: a quarter of full brightness
SPOT = np.array([0.3, 0.8, 0.65])  # red, green, blue as fractions of PEAK
SPOT_RADIUS = 5.0  # mm, one standard deviation of the spot of a 1 N touch; area grows with force
SPOT_RANGE = (2.0, 12.0)  # mm
RING_WIDTH = 0.4  # mm, one standard deviation of the soft edge of the line
RING_SIGMAS = 2.0
MIN_RING = 2.5  # mm, a smaller ring would hide in the spot's peak
REACH = 3.5  # standard deviations after which a soft edge is below one grey level
SPRITE = 64  # px from the middle of the spot's own image to its border
SUBPIXEL = 4  # fractional bits of a line's points


@dataclass(frozen=True, eq=False)
class Screen:
    """The projector's image and where the plate lies in it.

    Attributes
    ----------
    size : tuple of int
        Width and height, px.
    T_px_plate : (3, 3) float64
        Homography from the touched face (x, y, mm) to the image (x, y, px).
    """

    size: tuple[int, int]
    T_px_plate: NDArray[np.float64]


def fit_plate(size: tuple[int, int], plate_size: tuple[float, float], margin: float = 0.05):
    """Put the whole plate in the middle of the image, plate y upwards, as a `Screen`.

    Parameters
    ----------
    size : tuple of int
        Width and height of the image, px.
    plate_size : tuple of float
        Sides of the plate along its x and y, mm.
    margin : float
        Fraction of the image left free at each border that the plate would touch.

    Raises
    ------
    ValueError
        If a side of the image or of the plate is not positive.
    """
    if min(size) < 1:
        raise ValueError(
            f"projector size must be positive, got {size[0]} x {size[1]} px; "
            "give the resolution of the projector, such as 1280 x 800"
        )
    if not min(plate_size) > 0:
        raise ValueError(
            f"plate size must be positive, got {plate_size[0]:g} x {plate_size[1]:g} mm; "
            "give the sides of the plate"
        )
    (width, height), (a, b) = size, plate_size
    scale = (1 - 2 * margin) * min(width / a, height / b)
    x0 = (width - 1 - scale * a) / 2
    y0 = (height - 1 + scale * b) / 2
    return Screen(size, np.array([[scale, 0.0, x0], [0.0, -scale, y0], [0.0, 0.0, 1.0]]))


def project(T_px_plate: NDArray[np.floating], xy: NDArray[np.floating]) -> NDArray[np.floating]:
    """Take points (N, 2), mm, through a homography to (N, 2), px."""
    mapped = xy @ T_px_plate[:, :2].T + T_px_plate[:, 2]
    return mapped[:, :2] / mapped[:, 2:]


def draw_marks(marks: Sequence[Mark], screen: Screen) -> NDArray[np.uint8]:
    """Draw the projector's image, (H, W, 3) uint8 RGB; where marks overlap the brighter stays."""
    width, height = screen.size
    image = np.zeros((height, width, 3), np.uint8)
    for mark in marks:
        _draw_mark(image, mark, screen.T_px_plate)
    return image


def _draw_mark(image: NDArray[np.uint8], mark: Mark, T: NDArray[np.float64]) -> None:
    """Lay spot and ring over the part of the image that they reach."""
    place = np.array([mark.x, mark.y])
    spot = float(np.clip(SPOT_RADIUS * np.sqrt(max(mark.force, 0.0)), *SPOT_RANGE))
    axes = np.maximum(RING_SIGMAS * np.array(mark.sigma[:2]), MIN_RING)
    reach = max(REACH * spot, axes.max() + REACH * RING_WIDTH)
    box = project(T, place + reach * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]))
    height, width = image.shape[:2]
    x0, y0 = np.maximum(np.floor(box.min(0)).astype(int), 0)
    x1, y1 = np.minimum(np.ceil(box.max(0)).astype(int) + 1, (width, height))
    if x0 >= x1 or y0 >= y1:
        return
    window = image[y0:y1, x0:x1]
    T_window = np.array([[1.0, 0.0, -x0], [0.0, 1.0, -y0], [0.0, 0.0, 1.0]]) @ T
    np.maximum(window, _spot(T_window, place, spot, window.shape), out=window)
    np.maximum(
        window, _ring(T_window, place, (axes[0], axes[1], mark.sigma[2]), window.shape), out=window
    )


@cache
def _sprite() -> NDArray[np.uint8]:
    """Round spot of unit reach on a square of 2 SPRITE + 1 px, RGB."""
    at = np.linspace(-REACH, REACH, 2 * SPRITE + 1)
    light = np.exp(-0.5 * (at[:, None] ** 2 + at**2))
    return np.rint(PEAK * light[..., None] * SPOT).astype(np.uint8)


def _spot(T: F64, place: F64, radius: float, shape: tuple[int, ...]) -> Grey:
    """Spot of `radius`, mm, one standard deviation, seen through T in an image of `shape`."""
    step = radius * REACH / SPRITE
    left, top = place - radius * REACH
    T_plate_sprite = np.array([[step, 0.0, left], [0.0, step, top], [0.0, 0.0, 1.0]])
    return cv2.warpPerspective(_sprite(), T @ T_plate_sprite, (shape[1], shape[0])).astype(np.uint8)


def _ring(T: F64, place: F64, ellipse: tuple[float, float, float], shape: tuple[int, ...]) -> Grey:
    """Soft line along an ellipse (semi-axes, mm, mm, angle, rad) about `place`, seen through T."""
    a, b, angle = ellipse
    turn = np.linspace(0, 2 * np.pi, 96, endpoint=False)
    cos, sin = np.cos(angle), np.sin(angle)
    own = np.stack([a * np.cos(turn), b * np.sin(turn)], -1)
    line = project(T, place + own @ np.array([[cos, sin], [-sin, cos]]))
    width = RING_WIDTH * np.sqrt(abs(np.linalg.det(T[:2, :2])))  # px, where T is near affine
    ring = np.zeros(shape[:2], np.uint8)
    points = np.rint(line * 2**SUBPIXEL).astype(np.int32)
    cv2.polylines(ring, [points], True, PEAK, max(round(2 * width), 1), cv2.LINE_AA, shift=SUBPIXEL)
    return cv2.GaussianBlur(ring, (0, 0), max(width, 0.5))[..., None].astype(np.uint8)
