"""What the camera sees of the projector's light, and an image without it.

Light of the projector falls on the same speckle as that of the room, so a pixel that reads r in the
light of the room, less what it reads in the dark, reads r (1 + s p), p the projected image there,
0 to 1, and s the projector's white over the light of the room. Where p is known the image can be
divided by it.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from rig.projector.markers import Screen, project


@dataclass(frozen=True, eq=False)
class LightMap:
    """From the projector's image to the light that the camera sees.

    Attributes
    ----------
    T_cam_projector : (3, 3) float64
        Homography from the projector's image to that of the camera, px to px, over the plate.
    size : (width, height) of the camera's image, px
    strength : float
        The projector's white over the light of the room, as the camera sees both.
    black : float, grey levels
        What a pixel of the camera reads without any light.
    """

    T_cam_projector: NDArray[np.float64]
    size: tuple[int, int]
    strength: float
    black: float = 0.0

    def on_camera(self, projected: NDArray[np.uint8]) -> NDArray[np.float32]:
        """Light on each pixel of the camera over that of the room, (H, W), 1 where none falls.

        Parameters
        ----------
        projected : (H, W, 3) uint8
            What the projector shows.
        """
        light = np.ones(self.size[::-1], np.float32)
        x, y, wide, high = cv2.boundingRect(cv2.cvtColor(projected, cv2.COLOR_RGB2GRAY))
        corners = np.array([[x, y], [x + wide, y], [x + wide, y + high], [x, y + high]]) - 0.5
        seen = project(self.T_cam_projector, corners)
        left, top = np.clip(np.floor(seen.min(axis=0)), 0, self.size).astype(int)
        right, bottom = np.clip(np.ceil(seen.max(axis=0)) + 1, 0, self.size).astype(int)
        if not wide or left >= right or top >= bottom:
            return light
        T = _shift(-left, -top) @ self.T_cam_projector @ _shift(x, y)
        # A grey camera sees all channels alike.
        grey = projected[y : y + high, x : x + wide].mean(axis=2, dtype=np.float32)
        falls = cv2.warpPerspective(grey, T, (int(right - left), int(bottom - top)))
        light[top:bottom, left:right] += np.float32(self.strength / 255.0) * falls
        return light


def _shift(x: float, y: float) -> NDArray[np.float64]:
    """Shift of an image by (x, y) px as a homography."""
    return np.array([[1.0, 0.0, x], [0.0, 1.0, y], [0.0, 0.0, 1.0]])


def prepare_light_map(
    screen: Screen,
    T_cam_plate: NDArray[np.float64],
    size: tuple[int, int],
    strength: float,
    black: float = 0.0,
) -> LightMap:
    """Prepare the light map of a calibrated projector and camera.

    Parameters
    ----------
    screen : Screen
        The projector over the plate.
    T_cam_plate : (3, 3) float64
        Homography from the seen face, mm, to the camera's image, px.
    size : (width, height) of the camera's image, px
    strength : float
        The projector's white over the light of the room.
    black : float, grey levels
        What a pixel of the camera reads without any light.

    Raises
    ------
    ValueError
        If the strength is negative.
    """
    if not strength >= 0:
        raise ValueError(
            f"projector strength must be 0 or more, got {strength:g}; measure it again with"
            " `touchplate calibrate projector`"
        )
    T = np.asarray(T_cam_plate @ np.linalg.inv(screen.T_px_plate), dtype=np.float64)
    return LightMap(T, size, strength, black)


def divided(
    image: NDArray[np.uint8], light: NDArray[np.float32], black: float = 0.0
) -> NDArray[np.uint8]:
    """Take the projector's light out of an image.

    Parameters
    ----------
    image : (H, W) uint8
    light : (H, W) float32
        From `LightMap.on_camera`.
    black : float, grey levels
        What a pixel reads without any light.

    Returns
    -------
    (H, W) uint8, rounded; the image itself where no light falls.
    """
    left, top, wide, high = cv2.boundingRect((light > 1.0).astype(np.uint8))
    if not wide:
        return image
    part = np.s_[top : top + high, left : left + wide]
    corrected = image.copy()
    corrected[part] = np.clip(np.rint((image[part] - black) / light[part] + black), 0, 255)
    return corrected
