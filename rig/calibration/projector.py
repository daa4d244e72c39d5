"""Where the projector's light falls on the plate."""

from __future__ import annotations

from dataclasses import dataclass
from typing import cast

import cv2
import numpy as np

import synthetic
from rig.projector.markers import Screen, project
from rig.system.arrays import F64, AnyArray, Mask

FEWEST = 1000  # lit pixels on the plate
SLIP = 2.0  # px of the projector; a pixel that was read further off saw an edge or a reflection
CLIPPED = 250.0  # grey levels, from which on a pixel may be cut off
BLOCKS = 8  # a side, over which residuals are averaged: what is left of them is no noise


@dataclass(frozen=True, eq=False)
class ProjectorLight:
    """The projector over the plate.

    Attributes
    ----------
    screen : Screen
        With the homography from the touched face to the projector's image.
    residual : float, px
        RMS distance of the pixels that were read, rounding to whole pixels included.
    error : float, mm
        RMS over the plate of what is left where many pixels are averaged: lens and bent plate.
    share : float
        Of the plate's pixels in the camera that could be read.
    strength : float
        The projector's white over the light of the room, as the camera sees both.
    black : float, grey levels
        What a pixel of the camera reads without any light.
    """

    screen: Screen
    residual: float
    error: float
    fraction: float
    strength: float = 0.0
    black: float = 0.0


def find_light(
    seen: AnyArray,
    valid: Mask,
    camera: synthetic.Camera,
    plate: tuple[float, float],
    size: tuple[int, int],
    height: float,
) -> ProjectorLight:
    """Fit the homography of a projector to a decoded Gray code.

    Parameters
    ----------
    seen, valid : (H, W, 2) float64 px, (H, W) bool
        From `gray.decode`.
    camera : synthetic.Camera
        Calibrated, at the pose of the plate.
    plate : (a, b), mm
    size : (width, height) of the projector, px
    height : float, mm
        Of the lit face, which the camera sees, over the middle plane.

    Raises
    ------
    ValueError
        If too little of the plate is lit.
    """
    y, x = np.nonzero(valid)
    places = camera.on_plate(np.column_stack([x, y]).astype(np.float64), height)
    inside = ((places >= 0) & (places <= np.array(plate))).all(axis=1)
    places, lit = places[inside], seen[y[inside], x[inside]]
    if len(places) < FEWEST:
        raise ValueError(
            f"projector lights {len(places)} pixels of the plate, and {FEWEST} are needed; darken"
            " the room, or open the exposure"
        )
    fit = cv2.findHomography(places, lit, cv2.RANSAC, SLIP)
    found, kept = cast(tuple[AnyArray | None, AnyArray], fit)
    if found is None:
        raise ValueError("the projector's light on the plate is no plane image; look for mirrors")
    fits = kept.ravel().astype(bool)
    T = np.asarray(cv2.findHomography(places[fits], lit[fits], 0)[0], dtype=np.float64)
    left = lit[fits] - project(T, places[fits])
    scale = np.sqrt(abs(np.linalg.det(T[:2, :2])))  # px per mm, where T is near affine
    corners = camera.project(
        np.column_stack([[0, plate[0], plate[0], 0], [0, 0, plate[1], plate[1]], [height] * 4])
    )
    area = cv2.contourArea(corners.astype(np.float32))
    return ProjectorLight(
        screen=Screen(size, T),
        residual=float(np.sqrt(np.square(left).sum(axis=1).mean())),
        error=_smooth(left, places[fits], plate) / float(scale),
        fraction=float(len(places) / area),
    )


def brightness(light: AnyArray, dark: AnyArray, valid: Mask) -> tuple[float, float]:
    """Strength of a projector, and the grey level of a pixel without any light.

    A pixel that reads d in the light of the room reads d + s (d - black) under the projector's
    white: a line through all pixels, whatever is printed on them.

    Parameters
    ----------
    light, dark : (H, W), grey levels
        Under white and under black of the projector.
    valid : (H, W) bool
        Pixels that the projector lights.

    Returns
    -------
    strength, black : float
        Zeros where too few pixels are lit and not too bright to tell.
    """
    valid = valid & (light < CLIPPED)
    if np.count_nonzero(valid) < FEWEST:
        return 0.0, 0.0
    # Over the brighter image, whose spread is far above its noise: noise would flatten the line.
    rise, level = np.polyfit(light[valid].astype(np.float64), dark[valid].astype(np.float64), 1)
    if not 0 < rise < 1:
        return 0.0, 0.0
    return float(1.0 / rise - 1.0), float(level / (1.0 - rise))


def _smooth(left: AnyArray, places: F64, plate: tuple[float, float]) -> float:
    """RMS of residuals (N, 2) after their means were taken over blocks of the plate."""
    block = np.minimum((BLOCKS * places / np.array(plate)).astype(int), BLOCKS - 1)
    name = block[:, 0] * BLOCKS + block[:, 1]
    count = np.bincount(name, minlength=BLOCKS**2)
    means = [np.bincount(name, left[:, axis], BLOCKS**2) / np.maximum(count, 1) for axis in (0, 1)]
    many = count >= count.max() / 4
    return float(np.sqrt(np.square(np.stack(means)[:, many]).sum(axis=0).mean()))
