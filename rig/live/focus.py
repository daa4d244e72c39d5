"""Takes a blur of the whole frame out of what its tiles say: a lens out of focus moves nothing.

A blur by σ px adds σ²/2 ∇²f to an image. Within a tile that is no motion on average, but it does
resemble one, another in each tile. How it resembles motion is known of the reference; how much of
it there is, all tiles say together.
"""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np

from dic import TileBlocks, TileReference, TileSums, tile_sums
from rig.live.illumination import sums_without_gain_offset
from rig.system.arrays import F64, Mask

BLUR = 0.8  # px, standard deviation of the blur whose trace is taken
SURE = 5.0  # standard deviations of its amount, below which a frame is as sharp as the reference


def blur_trace(blocks: TileBlocks, weight: F64) -> F64:
    """Return the sums (T, 2) by which a blur of the reference resembles motion of its tiles.

    Parameters
    ----------
    blocks : TileBlocks
        Of one tile each.
    weight : (T,) float64
        Of `tile_weights`.
    """
    blurred = cv2.GaussianBlur(blocks.reference.image, (0, 0), BLUR)
    sums = tile_sums(blocks.reference, blurred)
    return sums_without_gain_offset(blocks, sums, weight).gradient


def sums_without_blur(
    trace: F64, reference: TileReference, sums: TileSums, visible: Mask, noise: float
) -> TileSums:
    """Take a blur of the whole frame out of its sums, by least squares; nothing where noise is all.

    Parameters
    ----------
    trace : (T, 2) float64
        Of `blur_trace`: that of the reference at rest, so that of a camera that jumped by pixels
        little is taken off.
    reference : TileReference
        Without light, see `without_gain_offset`.
    sums : TileSums
        Likewise.
    visible : (T,) bool
        Tiles that say how much of it there is.
    noise : float, grey levels
        Of a frame less the reference.
    """
    like = trace[visible] / np.maximum(reference.hessian[visible][:, [0, 2]], 1.0)
    known = float(np.sum(like * trace[visible]))
    found = float(np.sum(like * sums.gradient[visible]))
    if abs(found) < SURE * noise * np.sqrt(known) or not known:
        return sums
    return replace(sums, gradient=sums.gradient - found / known * trace)
