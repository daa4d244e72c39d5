"""A pair of images, of which the second is read back by a motion that is nearly right."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from dic import DisplacementField, Grid, Reference, spline_coefficients, warp_image
from models.arrays import F32, F64, I64, AnyArray, Mask
from models.field_net.rendered_pairs import CELL

_SLOPE = 40.0  # px, over which the gradient is taken that carries a motion on


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

    Points that were not measured take part with the motion of the nearest one that was, carried on
    by the gradient around it; so is that of the outermost points beyond them. It is a mean over
    `_SLOPE` px, for the slope of a short wave leads nowhere.
    """
    grid = found.grid
    if grid is None or not found.valid.any():
        raise ValueError(
            "a first motion needs a grid with a point that was measured; correlate one"
        )
    near = _nearest_valid(found.valid.reshape(grid.shape)).ravel()
    slopes = _around(np.nan_to_num(found.gradient[near]), grid)  # a shift knows none
    carried = np.einsum("nak,nk->an", slopes, found.xy - found.xy[near])
    motion = np.stack([found.u[near], found.v[near]]) + carried
    pixels = _on_all_pixels(grid, motion, slopes, shape)
    along, down = (_spline(line, _middles(n, CELL)) for line, n in _sides(grid, shape))
    sigma = np.stack([found.sigma_u[near], found.sigma_v[near]]).reshape(2, *grid.shape)
    spread = np.exp(down @ np.log(np.maximum(sigma, 1e-6)) @ along.T)
    return PairMotion(pixels.astype(np.float32), spread.astype(np.float32))


def _on_all_pixels(grid: Grid, motion: F64, slopes: F64, shape: tuple[int, int]) -> F64:
    """Motion (2, H, W) by splines through points, (2, N), and beyond them by slopes, (N, 2, 2)."""
    x, y = (_middles(n, 1) for _, n in _sides(grid, shape))
    along, down = _spline(grid.xs, x), _spline(grid.ys, y)
    pixels = down @ motion.reshape(2, *grid.shape) @ along.T
    right, below = np.moveaxis(slopes, 0, -1).reshape(2, 2, *grid.shape).swapaxes(0, 1)
    pixels += (down @ right @ along.T) * _beyond(grid.xs, x)
    pixels += (down @ below @ along.T) * _beyond(grid.ys, y)[:, None]
    return pixels


def _around(slopes: F64, grid: Grid) -> F64:
    """Mean of gradients (N, 2, 2) over the points around each."""
    from scipy.ndimage import uniform_filter

    side = 2 * round(_SLOPE / (2 * grid.step)) + 1
    laid = slopes.reshape(*grid.shape, 2, 2)
    mean = uniform_filter(laid, side, axes=(0, 1), mode="nearest")
    return np.asarray(mean.reshape(-1, 2, 2), np.float64)


def _sides(grid: Grid, shape: tuple[int, int]) -> tuple[tuple[AnyArray, int], ...]:
    """Columns and rows of a grid, each with the number of pixels along it."""
    return (grid.xs, shape[1]), (grid.ys, shape[0])


def _nearest_valid(valid: Mask) -> I64:
    """Find the number of the nearest point that was measured, of each point (R, C)."""
    from scipy.ndimage import distance_transform_edt

    row, column = np.asarray(
        distance_transform_edt(~valid, return_distances=False, return_indices=True)
    )
    return np.asarray(row * valid.shape[1] + column, np.int64)


def _middles(count: int, cell: int) -> F64:
    """Places of the middles of cells along a side of so many pixels."""
    return np.asarray(cell * np.arange(count // cell) + (cell - 1) / 2, np.float64)


def _beyond(line: AnyArray, at: F64) -> F64:
    """How far places lie beyond the ends of a line, with its sign; 0 between them."""
    return np.asarray(at - np.clip(at, line[0], line[-1]), np.float64)


def _spline(line: AnyArray, at: F64) -> F64:
    """Matrix from values on a line of places to those at others, which are kept on the line."""
    from scipy.interpolate import CubicSpline

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
