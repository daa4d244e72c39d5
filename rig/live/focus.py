"""Takes a blur of the whole frame out of what its tiles say: a lens out of focus moves nothing.

A blur by σ px adds σ²/2 ∇²f to an image. Within a tile that is no motion on average, but it does
resemble one, another in each tile: at σ = 1 px by more than twice what noise does. How it resembles
motion is known of the reference; how much of it there is, all tiles say together.
"""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np

from dic import TileBlocks, TileSums, tile_sums
from rig.live.illumination import sums_without_gain_offset
from rig.system.arrays import F64, Mask

BLUR = 0.8  # px, standard deviation of the blur whose trace is taken


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


def sums_without_blur(trace: F64, sums: TileSums, visible: Mask) -> TileSums:
    """Take a blur of the whole frame out of its sums, without light, by least squares.

    Parameters
    ----------
    trace : (T, 2) float64
        Of `blur_trace`: that of the reference at rest, so that of a camera that jumped by pixels
        little is taken off.
    sums : TileSums
    visible : (T,) bool
        Tiles that say how much of it there is.
    """
    slopes = np.maximum(sums.hessian[visible][:, [0, 2]], 1.0)
    like = trace[visible] / slopes
    blur = np.sum(like * sums.gradient[visible]) / max(np.sum(like * trace[visible]), 1e-12)
    return replace(sums, gradient=sums.gradient - blur * trace)
