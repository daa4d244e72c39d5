"""Takes a blur of the whole frame out of what its tiles say: a lens out of focus moves nothing.

A blur by σ px adds σ²/2 ∇²f to an image. Within a tile that is no motion on average, but it does
resemble one, another in each tile. How it resembles motion is known of the reference; how much of
it there is, all tiles say together.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np

from dic import TileBlocks, TileReference, TileSums, tile_sums
from rig.live.illumination import sums_without_gain_offset
from rig.system.arrays import F64, Mask

BLUR = 0.8  # px, standard deviation of the blur whose trace is taken
SURE = 5.0  # standard deviations of its amount, below which a frame is as sharp as the reference


@dataclass(frozen=True, eq=False)
class BlurTrace:
    """What a blur of the reference makes of its tiles, without light.

    Attributes
    ----------
    sums : (T, 2) float64
        By which it resembles motion, of the reference at rest: that of a camera that jumped by
        pixels is another one.
    weights : (T, 2) float64
        By which the sums of a frame say how much of it there is.
    """

    sums: F64
    weights: F64


def blur_trace(blocks: TileBlocks, reference: TileReference, weight: F64) -> BlurTrace:
    """Blur the reference and see what becomes of its tiles.

    Parameters
    ----------
    blocks : TileBlocks
        Of one tile each.
    reference : TileReference
        The same without light, see `without_gain_offset`.
    weight : (T,) float64
        Of `tile_weights`.
    """
    blurred = cv2.GaussianBlur(blocks.reference.image, (0, 0), BLUR)
    sums = sums_without_gain_offset(blocks, tile_sums(blocks.reference, blurred), weight).gradient
    return BlurTrace(sums, sums / np.maximum(reference.hessian[:, [0, 2]], 1.0))


def sums_without_blur(blur: BlurTrace, sums: TileSums, visible: Mask, noise: float) -> TileSums:
    """Take a blur of the whole frame out of its sums, by least squares; nothing where noise is all.

    Parameters
    ----------
    blur : BlurTrace
    sums : TileSums
        Without light.
    visible : (T,) bool
        Tiles that say how much of it there is.
    noise : float, grey levels
        Of a frame less the reference.
    """
    weights = blur.weights * visible[:, None]
    known, found = float(np.vdot(weights, blur.sums)), float(np.vdot(weights, sums.gradient))
    if abs(found) <= SURE * noise * np.sqrt(known):
        return sums
    return replace(sums, gradient=sums.gradient - found / known * blur.sums)
