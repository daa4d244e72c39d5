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

from dic.arrays import F32, F64, AnyArray, Mask
from dic.images.image import check_image, check_pair
from dic.images.prefilter import Prefilter
from dic.numbers import (
    check_array,
    check_type,
    read_array,
    read_integer,
    read_shape,
    shown,
)
from dic.tiles.smooth_gradient import SmoothGradient
from dic.tiles.tile_kernels import sums_in_place, sums_moved

MARGIN = 8  # px kept free at the border, so that a moved tile still lies on the image
_MINOR = 0.3  # of the noise: what aliasing leaves would widen σ by less than 5 % and is left out


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
        Σfx², Σfxfy, Σfy² of each tile; behind a prefilter those of its scaled gradient.
    light : (T, 6) float64
        Σfx f, Σfy f, Σfx, Σfy, Σf², Σf: how a gain and an offset of the light mix with motion;
        behind a prefilter likewise.
    bias : (2,) float64, px
        By how much interpolation makes a motion of a quarter pixel along x and y look too large.
    aliasing : float, px
        Error of the motion of one tile that interpolation and aliasing leave, as the spectrum of
        the pattern predicts it (`dic.images.spectrum.error_budget`); 0 where it has none.
    roughness : float
        What these leave at most of a moved image, over the pattern, rms; predicted likewise.
    gain_error : float
        Standard deviation of the fraction by which interpolation and aliasing make small motions
        look too large: the difference of both, and what the spectrum says of aliasing too much or
        too little.
    smooth : SmoothGradient or None
        In the place of the gradient behind a prefilter.
    """

    tiles: Tiles
    image: F32
    coefficients: F32
    gradient: F32
    hessian: F64
    light: F64
    bias: F64
    aliasing: float = 0.0
    roughness: float = 0.0
    gain_error: float = 0.0
    smooth: SmoothGradient | None = None

    @property
    def prefilter(self) -> Prefilter:
        """The Gaussian by which the gradient is smoothed, or none."""
        return Prefilter() if self.smooth is None else self.smooth.prefilter

    def steepness(self, counted: Mask | None = None) -> float:
        """Root of Σfx² or Σfy² of a usual tile, of those (T,) that count, grey levels a px."""
        hessian = self.hessian if counted is None else self.hessian[counted]
        return float(np.sqrt(np.median(hessian[:, [0, 2]])))

    def motion_noise(self, noise: float, counted: Mask | None = None) -> float:
        """Noise of pixels by which a tile would err as it does, of those (T,) that count.

        That is `noise`, of a frame less the reference, with what aliasing leaves: little of it is
        there while nothing moves, see `aliasing_left`, and a σ that leaves it out holds only then.
        """
        aliased = self.aliasing * self.steepness(counted)
        return noise if aliased < _MINOR * noise else float(np.hypot(noise, aliased))


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


def tile_sums(
    reference: TileReference,
    image: AnyArray,
    flow: F64 | None = None,
    flow_gradient: F64 | None = None,
) -> TileSums:
    """Sum ∇f·e, e, e² and e·f over the tiles of one frame.

    Parameters
    ----------
    image : (H, W) uint8, uint16 or float, grey levels
    flow : (T, 2) float64, px, optional
        Expected motion of each tile; the reference is moved there first (by its spline). Without it
        the image is compared in place, which is right to (d/2)² for motions below a pixel.
    flow_gradient : (T, 2, 2) float64, px a px, optional
        Its derivatives ∂u/∂x, ∂u/∂y; ∂v/∂x, ∂v/∂y, by which the moved reference is deformed to
        first order. Without them every tile moves as a whole, and one whose pattern is steep on one
        side shows what that side does.

    Raises
    ------
    ValueError
        If the image cannot be used, or image, flow or its gradient do not match the reference, or
        there is a gradient without a flow.
    """
    check_type(reference, TileReference, "reference", "dic.prepare_tiles")
    image = check_image(image, "deformed")
    check_pair(reference.image.shape, image.shape)
    tiles = reference.tiles
    count = len(reference.hessian)
    layout = tiles.origin, tiles.size, tiles.shape
    sums = np.empty((count, 5))
    hessian, light, smooth = reference.hessian, reference.light, reference.smooth
    if flow is None:
        if flow_gradient is not None:
            raise ValueError(
                "flow_gradient needs the flow whose gradient it is, got none; give both"
            )
        slopes = reference.gradient if smooth is None else smooth.gradient
        sums_in_place(image, reference.image, slopes, layout, sums)
        flow = np.zeros((count, 2))
    else:
        flow = read_array(flow, "flow", "px")
        if flow.shape != (count, 2) or not np.abs(flow).max(initial=0) < max(image.shape):
            raise ValueError(
                f"flow must be ({count}, 2) px, one motion a tile within the image; "
                f"got shape {flow.shape} and motions up to {np.abs(flow).max(initial=0):g} px"
            )
        gradients = _read_gradient(flow_gradient, count)
        hessian, light = np.empty((count, 3)), np.empty((count, 6))
        steep = None if smooth is None else smooth.coefficients
        sums_moved(
            image, reference.coefficients, steep, (flow, gradients), layout, sums, hessian, light
        )
        if smooth is not None:
            hessian, light = smooth.hessian(hessian), smooth.light(light)
    gradient = sums[:, :2] if smooth is None else smooth.vectors(sums[:, :2])
    return TileSums(gradient, sums[:, 2], sums[:, 3], sums[:, 4], hessian, light, flow)


def _read_gradient(given: F64 | None, count: int) -> F64:
    """Check the gradient of a flow, (T, 2, 2); zeros where there is none."""
    if given is None:
        return np.zeros((count, 2, 2))
    gradient = read_array(given, "flow_gradient", "px a px")
    if gradient.shape != (count, 2, 2) or not np.isfinite(gradient).all():
        raise ValueError(
            f"flow_gradient must be ({count}, 2, 2) finite px a px, four derivatives a tile; "
            f"got shape {gradient.shape} and derivatives up to"
            f" {np.abs(gradient).max(initial=0):g}"
        )
    return gradient


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
