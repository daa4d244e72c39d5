"""Grey pictures: read from a file, and checked at the door."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

_GREY_MODES = ("L", "I;16", "I;16L", "I;16B", "F")


def read_image(path: str | Path) -> NDArray:
    """Read a grey picture.

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
        The file is missing, truncated or not a picture.
    ValueError
        The picture is in colour, or of another depth.
    """
    # Not OpenCV: it fills the missing part of a truncated JPEG with grey and goes on.
    from PIL import Image, UnidentifiedImageError

    path = Path(path)
    if not path.is_file():
        raise FileNotFoundError(f"image {path} does not exist; check the path")
    try:
        with warnings.catch_warnings(action="ignore"), Image.open(path) as picture:
            picture.load()
            mode, pixels = picture.mode, np.asarray(picture)
    except UnidentifiedImageError:
        raise OSError(
            f"{path} is not an image that can be read; use PNG, TIFF, BMP or JPEG"
        ) from None
    except (OSError, SyntaxError, EOFError) as error:
        raise OSError(f"image {path} is damaged ({error}); copy or record it again") from None
    if mode in ("RGB", "RGBA") and _channels_equal(pixels):
        return np.ascontiguousarray(pixels[..., 0])
    if mode not in _GREY_MODES:
        raise ValueError(f"image {path} is not grey (mode {mode}); convert it to 8 or 16 bit grey")
    if mode.startswith("I;16"):
        return np.ascontiguousarray(pixels, dtype=np.uint16)
    return np.ascontiguousarray(pixels)


def _channels_equal(pixels: NDArray) -> bool:
    return bool(
        (pixels[..., 0] == pixels[..., 1]).all() and (pixels[..., 0] == pixels[..., 2]).all()
    )


def check_image(image: ArrayLike, name: str) -> NDArray:
    """Return `image` as an (H, W) array that can be correlated, or say why not.

    Raises
    ------
    ValueError
        It is not two-dimensional, of another type than uint8, uint16 or float, or not finite.
    """
    image = np.asarray(image)
    if image.ndim == 3:
        raise ValueError(
            f"{name} image has {image.shape[2]} channels; convert it to grey, shape (H, W)"
        )
    if image.ndim != 2 or min(image.shape) < 8:
        raise ValueError(f"{name} image must be (H, W) of 8 px or more, got shape {image.shape}")
    if image.dtype not in (np.uint8, np.uint16) and not np.issubdtype(image.dtype, np.floating):
        raise ValueError(f"{name} image must be uint8, uint16 or float, got {image.dtype}; cast it")
    if np.issubdtype(image.dtype, np.floating) and not np.isfinite(image).all():
        bad = np.count_nonzero(~np.isfinite(image))
        raise ValueError(
            f"{name} image holds {bad} pixels that are not finite; "
            "set them to 0 and exclude them by roi"
        )
    return image


def check_pair(reference: tuple[int, int], deformed: tuple[int, int]) -> None:
    """Raise ValueError unless the shapes (H, W) of a pair agree."""
    if reference != deformed:
        raise ValueError(
            f"reference is {reference[1]}x{reference[0]} px, deformed is "
            f"{deformed[1]}x{deformed[0]} px; a pair must come from one camera setting"
        )
