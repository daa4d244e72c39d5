"""Which tiles of a frame do not show the pattern: a hand, a sleeve, a thing on the plate.

Each tile is judged by itself, before any touch is known: whatever a smooth motion and the light do
to a tile, a small shift, gain and offset of its own do too; what these cannot explain is not the
pattern. So a new touch hides nothing, and a hand does at once.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import binary_dilation

from dic import TileReference, TileSums
from models.arrays import F64, Mask
from models.compiled import njit

LIMIT = 8.0  # standard deviations of χ² above its mean
ROUGH = 0.05  # of the pattern, which moving it may leave unexplained where less is predicted
DIMMED = 0.5  # change of the gain against that of the image: more than the shadow of a hand
BLURRED = 0.35  # the most that a frame out of focus may leave unexplained in every tile
SPREAD = 3.0  # of what a blur leaves of a tile, over what it leaves of the clearest quarter
VISIBLE = 0.75  # quantile of the gain that is that of the image: flat things have a lower one
FLAT = 0.1  # of the usual texture, below which the gain of a tile is not known
UNKNOWNS = 4  # shift in x and y, gain, offset


@dataclass(frozen=True, eq=False)
class TileFit:
    """What a shift, gain and offset of its own explain of each tile of a frame.

    Attributes
    ----------
    reference : TileReference
    unexplained : (T,) float64
        What they leave of Σe².
    gain : (T,) float64
        Contrast over that of the reference.
    texture : (T,) float64
        Σf² less its mean, 1 at least.
    unsure : (T,) float64
        Standard deviation of the gain at a noise of 1.
    """

    reference: TileReference
    unexplained: F64
    gain: F64
    texture: F64
    unsure: F64

    @property
    def contrast(self) -> F64:
        """Gain (T,) of tiles that show enough to know it; 1 of flat ones."""
        flat = self.texture < FLAT * np.median(self.texture)
        return np.where(flat, 1.0, self.gain)

    @property
    def freedom(self) -> float:
        """Pixels of a tile less what is fitted to them."""
        return float(self.reference.tiles.size**2 - UNKNOWNS)

    def hidden(self, noise: float) -> Mask:
        """Find the tiles (T,) that show something else, see `hidden_tiles`."""
        freedom, texture = self.freedom, self.texture
        blur = _blur(self.unexplained - noise**2 * freedom, texture)
        rough = max(ROUGH, self.reference.roughness, blur)
        allowed = noise**2 * (freedom + LIMIT * np.sqrt(2 * freedom)) + rough**2 * texture
        # Where a tile shows little, a shift and a gain look alike, and neither is known.
        usual = np.quantile(self.gain, VISIBLE)
        dimmed = np.abs(self.gain - usual) > DIMMED + LIMIT * noise * self.unsure
        grid = ((self.unexplained > allowed) | dimmed).reshape(self.reference.tiles.shape)
        return np.asarray(binary_dilation(grid), dtype=np.bool_).ravel()

    def noise(self, visible: Mask) -> float:
        """Noise of a pixel of the frame less the reference, grey levels, without motion and light.

        That of the median of the visible tiles (T,), which a new touch hardly moves; 0 of none.
        """
        usual = float(np.median(self.unexplained[visible])) if visible.any() else 0.0
        return float(np.sqrt(max(usual, 0.0) / self.freedom))


def fit_tiles(reference: TileReference, sums: TileSums) -> TileFit:
    """Fit shift, gain and offset of each tile.

    Parameters
    ----------
    reference : TileReference
    sums : TileSums
        Of the frame, at a flow that comes within a few tenths of a pixel of the motion: an image
        that moved further looks strange everywhere.
    """
    pixels = float(reference.tiles.size**2)
    # The gradient is a part of a longer array or one of its own: one kernel is compiled for both.
    gradient = np.ascontiguousarray(sums.gradient)
    shown = sums.hessian, sums.light, gradient, sums.e, sums.ee, sums.ef
    return TileFit(reference, *_local(*shown, pixels))


def hidden_tiles(reference: TileReference, sums: TileSums, noise: float) -> Mask:
    """Tiles (T,) that show something else, with those beside them, which it may reach into.

    What lies across a corner stays: of a hand over a tenth of the image that hides 11.0 % of the
    tiles and not 11.7 %, and the rim of a hand is where touches are.

    Parameters
    ----------
    reference : TileReference
    sums : TileSums
        As for `fit_tiles`.
    noise : float, grey levels
        Standard deviation of a pixel of the frame less the reference.

    Returns
    -------
    (T,) bool
    """
    return fit_tiles(reference, sums).hidden(noise)


def _blur(excess: F64, texture: F64) -> float:
    """Return the part of the pattern that a blur of the whole frame may leave unexplained.

    What hides the pattern leaves all of it, and a quarter of the tiles is taken to be seen, as for
    the gain.
    """
    seen = float(np.quantile(excess / texture, 1 - VISIBLE))
    return min(SPREAD * float(np.sqrt(max(seen, 0.0))), BLURRED)


@njit(cache=True, nogil=True, error_model="numpy")
def _local(
    hessian: F64, light: F64, gradient: F64, e: F64, ee: F64, ef: F64, pixels: float
) -> tuple[F64, F64, F64, F64]:
    """Fit shift and gain of each tile, the offset eliminated; what `TileFit` has."""
    count = len(e)
    normal, right = np.empty((count, 3, 3)), np.empty((count, 3))
    mean, floor = np.empty(3), np.zeros(3)
    for t in range(count):
        fx_f, fy_f, fx, fy, ff, f = light[t]
        mean[0], mean[1], mean[2] = -fx / pixels, -fy / pixels, f / pixels
        own = normal[t]
        own[0, 0], own[0, 1], own[1, 1] = hessian[t]
        own[0, 2], own[1, 2], own[2, 2] = -fx_f, -fy_f, ff
        right[t, 0], right[t, 1], right[t, 2] = -gradient[t, 0], -gradient[t, 1], ef[t]
        for i in range(3):
            right[t, i] -= mean[i] * e[t]
            for j in range(i, 3):
                own[i, j] -= pixels * mean[i] * mean[j]
            floor[i] = max(floor[i], 1e-4 * own[i, i])
    unexplained, gain = np.empty(count), np.empty(count)
    texture, unsure = np.empty(count), np.empty(count)
    for t in range(count):
        # A tile without texture leaves its shift and gain open; it must not stop the others.
        a, b, c = normal[t, 0, 0] + floor[0], normal[t, 0, 1], normal[t, 0, 2]
        d, g, h = normal[t, 1, 1] + floor[1], normal[t, 1, 2], normal[t, 2, 2] + floor[2]
        x, y, z = right[t]
        # Cofactors of the symmetric matrix, by Cramer's rule.
        aa, ab, ac = d * h - g * g, c * g - b * h, b * g - c * d
        bb, bc, cc = a * h - c * c, b * c - a * g, a * d - b * b
        determinant = a * aa + b * ab + c * ac
        found = (aa * x + ab * y + ac * z, ab * x + bb * y + bc * z, ac * x + bc * y + cc * z)
        explained = (found[0] * x + found[1] * y + found[2] * z) / determinant
        unexplained[t] = ee[t] - e[t] ** 2 / pixels - explained
        gain[t], texture[t] = 1.0 + found[2] / determinant, max(h, 1.0)
        unsure[t] = np.sqrt(max(cc / determinant, 0.0))
    return unexplained, gain, texture, unsure
