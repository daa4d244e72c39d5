"""Tile sums: what a frame says about small motions of the pattern, pixel by pixel, in one pass.

With the reference f, its gradient ∇f and the difference e = g - f of a frame g, the sums Σ∇f∇fᵀ and
Σ∇f·e over small tiles are a sufficient statistic for every motion that is smooth over a tile:
whatever is fitted to them is fitted to the pixels. The *reference* is moved to the expected motion,
never the frame: the frame's noise stays white, the spline is prepared once, and a motion that is
constant over a tile makes the interpolation separable.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy import ndimage

DEGREE = 5  # of the B-spline
MARGIN = 8  # px kept free at the border, so that a moved tile still lies on the picture


@dataclass(frozen=True)
class Tiles:
    """Square tiles side by side over a picture.

    Attributes
    ----------
    size : int, px
        Side of a tile.
    origin : (int, int), px
        Column and row of the first pixel of the first tile.
    shape : (rows, columns)
        T = rows · columns tiles in row-major order.
    """

    size: int
    origin: tuple[int, int]
    shape: tuple[int, int]

    @property
    def xs(self) -> NDArray[np.float64]:
        """Columns of the tile centres, (columns,) px."""
        return self.origin[0] + (self.size - 1) / 2 + self.size * np.arange(float(self.shape[1]))

    @property
    def ys(self) -> NDArray[np.float64]:
        """Rows of the tile centres, (rows,) px."""
        return self.origin[1] + (self.size - 1) / 2 + self.size * np.arange(float(self.shape[0]))

    @property
    def xy(self) -> NDArray[np.float64]:
        """Centres of the tiles, (T, 2) px."""
        x, y = np.meshgrid(self.xs, self.ys)
        return np.column_stack([x.ravel(), y.ravel()])

    def sums(self, picture: NDArray) -> NDArray:
        """Sum a picture (H, W) over each tile, (T,)."""
        (left, top), (rows, columns), size = self.origin, self.shape, self.size
        covered = picture[top : top + size * rows, left : left + size * columns]
        return covered.reshape(rows, size, columns, size).sum(axis=(1, 3)).ravel()


@dataclass(frozen=True, eq=False)
class TileReference:
    """The undeformed picture, prepared for tile sums.

    Attributes
    ----------
    tiles : Tiles
    image : (H, W) float32, grey levels
        Mean of the reference frames.
    coefficients : (H, W) float32
        Quintic B-spline coefficients of `image`; a cubic shrinks motions below a pixel by 2 %.
    gradient : (2, H, W) float32, grey levels per px
        ∂f/∂x and ∂f/∂y of the spline at the pixels.
    hessian : (T, 3) float64
        Σfx², Σfxfy, Σfy² of each tile.
    light : (T, 6) float64
        Σfx f, Σfy f, Σfx, Σfy, Σf², Σf: how a gain and an offset of the light mix with motion.
    """

    tiles: Tiles
    image: NDArray[np.float32]
    coefficients: NDArray[np.float32]
    gradient: NDArray[np.float32]
    hessian: NDArray[np.float64]
    light: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class TileSums:
    """Sums of one frame over the tiles of a reference that was moved by `flow`.

    Attributes
    ----------
    gradient : (T, 2) float64
        Σ∇f·e with e = g - f. The motion left over, δ = d - flow, obeys H δ = -Σ∇f·e.
    e, ee, ef : (T,) float64
        Σe, Σe², Σe·f.
    flow : (T, 2) float64, px
        Motion by which the reference was moved before it was compared; zero if it was not.
    """

    gradient: NDArray[np.float64]
    e: NDArray[np.float64]
    ee: NDArray[np.float64]
    ef: NDArray[np.float64]
    flow: NDArray[np.float64]


def lay_tiles(shape: tuple[int, int], size: int = 16) -> Tiles:
    """Lay tiles over the middle of a picture of `shape` (H, W), `MARGIN` or more from its border.

    Raises
    ------
    ValueError
        If the tiles are smaller than 4 px or none fits.
    """
    height, width = shape
    rows, columns = (height - 2 * MARGIN) // size, (width - 2 * MARGIN) // size
    if size < 4 or rows < 1 or columns < 1:
        raise ValueError(
            f"tile size must be 4 px or more and fit the picture less {MARGIN} px at each side, "
            f"got {size} px on {width}x{height} px; choose another size"
        )
    origin = ((width - size * columns) // 2, (height - size * rows) // 2)
    return Tiles(size, origin, (rows, columns))


def prepare_tiles(image: NDArray, size: int = 16) -> TileReference:
    """Prepare a reference picture for tile sums.

    Parameters
    ----------
    image : (H, W) array, grey levels
        The mean of several frames where they can be had: noise in ∇f makes motion look too small.
    size : int, px
        Side of a tile, 4 or more.

    Raises
    ------
    ValueError
        If the picture is not grey, holds NaN, or is too small for one tile.
    """
    picture = _grey(image).astype(np.float32)
    tiles = lay_tiles(picture.shape, size)
    f = picture.astype(np.float64)
    coefficients = ndimage.spline_filter(f, order=DEGREE, mode="mirror")
    fx, fy = gradient = _spline_gradient(coefficients)
    return TileReference(
        tiles=tiles,
        image=picture,
        coefficients=coefficients.astype(np.float32),
        gradient=gradient.astype(np.float32),
        hessian=np.column_stack([tiles.sums(a) for a in (fx * fx, fx * fy, fy * fy)]),
        light=np.column_stack([tiles.sums(a) for a in (fx * f, fy * f, fx, fy, f * f, f)]),
    )


def tile_sums(
    reference: TileReference, image: NDArray, flow: NDArray[np.float64] | None = None
) -> TileSums:
    """Sum ∇f·e, e, e² and e·f over the tiles of one frame.

    Parameters
    ----------
    image : (H, W) array, grey levels
    flow : (T, 2) float64, px, optional
        Expected motion of each tile; the reference is moved there first (quintic B-spline). Without
        it the picture is compared in place, which is right to (d/2)² for motions below a pixel.

    Raises
    ------
    ValueError
        If the picture is not grey or holds NaN, or picture or flow do not match the reference.
    """
    image = _grey(image)
    if image.shape != reference.image.shape:
        raise ValueError(
            f"picture is {_size(image.shape)} px and the reference {_size(reference.image.shape)} "
            "px; take both with the same camera settings"
        )
    tiles = reference.tiles
    count = len(reference.hessian)
    layout = tiles.origin, tiles.size, tiles.shape
    sums = np.empty((count, 5))
    if flow is None:
        _sums_in_place(image, reference.image, reference.gradient, *layout, sums)
        flow = np.zeros((count, 2))
    else:
        flow = np.asarray(flow, dtype=np.float64)
        if flow.shape != (count, 2) or not np.abs(flow).max() < max(image.shape):
            raise ValueError(
                f"flow must be ({count}, 2) px, one motion a tile within the picture; "
                f"got shape {flow.shape} and motions up to {np.abs(flow).max():g} px"
            )
        _sums_moved(image, reference.coefficients, flow, *layout, sums)
    return TileSums(sums[:, :2], sums[:, 2], sums[:, 3], sums[:, 4], flow)


def _grey(image: NDArray) -> NDArray:
    picture = np.asarray(image)
    if picture.ndim != 2:
        raise ValueError(
            f"picture must be grey, (H, W), got shape {picture.shape}; convert it to grey first"
        )
    if picture.dtype.kind == "f" and not np.isfinite(picture).all():
        raise ValueError("picture holds NaN or infinite grey levels; replace them first")
    return picture


def _size(shape: tuple[int, ...]) -> str:
    return f"{shape[1]}x{shape[0]}"


def _spline_gradient(coefficients: NDArray) -> NDArray:
    """∂/∂x and ∂/∂y of a quintic B-spline at its knots, (2, H, W)."""
    value, slope = np.empty(6), np.empty(6)
    _weights(0.0, value, slope)

    def along(array: NDArray, weights: NDArray, axis: int) -> NDArray:
        return ndimage.correlate1d(array, weights[:5], axis=axis, mode="mirror")

    return np.stack(
        [
            along(along(coefficients, slope, 1), value, 0),
            along(along(coefficients, value, 1), slope, 0),
        ]
    )


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def _sums_in_place(image, reference, gradient, origin, size, shape, out):
    rows, columns = shape
    width = size * columns
    columnwise = np.empty((5, width), np.float32)
    for row in range(rows):
        columnwise[:] = 0.0
        for y in range(origin[1] + row * size, origin[1] + (row + 1) * size):
            for x in range(width):
                f = reference[y, x + origin[0]]
                e = np.float32(image[y, x + origin[0]]) - f
                columnwise[0, x] += gradient[0, y, x + origin[0]] * e
                columnwise[1, x] += gradient[1, y, x + origin[0]] * e
                columnwise[2, x] += e
                columnwise[3, x] += e * e
                columnwise[4, x] += e * f
        for column in range(columns):
            for k in range(5):
                total = 0.0
                for x in range(column * size, (column + 1) * size):
                    total += columnwise[k, x]
                out[row * columns + column, k] = total


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def _weights(t, value, slope):
    """Weigh the knots -2 … 3 at the fraction t and their derivatives, by de Boor's recursion."""
    value[:] = 0.0
    value[0] = 1.0
    for degree in range(1, DEGREE + 1):
        if degree == DEGREE:
            slope[0] = -value[0]
            for j in range(1, DEGREE + 1):
                slope[j] = value[j - 1] - value[j]
        for j in range(degree, -1, -1):
            before = value[j - 1] if j else 0.0
            value[j] = ((t + degree - j) * before + (j + 1 - t) * value[j]) / degree


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def _sums_moved(image, coefficients, flow, origin, size, shape, out):
    reach = size + DEGREE
    patch = np.empty((reach, reach), np.float32)
    values, slopes = np.empty((reach, size), np.float32), np.empty((reach, size), np.float32)
    f = np.empty((size, size), np.float32)
    fx, fy = np.empty_like(f), np.empty_like(f)
    wx, sx = np.empty(DEGREE + 1, np.float32), np.empty(DEGREE + 1, np.float32)
    wy, sy = np.empty(DEGREE + 1, np.float32), np.empty(DEGREE + 1, np.float32)
    for tile in range(shape[0] * shape[1]):
        left = origin[0] + (tile % shape[1]) * size
        top = origin[1] + (tile // shape[1]) * size
        # f(x - d): the knots start two before floor(-d).
        ix, iy = int(np.floor(-flow[tile, 0])), int(np.floor(-flow[tile, 1]))
        _weights(-flow[tile, 0] - ix, wx, sx)
        _weights(-flow[tile, 1] - iy, wy, sy)
        _cut(coefficients, left + ix - 2, top + iy - 2, patch)
        _along(patch, wx, values)
        _along(patch, sx, slopes)
        _down(values, wy, f)
        _down(slopes, wy, fx)
        _down(values, sy, fy)
        _add(image[top : top + size, left : left + size], f, fx, fy, out[tile])


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def _cut(array, left, top, patch):
    """Copy a patch; beyond the border the nearest value stands."""
    height, width = array.shape
    side = len(patch)
    for j in range(side):
        y = min(max(top + j, 0), height - 1)
        if left >= 0 and left + side <= width:
            patch[j, :] = array[y, left : left + side]
        else:
            for i in range(side):
                patch[j, i] = array[y, min(max(left + i, 0), width - 1)]


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def _along(patch, weights, out):
    """Weigh six neighbours along x; weights in registers let the loop run on vectors."""
    a, b, c, d, e, f = weights[0], weights[1], weights[2], weights[3], weights[4], weights[5]
    for j in range(out.shape[0]):
        for i in range(out.shape[1]):
            out[j, i] = (
                a * patch[j, i] + b * patch[j, i + 1] + c * patch[j, i + 2]
                + d * patch[j, i + 3] + e * patch[j, i + 4] + f * patch[j, i + 5]
            )  # fmt: skip


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def _down(rows, weights, out):
    """Weigh six neighbours along y."""
    a, b, c, d, e, f = weights[0], weights[1], weights[2], weights[3], weights[4], weights[5]
    for j in range(out.shape[0]):
        for i in range(out.shape[1]):
            out[j, i] = (
                a * rows[j, i] + b * rows[j + 1, i] + c * rows[j + 2, i]
                + d * rows[j + 3, i] + e * rows[j + 4, i] + f * rows[j + 5, i]
            )  # fmt: skip


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def _add(image, f, fx, fy, out):
    """Sum fx·e, fy·e, e, e², e·f over one tile."""
    zero = np.float32(0.0)
    fx_e, fy_e, e_, ee, ef = zero, zero, zero, zero, zero
    for j in range(f.shape[0]):
        for i in range(f.shape[1]):
            e = np.float32(image[j, i]) - f[j, i]
            fx_e += fx[j, i] * e
            fy_e += fy[j, i] * e
            e_ += e
            ee += e * e
            ef += e * f[j, i]
    out[0], out[1], out[2], out[3], out[4] = fx_e, fy_e, e_, ee, ef
