"""Tile sums: what a frame says about small motions of the pattern, pixel by pixel, in one pass.

With the reference f, its gradient ∇f and the difference e = g - f of a frame g, the sums Σ∇f∇fᵀ and
Σ∇f·e over small tiles are a sufficient statistic for every motion that is smooth over a tile:
whatever is fitted to them is fitted to the pixels. The *reference* is moved to the expected motion,
never the frame: the frame's noise stays white, the spline is prepared once, and a motion that is
constant over a tile makes the interpolation separable.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy import fft, ndimage

from dic.arrays import F32, F64, AnyArray
from dic.images.fourier import FADE, shifted
from dic.images.image import check_image, check_pair, check_reference
from dic.images.spectrum import Spectrum, aliasing_bias, error_budget, measure_spectrum
from dic.numbers import check_array, check_type, read_array, read_integer, read_shape, shown
from dic.tiles.tile_kernels import BEFORE, DEGREE, spline_weights, sums_in_place, sums_moved

MARGIN = 8  # px kept free at the border, so that a moved tile still lies on the image
_SHIFT = 0.25  # px, at which interpolation errs most


@dataclass(frozen=True)
class Tiles:
    """Square tiles side by side over an image.

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
    def xs(self) -> F64:
        """Columns of the tile centres, (columns,) px."""
        return self.origin[0] + (self.size - 1) / 2 + self.size * np.arange(float(self.shape[1]))

    @property
    def ys(self) -> F64:
        """Rows of the tile centres, (rows,) px."""
        return self.origin[1] + (self.size - 1) / 2 + self.size * np.arange(float(self.shape[0]))

    @property
    def xy(self) -> F64:
        """Centres of the tiles, (T, 2) px."""
        x, y = np.meshgrid(self.xs, self.ys)
        return np.column_stack([x.ravel(), y.ravel()])

    def sums(self, image: AnyArray) -> AnyArray:
        """Sum an image (H, W) over each tile, (T,); ValueError if it does not reach so far."""
        (left, top), (rows, columns), size = self.origin, self.shape, self.size
        reach = top + size * rows, left + size * columns
        check_array(image, "image", "biuf", 2)
        if image.shape[0] < reach[0] or image.shape[1] < reach[1]:
            raise ValueError(
                f"image must be (H, W) of {reach[1]}x{reach[0]} px or more, where the tiles lie, "
                f"got {shown(image)}; take one of the size for which they were laid"
            )
        covered = image[top : top + size * rows, left : left + size * columns]
        return covered.reshape(rows, size, columns, size).sum(axis=(1, 3)).ravel()


@dataclass(frozen=True, eq=False)
class TileReference:
    """The undeformed image, prepared for tile sums.

    Attributes
    ----------
    tiles : Tiles
    image : (H, W) float32, grey levels
        Mean of the reference frames.
    coefficients : (H, W) float32
        Coefficients of the B-spline of degree 7 through `image`; a cubic makes small motions look
        1 to 4 % too large, a quintic 0.2 to 0.9 %, this 0.4 % at most.
    gradient : (2, H, W) float32, grey levels per px
        ∂f/∂x and ∂f/∂y of the spline at the pixels.
    hessian : (T, 3) float64
        Σfx², Σfxfy, Σfy² of each tile.
    light : (T, 6) float64
        Σfx f, Σfy f, Σfx, Σfy, Σf², Σf: how a gain and an offset of the light mix with motion.
    bias : (2,) float64, px
        By how much interpolation makes a motion of a quarter pixel along x and y look too large.
    aliasing : float, px
        Error of the motion of one tile that interpolation and aliasing leave, as the spectrum of
        the pattern predicts it (`dic.images.spectrum.error_budget`); 0 where it has none.
    """

    tiles: Tiles
    image: F32
    coefficients: F32
    gradient: F32
    hessian: F64
    light: F64
    bias: F64
    aliasing: float = 0.0


