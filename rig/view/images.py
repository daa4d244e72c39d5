"""Images for a browser: 8 bit, and no larger than a screen can show."""

from __future__ import annotations

import cv2
import numpy as np

from rig.system.arrays import AnyArray, Grey

LARGEST = 4096  # px, of the longer side
_QUALITY = 92
_CLIPPED = 0.1, 99.9  # percentiles that become black and white where an image is not of 8 bit


def packed(image: AnyArray) -> bytes:
    """Pack an image (H, W) as JPEG, smaller by a whole factor where it is larger than `LARGEST`.

    Raises
    ------
    OSError
        It cannot be packed.
    """
    factor = -(-max(image.shape) // LARGEST)
    grey = _eight_bit(image)
    if factor > 1:
        size = image.shape[1] // factor, image.shape[0] // factor
        grey = cv2.resize(grey, size, interpolation=cv2.INTER_AREA)
    done, data = cv2.imencode(".jpg", grey, [cv2.IMWRITE_JPEG_QUALITY, _QUALITY])
    if not done:
        raise OSError("an image could not be packed for the page; convert it to PNG")
    return data.tobytes()


def _eight_bit(image: AnyArray) -> Grey:
    if image.dtype == np.uint8:
        return image
    dark, bright = np.percentile(image[::4, ::4], _CLIPPED)
    light = (image - dark) / max(float(bright - dark), 1e-12)
    return np.rint(255 * np.clip(light, 0, 1)).astype(np.uint8)
