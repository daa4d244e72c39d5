"""Photographs: images of a file as `dic` reads them, those in colour by their luminance."""

from __future__ import annotations

import struct
import warnings
import zlib
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from PIL import Image

import dic
from rig.system.arrays import AnyArray

_COLOURED = ("RGB", "RGBA", "RGBX", "P", "PA", "LA", "CMYK", "YCbCr", "LAB", "HSV")
_DAMAGED = (  # what Pillow raises where the bytes of a file do not fit together
    OSError,
    SyntaxError,
    EOFError,
    ValueError,
    TypeError,
    LookupError,
    ArithmeticError,
    struct.error,
    zlib.error,
    Image.DecompressionBombError,
)


def read_photograph(path: Path) -> AnyArray:
    """Read an image (H, W), grey levels; the luminance (ITU-R BT.601, 8 bit) of one in colour.

    Raises
    ------
    OSError, ValueError
        As `dic.read_image`, but for colour.
    """
    return read_page(path, 0) if is_coloured(path) else dic.read_image(path)


def read_page(path: Path, number: int) -> AnyArray:
    """Read one of the images that a file holds, as `read_photograph` does.

    Raises
    ------
    OSError
        It cannot be read.
    ValueError
        It is none that can be correlated.
    """
    try:
        with warnings.catch_warnings(action="ignore"), Image.open(path) as image:
            image.seek(number)
            pixels = np.asarray(image.convert("L") if image.mode in _COLOURED else image)
    except _DAMAGED as error:
        raise OSError(
            f"image {number + 1} of {path} cannot be read ({error}); copy or record it again"
        ) from None
    return dic.check_image(pixels, "photographed")


def is_coloured(path: Path) -> bool:
    """Whether a file holds an image in colour, by the first one."""
    try:
        with warnings.catch_warnings(action="ignore"), Image.open(path) as image:
            return image.mode in _COLOURED
    except _DAMAGED:  # who reads it will say so
        return False


@dataclass(frozen=True)
class Pages:
    """Images that a file holds one after the other.

    Attributes
    ----------
    whole : int
        How many can be read.
    cut : bool
        Whether others followed that are not in the file any more.
    """

    whole: int
    cut: bool = False


def pages_of(path: Path) -> Pages:
    """Count the images of a file; one where none can be read, which who reads it will say."""
    try:
        with warnings.catch_warnings(action="ignore"), Image.open(path) as image:
            return Pages(int(getattr(image, "n_frames", 1)))
    except _DAMAGED:
        whole = _whole_pages(path)
        return Pages(whole, cut=True) if whole else Pages(1)


def _whole_pages(path: Path) -> int:
    """Count the images before the place where a file breaks off."""
    found = 0
    with suppress(*_DAMAGED), warnings.catch_warnings(action="ignore"), Image.open(path) as image:
        while True:
            image.seek(found)
            found += 1
    while found and not _is_readable(path, found - 1):  # the last one that begins may not end
        found -= 1
    return found


def _is_readable(path: Path, number: int) -> bool:
    try:
        read_page(path, number)
    except OSError:
        return False
    except ValueError:  # it is there, if of no use
        return True
    return True
