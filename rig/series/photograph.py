"""Photographs: images of a file as `dic` reads them, those in colour by their luminance."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
from PIL import Image

import dic
from rig.system.arrays import AnyArray

_COLOURED = ("RGB", "RGBA", "RGBX", "P", "PA", "LA", "CMYK", "YCbCr", "LAB", "HSV")


def read_photograph(path: Path) -> AnyArray:
    """Read an image (H, W), grey levels; the luminance (ITU-R BT.601, 8 bit) of one in colour.

    Raises
    ------
    OSError, ValueError
        As `dic.read_image`, but for colour.
    """
    try:
        return dic.read_image(path)
    except ValueError:
        if not is_coloured(path):
            raise
    with Image.open(path) as image:
        return luminance(image)


def luminance(image: Image.Image) -> AnyArray:
    """Pixels (H, W) of an image, as they are or, of one in colour, its luminance."""
    return np.asarray(image.convert("L") if image.mode in _COLOURED else image)


def is_coloured(path: Path) -> bool:
    """Whether a file holds an image in colour."""
    try:
        with warnings.catch_warnings(action="ignore"), Image.open(path) as image:
            return image.mode in _COLOURED
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError):
        return False


def page_count(path: Path) -> int:
    """Images that a file holds; 1 where it cannot be opened, which who reads it will say."""
    try:
        with warnings.catch_warnings(action="ignore"), Image.open(path) as image:
            return int(getattr(image, "n_frames", 1))
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError):
        return 1
