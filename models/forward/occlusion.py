"""Which tiles of a frame do not show the pattern: a hand, a sleeve, a thing on the plate.

Each tile is judged by itself, before any touch is known: whatever a smooth motion and the light do
to a tile, a small shift, gain and offset of its own do too; what these cannot explain is not the
pattern. So a new touch hides nothing, and a hand does at once.
"""

from __future__ import annotations

import numpy as np
from scipy.ndimage import binary_dilation

from dic import TileReference, TileSums
from models.arrays import F64, Mask

LIMIT = 8.0  # standard deviations of χ² above its mean
ROUGH = 0.05  # of the pattern, which moving it by interpolation may leave unexplained
DIMMED = 0.5  # change of the gain against that of the image: more than the shadow of a hand
VISIBLE = 0.75  # quantile of the gain that is that of the image: flat things have a lower one
UNKNOWNS = 4  # shift in x and y, gain, offset


def hidden_tiles(reference: TileReference, sums: TileSums, noise: float) -> Mask:
    """Tiles (T,) that show something else, with those beside them, which it may reach into.

    What lies across a corner stays: of a hand over a tenth of the image that hides 11.0 % of the
    tiles and not 11.7 %, and the rim of a hand is where touches are.

    Parameters
    ----------
    reference : TileReference
    sums : TileSums
        Of the frame, at a flow that comes within a few tenths of a pixel of the motion: an image
        that moved further looks strange everywhere.
    noise : float, grey levels
        Standard deviation of a pixel of the frame less the reference.

    Returns
    -------
    (T,) bool
    """
    pixels = float(reference.tiles.size**2)
    normal, right, left = _local(reference.hessian, sums, pixels)
    inverse = _inverse(normal)
    found = np.einsum("tjk,tk->tj", inverse, right)
    unexplained = left - np.einsum("tk,tk->t", right, found)
    texture, gain = normal[:, 2, 2].clip(1.0), found[:, 2]
    freedom = pixels - UNKNOWNS
    allowed = noise**2 * (freedom + LIMIT * np.sqrt(2 * freedom)) + ROUGH**2 * texture
    # Where a tile shows little, a shift and a gain look alike, and neither is known.
    unsure = noise * np.sqrt(inverse[:, 2, 2].clip(0.0))
    dimmed = np.abs(gain - np.quantile(gain, VISIBLE)) > DIMMED + LIMIT * unsure
    grid = ((unexplained > allowed) | dimmed).reshape(reference.tiles.shape)
    return np.asarray(binary_dilation(grid), dtype=np.bool_).ravel()


def _local(hessian: F64, sums: TileSums, pixels: float) -> tuple[F64, F64, F64]:
    """Set up shift and gain of each tile, the offset eliminated, and its Σe².

    Returns
    -------
    normal, right, left : (T, 3, 3), (T, 3), (T,) float64
    """
    fx_f, fy_f, fx, fy, ff, f = sums.light.T
    xx, xy, yy = hessian.T
    normal = np.array([[xx, xy, -fx_f], [xy, yy, -fy_f], [-fx_f, -fy_f, ff]]).transpose(2, 0, 1)
    mean = np.column_stack([-fx, -fy, f]) / pixels
    normal -= pixels * mean[:, :, None] * mean[:, None, :]
    right = np.column_stack([-sums.gradient, sums.ef]) - mean * sums.e[:, None]
    # A tile without texture leaves its shift and gain open; it must not stop the others.
    floor = 1e-4 * np.einsum("tkk->tk", normal).max(axis=0)
    return normal + floor * np.eye(3), right, sums.ee - sums.e**2 / pixels


def _inverse(matrices: F64) -> F64:
    """Invert matrices (T, 3, 3) by Cramer's rule: ten times as fast as one after the other."""
    a, b, c = matrices[:, 0], matrices[:, 1], matrices[:, 2]
    cofactors = np.stack([np.cross(b, c), np.cross(c, a), np.cross(a, b)], axis=2)
    return cofactors / np.einsum("tk,tk->t", a, cofactors[:, :, 0])[:, None, None]