@dataclass(frozen=True, eq=False)
class TileSums:
    """Sums of one frame over the tiles of a reference that was moved by `flow`.

    Attributes
    ----------
    gradient : (T, 2) float64
        Σ∇f·e with e = g - f. The motion left over, δ = d - flow, obeys H δ = -Σ∇f·e.
    e, ee, ef : (T,) float64
        Σe, Σe², Σe·f.
    hessian, light : (T, 3), (T, 6) float64
        As those of `TileReference`, of the reference as it was moved.
    flow : (T, 2) float64, px
        Motion by which the reference was moved before it was compared; zero if it was not.
    """

    gradient: F64
    e: F64
    ee: F64
    ef: F64
    hessian: F64
    light: F64
    flow: F64


def lay_tiles(shape: tuple[int, int], size: int = 16) -> Tiles:
    """Lay tiles over the middle of an image of `shape` (H, W), `MARGIN` or more from its border.

    Raises
    ------
    ValueError
        If the tiles are smaller than 4 px or none fits, or a number is no integer.
    """
    height, width = read_shape(shape, "shape")
    size = read_integer(size, "tile size", "px")
    rows, columns = ((side - 2 * MARGIN) // max(size, 1) for side in (height, width))
    if size < 4 or min(rows, columns) < 1:
        raise ValueError(
            f"tile size must be 4 px or more and fit the image less {MARGIN} px at each side, "
            f"got {size} px on {width}x{height} px; choose another size"
        )
    origin = ((width - size * columns) // 2, (height - size * rows) // 2)
    return Tiles(size, origin, (rows, columns))


def prepare_tiles(image: AnyArray, size: int = 16) -> TileReference:
    """Prepare a reference image for tile sums.

    Parameters
    ----------
    image : (H, W) uint8, uint16 or float, grey levels
        The mean of several frames where they can be had: noise in ∇f makes motion look too small.
    size : int, px
        Side of a tile, 4 or more.

    Raises
    ------
    ValueError
        If the image cannot be used, or is too small for one tile.
    """
    grey = check_reference(image).astype(np.float32)
    tiles = lay_tiles(grey.shape, size)
    f = grey.astype(np.float64)
    coefficients = _spline_coefficients(f)
    fx, fy = gradient = _spline_gradient(coefficients)
    reference = TileReference(
        tiles=tiles,
        image=grey,
        coefficients=coefficients.astype(np.float32),
        gradient=gradient.astype(np.float32),
        hessian=np.column_stack([tiles.sums(a) for a in (fx * fx, fx * fy, fy * fy)]),
        light=np.column_stack([tiles.sums(a) for a in (fx * f, fy * f, fx, fy, f * f, f)]),
        bias=np.zeros(2),
    )
    spectrum = measure_spectrum(grey, np.ones(grey.shape, dtype=np.bool_))
    aliasing = error_budget(spectrum, 0.0).random / size if spectrum else 0.0
    return replace(reference, bias=_interpolation_bias(reference, spectrum), aliasing=aliasing)


def tile_sums(reference: TileReference, image: AnyArray, flow: F64 | None = None) -> TileSums:
    """Sum ∇f·e, e, e² and e·f over the tiles of one frame.

    Parameters
    ----------
    image : (H, W) uint8, uint16 or float, grey levels
    flow : (T, 2) float64, px, optional
        Expected motion of each tile; the reference is moved there first (by its spline). Without it
        the image is compared in place, which is right to (d/2)² for motions below a pixel.

    Raises
    ------
    ValueError
        If the image cannot be used, or image or flow do not match the reference.
    """
    check_type(reference, TileReference, "reference", "dic.prepare_tiles")
    image = check_image(image, "deformed")
    check_pair(reference.image.shape, image.shape)
    tiles = reference.tiles
    count = len(reference.hessian)
    layout = tiles.origin, tiles.size, tiles.shape
    sums = np.empty((count, 5))
    hessian, light = reference.hessian, reference.light
    if flow is None:
        sums_in_place(image, reference.image, reference.gradient, *layout, sums)
        flow = np.zeros((count, 2))
    else:
        flow = read_array(flow, "flow", "px")
        if flow.shape != (count, 2) or not np.abs(flow).max(initial=0) < max(image.shape):
            raise ValueError(
                f"flow must be ({count}, 2) px, one motion a tile within the image; "
                f"got shape {flow.shape} and motions up to {np.abs(flow).max(initial=0):g} px"
            )
        hessian, light = np.empty((count, 3)), np.empty((count, 6))
        sums_moved(image, reference.coefficients, flow, *layout, sums, hessian, light)
    return TileSums(sums[:, :2], sums[:, 2], sums[:, 3], sums[:, 4], hessian, light, flow)


def unbiased_gradient(reference: TileReference, sums: TileSums) -> F64:
    """Σ∇f·e of each tile without what interpolation adds to it, (T, 2).

    The error is a wave of one pixel in the motion along each axis (Schreier, Braasch, Sutton 2000,
    Opt. Eng. 39, 2915), whose height is known of the reference: `TileReference.bias`.

    Raises
    ------
    ValueError
        If the sums are not those of the reference.
    """
    check_type(reference, TileReference, "reference", "dic.prepare_tiles")
    check_type(sums, TileSums, "sums", "dic.tile_sums")
    if len(sums.e) != len(reference.hessian):
        raise ValueError(
            f"sums are of {len(sums.e)} tiles and the reference has {len(reference.hessian)}; "
            "take sums of this reference"
        )
    if not reference.bias.any():
        return sums.gradient
    along_x, along_y = (reference.bias * np.sin(2.0 * np.pi * sums.flow)).T
    xx, xy, yy = reference.hessian.T
    return sums.gradient + np.column_stack(
        [xx * along_x + xy * along_y, xy * along_x + yy * along_y]
    )


def _interpolation_bias(reference: TileReference, spectrum: Spectrum | None) -> F64:
    """Measure `TileReference.bias` on the image itself, shifted by its Fourier series.

    That series takes what aliasing has folded back for what it looks like, which is taken off. From
    half of the bias on less and less counts, since its sign is not known, and evenly so, that a
    patch of a pattern says the same as all of it. 0 where aliasing is all of it; where no tile is
    far enough from the border; and where there is no pattern.
    """
    tiles, shape = reference.tiles, np.array(reference.image.shape[::-1])
    room = np.minimum(tiles.xy, shape - 1 - tiles.xy).min(axis=1) - tiles.size / 2
    inside = room >= FADE + MARGIN
    hessian = reference.hessian[inside].sum(axis=0)[[0, 2]]
    if not np.all(hessian > 0.0):
        return np.zeros(2)
    flow = np.full((len(tiles.xy), 2), _SHIFT)
    sums = tile_sums(reference, shifted(reference.image, (_SHIFT, _SHIFT)), flow)
    bias = -sums.gradient[inside].sum(axis=0) / hessian
    aliased = aliasing_bias(spectrum) if spectrum else np.zeros(2)
    left = np.maximum(bias - aliased, 0.0)
    return left * np.minimum(1.0, 2.0 * left / np.maximum(bias, _SHIFT * 1e-9))


def _spline_coefficients(f: F64) -> F64:
    """Coefficients of the B-spline through f (H, W), mirrored at the borders.

    Under the cosine transform its values at the knots are a product, which is divided out.
    """
    value, _ = _at_a_knot()

    def response(count: int) -> F64:
        waves = np.pi * np.arange(count) / (count - 1)
        return sum((w * np.cos((k - BEFORE) * waves) for k, w in enumerate(value)), np.zeros(()))

    down, across = (response(count) for count in f.shape)
    spectrum = np.asarray(fft.dctn(f, type=1)) / np.outer(down, across)
    return np.asarray(fft.idctn(spectrum, type=1))


def _spline_gradient(coefficients: F64) -> F64:
    """∂/∂x and ∂/∂y of the B-spline at its knots, (2, H, W)."""
    value, slope = _at_a_knot()

    def along(array: F64, weights: F64, axis: int) -> F64:
        return np.asarray(ndimage.correlate1d(array, weights, axis=axis, mode="mirror"))

    return np.stack(
        [
            along(along(coefficients, slope, 1), value, 0),
            along(along(coefficients, value, 1), slope, 0),
        ]
    )


def _at_a_knot() -> tuple[F64, F64]:
    """Weigh the knots -3 … 3 for value and slope at a knot, (7,) each."""
    value, slope = np.empty(DEGREE + 1), np.empty(DEGREE + 1)
    spline_weights(0.0, value, slope)
    return value[:DEGREE], slope[:DEGREE]
