"""Motion of tiles: what a frame says of each, and what blocks of them make of it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from dic.adaptive.blocks import SCALES, BlockField, denoise
from dic.adaptive.cracks import part, still_torn
from dic.adaptive.motion import TERMS, carried, start_motion
from dic.adaptive.observation import TileTexture, box, observe, tile_texture
from dic.adaptive.tile_lattice import TILE, TileLattice, lay_lattice
from dic.adaptive.truncation import truncation
from dic.adaptive.unexplained import unexplained_variance
from dic.arrays import F64, AnyArray, Mask
from dic.correlation.deformed_image import read_whole
from dic.correlation.reference import Reference
from dic.fields.displacement import DisplacementField
from dic.numbers import check_array, read_array

_PASSES = 10
_MOVED, _FEW = 1.0, 0.002  # σ of a tile by which more than so many tiles move: another pass
_AROUND = 3  # tiles
_STILL = 2.0  # σ, within which noise moves a tile from pass to pass


@dataclass(frozen=True, eq=False)
class AdaptiveTiles:
    """Motion of R x C tiles of 5 px side by side, in px; values are NaN where no block holds one.

    Attributes
    ----------
    lattice : TileLattice
    seen : (2, R, C) float64, px
        u and v as each tile alone says it.
    noise : (2, R, C) float64, px
        σ of that, white from tile to tile.
    valid : (R, C) bool
        Where `seen` can be believed: not masked, hidden, torn or bare.
    bare : (R, C) bool
        Tiles without pattern, as in a hole.
    values : (2, 3, R, C) float64
        u, ∂u/∂x, ∂u/∂y and v, ∂v/∂x, ∂v/∂y, px and px per tile, of the adaptive field.
    sigma : (2, 3, R, C) float64
        Without `slope_factor`; see `stated_sigma`.
    slope_factor : (R, C) float64
        How many times as unsure slopes are, for blocks lie farther apart than that.
    zncc : (R, C) float64
        Correlation of the tiles around each.
    """

    lattice: TileLattice
    seen: F64
    noise: F64
    valid: Mask
    bare: Mask
    values: F64
    sigma: F64
    slope_factor: F64
    zncc: F64

    @property
    def stated_sigma(self) -> F64:
        """σ of `values`, (2, 3, R, C)."""
        sigma = self.sigma.copy()
        sigma[:, 1:] *= self.slope_factor
        return sigma


def too_small(ref: Reference, start: DisplacementField) -> bool:
    """Whether no block fits the image, or nothing of it was found."""
    return min(lay_lattice(ref).shape) < SCALES[0][0] or not start.valid.any()


def update(ref: Reference, start: DisplacementField, image: AnyArray) -> AdaptiveTiles:
    """Observe and denoise from a field that is nearly right, until the tiles stand still."""
    texture = tile_texture(ref, lay_lattice(ref))
    spline = read_whole(image, ref.prefilter).pixels
    motion = start_motion(start, texture.lattice)
    motion, torn = part(ref, texture, spline, motion, start)
    seen = observe(ref, texture, spline, motion, torn)
    field = denoise(seen.moved, seen.sigma, seen.valid, None)
    earlier = field.sigma[:, 0]
    for _ in range(_PASSES):
        before, earlier = motion, field.sigma[:, 0]
        motion = carried(field, before, texture.known & ~torn)
        torn = still_torn(torn, field.values)
        moved = np.abs(motion[:, 0] - before[:, 0]) > _MOVED * seen.sigma
        seen = observe(ref, texture, spline, motion, torn)
        field = denoise(seen.moved, seen.sigma, seen.valid, motion[:, 0])
        if moved.mean() < _FEW:
            break
    field = _still_moving(field, motion, earlier)
    left = unexplained_variance(seen.variance, seen.valid, ref.prefilter.sigma)
    field = _truncated(_unexplained(field, left, texture), seen.sigma)
    return AdaptiveTiles(
        lattice=texture.lattice,
        seen=seen.moved,
        noise=seen.sigma,
        valid=seen.valid,
        bare=seen.bare,
        values=field.values,
        sigma=field.sigma,
        slope_factor=field.slope_factor,
        zncc=seen.zncc,
    )


def _still_moving(field: BlockField, motion: F64, earlier: F64) -> BlockField:
    """Add to σ what the last pass has moved more than noise does: as much may be left.

    Noise moves a tile by σ of the pass before, (2, R, C), where that is larger.
    """
    moved = np.nan_to_num(field.values[:, 0] - motion[:, 0])
    by_noise = _STILL * np.nan_to_num(np.fmax(field.sigma[:, 0], earlier))
    left = np.maximum(np.square(moved) - np.square(by_noise), 0)
    sigma = field.sigma.copy()
    for a in range(2):
        sigma[a, 0] = np.hypot(sigma[a, 0], np.sqrt(np.maximum(box(left[a], _AROUND), 0.0)))
    return replace(field, sigma=sigma)


def _unexplained(field: BlockField, left: F64, texture: TileTexture) -> BlockField:
    """Add to σ the motion that leaves of the images what noise does not, (R, C) grey levels².

    Such a motion changes within a tile, and so leaves its square times that of the gradient. Slopes
    are unsure by those of waves of two tiles.
    """
    if not left.any():
        return field
    sigma = field.sigma.copy()
    for a in range(2):
        lost = TILE * np.sqrt(left * texture.even[..., a, a])
        sigma[a] = np.hypot(sigma[a], np.stack([lost, np.pi * lost, np.pi * lost]))
    return replace(field, sigma=sigma)


def _truncated(field: BlockField, noise: F64) -> BlockField:
    """Add to σ what tiles of this noise, (2, R, C) px, move beyond second order."""
    lost = truncation(field.values, field.sigma / noise[:, None])
    return replace(field, sigma=np.hypot(field.sigma, lost))


def denoised_tiles(seen: F64, noise: F64, valid: Mask) -> AdaptiveTiles:
    """Make of drawn tiles what `adaptive_field` makes of those of images.

    Parameters
    ----------
    seen : (2, R, C) float64, px
        Motion of each tile with its noise.
    noise : (2, R, C) float64, px
        Its σ.
    valid : (R, C) bool

    Raises
    ------
    ValueError
        The arrays are not of one shape, or smaller than a block.
    """
    seen, noise = read_array(seen, "seen", "px"), read_array(noise, "noise", "px")
    valid = check_array(valid, "valid", "b", 2)
    shape, side = valid.shape, SCALES[0][0]
    if seen.shape != (2, *shape) or noise.shape != seen.shape or min(shape) < side:
        raise ValueError(
            f"seen and noise must be (2, R, C) px over valid (R, C) of {side} tiles or more, got "
            f"{seen.shape}, {noise.shape} and {shape}; draw larger fields"
        )
    if np.any(noise <= 0):
        raise ValueError(
            f"noise must be above 0 px, got {np.nanmin(noise):g} px; take the σ of each tile"
        )
    valid = valid & np.isfinite(seen).all(axis=0) & np.isfinite(noise).all(axis=0)
    seen, noise = (np.where(valid, array, 0.0) for array in (seen, noise))
    first = denoise(seen, noise, valid, None)
    rest = np.zeros((2, TERMS, *shape))
    field = denoise(seen, noise, valid, carried(first, rest, valid)[:, 0])
    return AdaptiveTiles(
        lattice=TileLattice((TILE // 2, TILE // 2), (shape[0], shape[1])),
        seen=seen,
        noise=noise,
        valid=valid,
        bare=np.zeros(shape, bool),
        values=field.values,
        sigma=field.sigma,
        slope_factor=field.slope_factor,
        zncc=np.ones(shape),
    )
