"""Takes a blur of the whole frame out of what its tiles say: a lens out of focus moves nothing.

A blur by σ px adds σ²/2 ∇²f to an image. Within a tile that is no motion on average, but it does
resemble one, another in each tile. How it resembles motion is known of the reference; how much of
it there is, all tiles say together. Motion itself is seen by slopes, of which a blur takes more
than of contrast.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import copysign, sqrt

import cv2
import numpy as np

from dic import TileBlocks, TileReference, TileSums, tile_sums
from models import TileFit, fit_tiles
from rig.live.illumination import sums_without_gain_offset
from rig.system.arrays import F64, AnyArray, Mask

WIDTHS = (0.4, 0.5, 0.65, 0.8, 0.95, 1.1, 1.3, 1.5, 1.8)  # px, of the blurs whose traces are taken
SMALL = 0.05  # px along both axes, by which the slopes that are left of a blur are weighed
SURE = 5.0  # standard deviations of its amount, below which a frame is as sharp as the reference


@dataclass(frozen=True, eq=False)
class BlurTrace:
    """What a blur of the reference makes of its tiles, without light.

    Attributes
    ----------
    width : float, px
        Standard deviation of the blur.
    sums : (T, 2) float64
        By which it resembles motion, of the reference at rest: that of a camera that jumped by
        pixels is another one.
    weights : (T, 2) float64
        By which the sums of a frame say how much of it there is.
    slopes : float
        What it leaves of slopes, over what it leaves of contrast.
    unexplained : float, grey levels
        What a shift, gain and offset of each tile do not explain of it, for a pixel.
    """

    width: float
    sums: F64
    weights: F64
    slopes: float
    unexplained: float


@dataclass(frozen=True, eq=False)
class FoundBlur:
    """A blur of a frame.

    Attributes
    ----------
    trace : BlurTrace
        That it resembles.
    amount : float
        So much of it, 0 where it may be noise alone.
    unexplained : float, grey levels
        What it adds to the noise of a pixel.
    """

    trace: BlurTrace
    amount: float
    unexplained: float = 0.0

    @property
    def width(self) -> float:
        """Its standard deviation, px; negative where the frame is sharper than the reference."""
        return copysign(self.trace.width * sqrt(abs(self.amount)), self.amount)

    @property
    def slopes_left(self) -> float:
        """What it leaves of slopes, over what it leaves of contrast."""
        return float(self.trace.slopes**self.amount)

    def taken_out(self, sums: TileSums) -> TileSums:
        """Return the sums of the frame as they would be of a sharp one."""
        gradient = sums.gradient - self.amount * self.trace.sums
        return replace(sums, gradient=gradient / self.slopes_left)


def blur_traces(blocks: TileBlocks, reference: TileReference, weight: F64) -> tuple[BlurTrace, ...]:
    """Blur the reference by each width and see what becomes of its tiles.

    Parameters
    ----------
    blocks : TileBlocks
        Of one tile each.
    reference : TileReference
        The same without light, see `without_gain_offset`.
    weight : (T,) float64
        Of `tile_weights`.
    """
    image, usual = blocks.reference.image, np.maximum(reference.hessian[:, [0, 2]], 1.0)
    sharp = _slopes(blocks, image, weight)

    def trace(width: float) -> BlurTrace:
        blurred = cv2.GaussianBlur(image, (0, 0), width)
        rest, fit = _without_light(blocks, blurred, weight, 0.0)
        slopes = _slopes(blocks, blurred, weight) / sharp
        return BlurTrace(width, rest, rest / usual, slopes, fit.noise(np.ones(len(rest), bool)))

    return tuple(map(trace, WIDTHS))


def _slopes(blocks: TileBlocks, image: AnyArray, weight: F64) -> float:
    """Say how much more an image tells without light where it is moved a little."""
    rest, moved = (_without_light(blocks, image, weight, far)[0] for far in (0.0, SMALL))
    return float(np.sum(moved - rest))


def _without_light(
    blocks: TileBlocks, image: AnyArray, weight: F64, shift: float
) -> tuple[F64, TileFit]:
    """Return what an image says of the reference moved by a shift, (T, 2), without light."""
    flow = np.full((len(blocks.reference.hessian), 2), shift)
    sums = tile_sums(blocks.reference, image, flow)
    fit = fit_tiles(blocks.reference, sums)
    return sums_without_gain_offset(blocks, sums, weight, fit.contrast).gradient, fit


def find_blur(
    traces: tuple[BlurTrace, ...], sums: TileSums, visible: Mask, noise: float
) -> FoundBlur:
    """Find the blur of a frame, by least squares.

    Parameters
    ----------
    traces : tuple of BlurTrace
    sums : TileSums
        Without light.
    visible : (T,) bool
        Tiles that say how much of it there is.
    noise : float, grey levels
        Of a frame less the reference.
    """
    best, explained = FoundBlur(traces[0], 0.0), SURE**2 * noise**2
    for trace in traces:
        weights = trace.weights * visible[:, None]
        known, found = float(np.vdot(weights, trace.sums)), float(np.vdot(weights, sums.gradient))
        if found**2 > explained * known:
            best, explained = FoundBlur(trace, found / known), found**2 / known
    return replace(best, unexplained=_unexplained(traces, best.width))


def _unexplained(traces: tuple[BlurTrace, ...], width: float) -> float:
    """Return what a blur adds to the noise of a pixel, grey levels, between those of the traces."""
    widths = [0.0, *(trace.width for trace in traces)]
    added = [0.0, *(trace.unexplained for trace in traces)]
    return sqrt(float(np.interp(width**2, np.square(widths), np.square(added))))
