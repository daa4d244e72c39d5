"""Gray code: stripes that tell every pixel of the camera which pixel of the projector it sees."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from rig.system.arrays import Real

CLEAR = 0.2  # of the span from dark to light: stripe and inverse differ by more, or it is no bit
LIT = 12.0  # grey levels from dark to light; less is not lit by the projector


def bits(size: tuple[int, int]) -> tuple[int, int]:
    """Count the stripe patterns for columns and for rows."""
    return (size[0] - 1).bit_length(), (size[1] - 1).bit_length()


def count(size: tuple[int, int]) -> int:
    """Count the images of a projector of `size` px: white, black, stripes and their inverses."""
    return 2 + 2 * sum(bits(size))


def pattern(size: tuple[int, int], number: int) -> NDArray[np.uint8]:
    """Image (H, W) to project: 0 all light, 1 all dark, then stripes, each before its inverse.

    Columns come first, the widest stripes first; size = (width, height), px.
    """
    width, height = size
    if number < 2:
        return np.full((height, width), (255, 0)[number], np.uint8)
    place, inverse = divmod(number - 2, 2)
    columns, rows = bits(size)
    axis, bit = (0, columns - 1 - place) if place < columns else (1, columns + rows - 1 - place)
    along = np.arange(size[axis])
    line = np.where((along ^ (along >> 1)) >> bit & 1, 255, 0).astype(np.uint8)
    line = 255 - line if inverse else line
    wide = line[None, :] if axis == 0 else line[:, None]
    return np.ascontiguousarray(np.broadcast_to(wide, (height, width)))


def patterns(size: tuple[int, int]) -> list[NDArray[np.uint8]]:
    """Return all images to project, in order."""
    return [pattern(size, number) for number in range(count(size))]


def decode(
    images: Sequence[Real], size: tuple[int, int]
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Read which pixel of the projector every pixel of the camera sees.

    Parameters
    ----------
    images : sequence of (H, W) arrays, grey levels
        One for each of `patterns`, in its order; means of several frames where noise is high.
    size : (width, height) of the projector, px

    Returns
    -------
    seen : (H, W, 2) float64, px
        Column and row.
    valid : (H, W) bool
        Where all bits were clear.

    Raises
    ------
    ValueError
        If there is not one image for each pattern.
    """
    columns, rows = bits(size)
    expected = count(size)
    if len(images) != expected:
        raise ValueError(
            f"Gray code for {size[0]} × {size[1]} px has {expected} images, got {len(images)};"
            " take one of each pattern"
        )
    light, dark, *stripes = (np.asarray(image, dtype=np.float32) for image in images)
    span = light - dark
    valid = span > LIT
    read: list[NDArray[np.int64]] = []
    for start, digits in ((0, columns), (2 * columns, rows)):
        number = np.zeros(span.shape, dtype=np.int64)
        bit = np.zeros(span.shape, dtype=np.int64)
        for k in range(start, start + 2 * digits, 2):
            difference = stripes[k] - stripes[k + 1]
            valid &= np.abs(difference) > CLEAR * span
            bit ^= difference > 0
            number = 2 * number + bit
        read.append(number)
    seen = np.stack(read, axis=-1)
    valid &= (seen < np.array(size)).all(axis=-1)
    return seen.astype(np.float64), valid
