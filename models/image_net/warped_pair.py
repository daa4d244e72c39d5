"""A pair of images, of which the second is read back by a motion that is nearly right."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from dic import DisplacementField, Reference, spline_coefficients, warp_image
from models.arrays import F32, F64, AnyArray, Mask

CELL = 2  # px along a side of the cells on which the net works


@dataclass(frozen=True, eq=False)
class ImagePair:
    """A reference and a deformed image that have passed the same prefilter.

    Attributes
    ----------
    first : (H, W) float32, grey levels
    spline : (H + 6, W + 6) float32
        Coefficients of the second image.
    weight : (H, W) float32
        1 where the first is looked at, 0 outside of its ROI.
    """

    first: F32
    spline: F32
    weight: F32

    def second(self, motion: F32) -> F32:
        """Read the second image where a motion (2, H, W) px takes the pixels of the first."""
        return warp_image(self.spline, motion)


def image_pair(ref: Reference, image: AnyArray) -> ImagePair:
    """Bring a reference and a deformed image through the prefilter of the reference."""
    smooth = np.asarray(ref.prefilter.apply(image), np.float32)
    first = np.asarray(ref.prefilter.apply(ref.image), np.float32)
    weight = (ref.texture[3] > 0).astype(np.float32)
    return ImagePair(first, spline_coefficients(smooth), weight)


@dataclass(frozen=True, eq=False)
class PairMotion:
    """What is known of the motion so far.

    Attributes
    ----------
    pixels : (2, H, W) float32, px
        By which the second image is read.
    sigma : (2, R, C) float32, px
        Its σ, cell by cell.
    """

    pixels: F32
    sigma: F32

    @property
    def cells(self) -> F32:
        """Mean over each cell, (2, R, C)."""
        return np.stack([on_cells(part) for part in self.pixels])


def first_motion(found: DisplacementField, shape: tuple[int, int]) -> PairMotion:
    """Motion of an image (H, W) from a field on a grid: cubic splines through its points.

    Points that were not measured take part with the nearest one that was; beyond the outermost
    points the motion is theirs.
    """
    grid = found.grid
    if grid is None or not found.valid.any():
        raise ValueError(
            "a first motion needs a grid with a point that was measured; correlate one"
        )
    values = np.stack([found.u, found.v, found.sigma_u, found.sigma_v]).reshape(4, *grid.shape)
    u, v, *sigma = _filled(values, found.valid.reshape(grid.shape))
    along, down = _spline(grid.xs, shape[1], 1), _spline(grid.ys, shape[0], 1)
    pixels = np.stack([down @ part @ along.T for part in (u, v)]).astype(np.float32)
    along, down = _spline(grid.xs, shape[1], CELL), _spline(grid.ys, shape[0], CELL)
    spread = [np.exp(down @ np.log(np.maximum(part, 1e-6)) @ along.T) for part in sigma]
    return PairMotion(pixels, np.stack(spread).astype(np.float32))


def _filled(values: F64, valid: Mask) -> F64:
    from scipy.ndimage import distance_transform_edt

    if valid.all():
        return values
    row, column = np.asarray(
        distance_transform_edt(~valid, return_distances=False, return_indices=True)
    )
    return values[:, row, column]


def _spline(line: AnyArray, count: int, cell: int) -> F64:
    """Matrix from values on a line of places to those at the middles of cells, kept on the line."""
    from scipy.interpolate import CubicSpline

    at = cell * np.arange(count // cell) + (cell - 1) / 2
    if len(line) < 2:
        return np.ones((len(at), 1))
    through = CubicSpline(np.asarray(line, float), np.eye(len(line)))
    return np.asarray(through(np.clip(at, line[0], line[-1])))


def on_cells(pixels: F32) -> F32:
    """Mean over each cell: (H, W) or (H, W, C) of pixels, (R, C) of cells."""
    height, width = pixels.shape[:2]
    rows, columns = height // CELL, width // CELL
    whole = np.ascontiguousarray(pixels[: rows * CELL, : columns * CELL])
    small = cv2.resize(whole, (columns, rows), interpolation=cv2.INTER_AREA)
    return np.asarray(small, np.float32)


def on_pixels(cells: F32, shape: tuple[int, int]) -> F32:
    """Interpolate (2, R, C) of cells at the pixels of an image (H, W), (2, H, W)."""
    rows, columns = cells.shape[1:]
    out = np.empty((2, *shape), np.float32)
    for a in range(2):
        size = columns * CELL, rows * CELL
        large = np.asarray(cv2.resize(cells[a], size, interpolation=cv2.INTER_CUBIC), np.float32)
        missing = shape[0] - rows * CELL, shape[1] - columns * CELL
        out[a] = np.pad(large, ((0, missing[0]), (0, missing[1])), mode="edge")
    return out
