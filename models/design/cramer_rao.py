"""The Cramér-Rao bound: how well any estimator can do with the pixels of one frame."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

import fe
import synthetic
from dic import prepare_tiles
from models.arrays import F64
from models.forward.tile_pattern import TilePattern, prepare_motions, prepare_pattern
from models.inverse.levenberg_marquardt import covariance

PIXELS = 4  # side of the tiles over which motion counts as constant, px


def pixel_level(
    modes: fe.Modes,
    camera: synthetic.AnyCamera,
    height: float,
    image: F64,
    moves: Callable[[synthetic.AnyCamera, F64], F64] = synthetic.rigid_motion_basis,
) -> TilePattern:
    """Information of every pixel, with motion resolved over 4 px.

    Parameters
    ----------
    image : (H, W) float64, grey levels
        The undeformed pattern without noise.
    moves : callable
        ImageMotions of the camera that are unknown: see `prepare_motions`.
    """
    reference = prepare_tiles(image, size=PIXELS)
    motions = prepare_motions(modes, camera, height, reference.tiles, moves=moves)
    return prepare_pattern(motions, reference)


def cramer_rao(pattern: TilePattern, touches: F64, noise: float) -> F64:
    """Smallest covariance of x, y, F of all touches that one frame allows.

    The camera's motions and the light (gain, offset) are unknown too. The reference is taken as
    known; a mean of N frames adds a fraction 1/N.

    Parameters
    ----------
    pattern : TilePattern
        From `pixel_level`.
    touches : (n, 3) float64
        x, y (mm) and F (N).
    noise : float, grey levels
        Standard deviation of a pixel.

    Returns
    -------
    (3n, 3n) float64, mm and N
    """
    touches = np.asarray(touches, dtype=np.float64)
    return covariance(pattern.forward(noise).read(touches)[1])
