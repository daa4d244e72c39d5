"""Takes a blur of the whole frame out of what its tiles say: a lens out of focus moves nothing.

A blur by σ px adds σ²/2 ∇²f to an image. Within a tile that is no motion on average, but it does
resemble one, another in each tile. How it resembles motion is known of the reference; how much of
it there is, all tiles say together. Motion itself is seen by slopes, of which a blur takes more
than of contrast.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import sqrt

import cv2
import numpy as np

from dic import TileBlocks, TileReference, TileSums, tile_sums
from rig.live.illumination import sums_without_gain_offset
from rig.system.arrays import F64, AnyArray, Mask

WIDTHS = (0.5, 0.8, 1.1, 1.4, 1.8)  # px, of the blurs whose traces are taken
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
    """

    width: float
    sums: F64
    weights: F64
    slopes: float


@dataclass(frozen=True, eq=False)
class FoundBlur:
    """A blur of a frame: so much of the trace that it resembles."""

    trace: BlurTrace
    amount: float

    @property
    def width(self) -> float:
        """Its standard deviation, px; negative where the frame is sharper than the reference."""
        return self.trace.width * sqrt(abs(self.amount)) * (1 if self.amount > 0 else -1)

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
    _, sharp = _sums(blocks, image, weight)

    def trace(width: float) -> BlurTrace:
        rest, slopes = _sums(blocks, cv2.GaussianBlur(image, (0, 0), width), weight)
        return BlurTrace(width, rest, rest / usual, slopes / sharp)

    return tuple(map(trace, WIDTHS))


def _sums(blocks: TileBlocks, image: AnyArray, weight: F64) -> tuple[F64, float]:
    """Return what an image says without light, (T, 2), and how much more where it is moved."""
    count = len(blocks.reference.hessian)
    flows = (np.full((count, 2), far) for far in (0.0, SMALL))
    each = (tile_sums(blocks.reference, image, flow) for flow in flows)
    rest, moved = (sums_without_gain_offset(blocks, one, weight).gradient for one in each)
    return rest, float(np.sum(moved - rest))


def find_blur(
    traces: tuple[BlurTrace, ...], sums: TileSums, visible: Mask, noise: float
) -> FoundBlur | None:
    """Find the blur of a frame, by least squares; None where it may be noise alone.

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
    best, explained = None, SURE**2 * noise**2
    for trace in traces:
        weights = trace.weights * visible[:, None]
        known, found = float(np.vdot(weights, trace.sums)), float(np.vdot(weights, sums.gradient))
        if found**2 > explained * known:
            best, explained = FoundBlur(trace, found / known), found**2 / known
    return best
