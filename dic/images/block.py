"""Blocks of coefficients for one subset, from a frame filtered whole or only where needed."""

from __future__ import annotations

import numpy as np

from dic.arrays import F32, I64, AnyArray
from dic.compiled import njit
from dic.images.spline import filter_square

RIM = 7
"""Pixels around a block in which the recursive filter forgets its border: 0.43^7 = 0.3 %."""


@njit(cache=True, nogil=True)
def read(plane: F32, x: int, y: int, width: int, block: F32) -> None:
    """Copy `width` columns and rows from (x, y) on; beyond the border stands the nearest value."""
    rows, columns = plane.shape
    for j in range(width):
        line = plane[min(max(y + j, 0), rows - 1)]
        if x >= 0 and x + width <= columns:
            for i in range(width):
                block[j * width + i] = line[x + i]
        else:
            for i in range(width):
                block[j * width + i] = line[min(max(x + i, 0), columns - 1)]


@njit(cache=True, nogil=True)
def read_part(
    image: AnyArray, x: int, y: int, width: int, part: F32, corner: I64, taps: F32, block: F32
) -> None:
    """Copy a block from the filtered part of an image, which is filtered anew if it must move.

    `part` (2, P, P) holds the pixels and, filtered, their coefficients from `corner` (2,) px on.
    `taps` (2 R + 1,) is the prefilter that the pixels pass first, (1,) for none.
    """
    rim = RIM + taps.shape[0] // 2
    spare = part.shape[1] - width
    away_x, away_y = x - corner[0], y - corner[1]
    if min(away_x, away_y) < rim or max(away_x, away_y) > spare - rim:
        away_x = away_y = spare // 2
        corner[0], corner[1] = x - away_x, y - away_y
        cut(image, corner[0], corner[1], part[0])
        if taps.shape[0] > 1:
            _smooth(part[0], taps, part[1])
        filter_square(part[0], part[1])
    read(part[0], away_x, away_y, width, block)


@njit(cache=True, nogil=True, fastmath=True)
def _smooth(square: F32, taps: F32, scratch: F32) -> None:
    """Convolve a square with `taps` along both axes; its border stands for what lies beyond."""
    size, reach = square.shape[0], taps.shape[0] // 2
    for i in range(size):
        scratch[i] = 0
        for k in range(taps.shape[0]):
            row = square[min(max(i + k - reach, 0), size - 1)]
            for j in range(size):
                scratch[i, j] += taps[k] * row[j]
    for i in range(size):
        row = scratch[i]
        square[i] = 0
        for k in range(taps.shape[0]):
            aside = k - reach
            for j in range(max(-aside, 0), min(size - aside, size)):
                square[i, j] += taps[k] * row[j + aside]
            for j in range(max(-aside, 0)):
                square[i, j] += taps[k] * row[0]
            for j in range(min(size - aside, size), size):
                square[i, j] += taps[k] * row[size - 1]


@njit(cache=True, nogil=True)
def cut(image: AnyArray, x: int, y: int, part: F32) -> None:
    """Copy a part of the image, gone on beyond its border, less the level of its middle."""
    rows, columns = image.shape
    level = np.float32(_grey(image, x + part.shape[1] // 2, y + part.shape[0] // 2))
    inside = x >= 0 and x + part.shape[1] <= columns
    for j in range(part.shape[0]):
        into = part[j]
        if inside and 0 <= y + j < rows:
            line = image[y + j, x : x + into.shape[0]]
            for i in range(into.shape[0]):
                into[i] = np.float32(line[i]) - level
        else:
            for i in range(into.shape[0]):
                into[i] = np.float32(_grey(image, x + i, y + j)) - level


@njit(cache=True, nogil=True)
def _grey(image: AnyArray, x: int, y: int) -> float:
    """Grey level of a pixel, beyond the border as in `dic.images.spline.coefficients`."""
    rows = image.shape[0]
    if y < 0 or y >= rows:
        end = 0 if y < 0 else rows - 1
        return 2 * _grey_in_row(image[end], x) - _grey_in_row(image[_mirror(y, rows)], x)
    return _grey_in_row(image[y], x)


@njit(cache=True, nogil=True)
def _grey_in_row(row: AnyArray, x: int) -> float:
    count = row.shape[0]
    if x < 0 or x >= count:
        end = 0 if x < 0 else count - 1
        return 2 * np.float64(row[end]) - np.float64(row[_mirror(x, count)])
    return np.float64(row[x])


@njit(cache=True, nogil=True)
def _mirror(i: int, count: int) -> int:
    if i < 0:
        i = -i
    if i >= count:
        i = 2 * count - 2 - i
    return min(max(i, 0), count - 1)
