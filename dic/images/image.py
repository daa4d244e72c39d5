"""Grey images: read from a file, and checked at the door."""

from __future__ import annotations

import struct
import warnings
import zlib
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from dic.arrays import AnyArray
from dic.numbers import LARGEST, read_path, shown

_GREY_MODES = ("L", "I;16", "I;16L", "I;16B", "F")
_COMPILED = "BHfd"  # uint8, uint16, float32, float64: what the loops are compiled for
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
)
_SMALLEST = 8  # px along a side


def read_image(path: str | Path) -> AnyArray:
    """Read a grey image.

    Parameters
    ----------
    path : str or Path
        PNG, TIFF, BMP, JPEG, ...; 8 or 16 bit a pixel, or float TIFF. A colour file is accepted
        where its three channels are equal.

    Returns
    -------
    (H, W) uint8, uint16 or float32

    Raises
    ------
    OSError
        The file is missing, truncated or not an image.
    ValueError
        The image is in colour, or of another depth.
    """
    # Not OpenCV: it fills the missing part of a truncated JPEG with grey and goes on.
    from PIL import Image, UnidentifiedImageError

    path = read_path(path)
    if path.is_dir():
        raise IsADirectoryError(f"image {str(path)!r} is a folder; name a file in it")
    if not path.is_file():
        raise FileNotFoundError(f"image {str(path)!r} does not exist; check the path")
    try:
        with warnings.catch_warnings(action="ignore"), Image.open(path) as image:
            image.load()
            mode, pixels = image.mode, np.asarray(image)
    except UnidentifiedImageError:
        raise OSError(
            f"{path} is not an image that can be read; use PNG, TIFF, BMP or JPEG"
        ) from None
    except Image.DecompressionBombError:
        raise ValueError(f"image {path} has too many pixels to be one; cut it") from None
    except _DAMAGED as error:
        raise OSError(f"image {path} is damaged ({error}); copy or record it again") from None
    if mode in ("RGB", "RGBA") and _channels_equal(pixels):
        return np.ascontiguousarray(pixels[..., 0])
    if mode not in _GREY_MODES:
        raise ValueError(f"image {path} is not grey (mode {mode}); convert it to 8 or 16 bit grey")
    if mode.startswith("I;16"):
        return np.ascontiguousarray(pixels, dtype=np.uint16)
    return np.ascontiguousarray(pixels)


def _channels_equal(pixels: AnyArray) -> bool:
    return bool(
        (pixels[..., 0] == pixels[..., 1]).all() and (pixels[..., 0] == pixels[..., 2]).all()
    )


def check_image(image: ArrayLike, name: str) -> AnyArray:
    """Return `image` as an array that can be correlated, or say why not.

    Every function of `dic` that takes an image takes it through here.

    Parameters
    ----------
    image : (H, W) uint8, uint16 or float, grey levels
    name : str
        What it is, for the sentence: "reference" or "deformed".

    Returns
    -------
    (H, W) uint8, uint16, float32 or float64, in the byte order of the machine

    Raises
    ------
    ValueError
        It is not two-dimensional or smaller than 8 px, of another type, not finite, or of grey
        levels beyond 10⁹.
    """
    try:
        grey = np.asarray(image)
    except (ValueError, TypeError):  # such as lists of different lengths
        raise ValueError(f"{name} image must be (H, W), got {shown(image)}; convert it") from None
    if grey.ndim == 3:
        raise ValueError(
            f"{name} image has {grey.shape[2]} channels; convert it to grey, shape (H, W)"
        )
    if grey.ndim != 2 or min(grey.shape) < _SMALLEST:
        raise ValueError(
            f"{name} image must be (H, W) of {_SMALLEST} px or more, got shape {grey.shape}; "
            "give one image at a time"
        )
    kind = grey.dtype.newbyteorder("=")
    if kind.kind != "f" and kind.char not in _COMPILED:
        raise ValueError(f"{name} image must be uint8, uint16 or float, got {grey.dtype}; cast it")
    if kind.kind == "f":
        _check_levels(grey, name)
    return grey.astype(kind if kind.char in _COMPILED else np.float64, copy=False)


def check_reference(image: ArrayLike) -> AnyArray:
    """Return `image` as `check_image` does, and refuse one without any pattern.

    Raises
    ------
    ValueError
        As `check_image`; or every pixel has the same grey level.
    """
    grey = check_image(image, "reference")
    if grey.min() == grey.max():
        raise ValueError(
            f"reference image is blank (grey level {grey.min():g} everywhere); "
            "it needs a pattern to follow"
        )
    return grey


def _check_levels(grey: AnyArray, name: str) -> None:
    # Least and greatest are NaN if any pixel is: half the time of asking each of them.
    if float(grey.min()) >= -LARGEST and float(grey.max()) <= LARGEST:
        return
    bad = np.count_nonzero(~np.isfinite(grey))
    if bad:
        raise ValueError(
            f"{name} image holds {bad} pixels that are not finite; "
            "set them to 0 and exclude them by roi"
        )
    raise ValueError(f"{name} image holds grey levels beyond {LARGEST:g}; scale it to 0…255")


def check_pair(reference: tuple[int, int], deformed: tuple[int, int]) -> None:
    """Raise ValueError unless the shapes (H, W) of a pair agree."""
    if reference != deformed:
        raise ValueError(
            f"reference is {reference[1]}x{reference[0]} px, deformed is "
            f"{deformed[1]}x{deformed[0]} px; a pair must come from one camera setting"
        )
