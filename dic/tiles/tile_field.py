"""Displacement from tile sums: one step from the flow of the tiles, a block of tiles a point."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from dic.arrays import F64, I8, AnyArray
from dic.fields.displacement import DisplacementField, Status
from dic.fields.grid import Grid
from dic.numbers import check_type, read_integer, read_real
from dic.tiles.tiles import TileReference, Tiles, TileSums, unbiased_gradient

MIN_ZNCC = 0.6  # below, the pattern was not found again
MIN_TEXTURE = 0.02  # of the median Hessian: below, a block is too flat to follow
ROUNDING = 1e-9  # of Σf²: below, a Hessian is what rounding leaves of an image without pattern


@dataclass(frozen=True, eq=False)
class TileBlocks:
    """A reference whose tiles are read in overlapping blocks.

    Attributes
    ----------
    reference : TileReference
    block : int
        Tiles along the side of a block, odd; blocks at the border hold the tiles that exist.
    hessian : (T, 2, 2) float64
        Σ∇f∇fᵀ of each tile with the light eliminated, whose gain and offset are free in every
        tile; noise of the right-hand side has this covariance, in units of the pixel noise squared.
    inverse : (T, 2, 2) float64
        Inverse Hessian of each block.
    status : (T,) int8
        FLAT where a block cannot be followed.
    """

    reference: TileReference
    block: int
    hessian: F64
    inverse: F64
    status: I8

    @property
    def grid(self) -> Grid:
        """The tile centres as a grid of points, a block as the subset of each."""
        tiles = self.reference.tiles
        return Grid(tiles.xs, tiles.ys, self.block * tiles.size, tiles.size)


def prepare_blocks(reference: TileReference, block: int = 3) -> TileBlocks:
    """Prepare to read displacements from blocks of tiles.

    Raises
    ------
    ValueError
        If `block` is even or less than 1.
    """
    check_type(reference, TileReference, "reference", "dic.prepare_tiles")
    largest = 2 * max(reference.tiles.shape) - 1
    block = read_integer(block, "block", "tiles")
    if block > largest:
        raise ValueError(
            f"block of {block} tiles reaches over the whole image from any tile; "
            f"use at most {largest}"
        )
    if block < 1 or block % 2 == 0:
        raise ValueError(
            f"block must be an odd number of tiles, got {block}; use {max(block | 1, 1)}"
        )
    fx_f, fy_f, fx, fy, ff, _ = light = reference.light.T
    pixels = reference.tiles.size**2
    xx, xy, yy = reference.hessian.T
    explained_x = _of_light(light, pixels, fx_f, fx)
    explained_y = _of_light(light, pixels, fy_f, fy)
    hessian = _two_by_two(xx - explained_x[0], xy - explained_x[1], yy - explained_y[1])
    summed = _block_sum(hessian.reshape(-1, 4), reference.tiles.shape, block).reshape(-1, 2, 2)
    low = np.linalg.eigvalsh(summed)[:, 0]
    flat = low <= max(MIN_TEXTURE * np.median(low), ROUNDING * ff.max())
    summed[flat] = np.eye(2)
    status = np.where(flat, Status.FLAT, Status.OK).astype(np.int8)
    return TileBlocks(reference, block, hessian, _inverse(summed), status)


def tile_gradient(blocks: TileBlocks, sums: TileSums) -> F64:
    """Right-hand side of each tile for the motion left over, light eliminated, (T, 2).

    Raises
    ------
    ValueError
        The sums are not those of the blocks.
    """
    check_type(blocks, TileBlocks, "blocks", "dic.prepare_blocks")
    gradient = unbiased_gradient(blocks.reference, sums)
    pixels = blocks.reference.tiles.size**2
    return _of_light(sums.light.T, pixels, sums.ef, sums.e).T - gradient


def tile_displacement(blocks: TileBlocks, sums: TileSums, noise: float) -> DisplacementField:
    """Displacement of every block: the mean of its flow and of what is left over, weighted by H.

    Parameters
    ----------
    sums : TileSums
        Taken at a flow that is right to a few tenths of a pixel.
    noise : float, grey levels
        Standard deviation of e, the frame's noise and that of the reference.

    Returns
    -------
    DisplacementField
        Of order 0, on the grid of tile centres, of the material points that were there.

    Raises
    ------
    ValueError
        The sums are not those of the blocks, or the noise is no number.
    """
    gradient, noise = tile_gradient(blocks, sums), read_real(noise, "noise", "grey levels")
    reference = blocks.reference
    known = (blocks.hessian @ sums.flow[..., None])[..., 0]
    right = _block_sum(known + gradient, reference.tiles.shape, blocks.block)
    moved = (blocks.inverse @ right[..., None])[..., 0]
    zncc = _zncc(blocks, sums)
    lost = (blocks.status == Status.OK) & (zncc < MIN_ZNCC)
    status = np.where(lost, Status.LOW_CORRELATION, blocks.status).astype(np.int8)
    bad = status != Status.OK
    sigma = noise * np.sqrt(blocks.inverse[:, [0, 1], [0, 1]])
    moved[bad], sigma[bad] = np.nan, np.nan
    moved = _of_material(moved, reference.tiles)
    count = len(moved)
    return DisplacementField(
        xy=reference.tiles.xy,
        u=moved[:, 0],
        v=moved[:, 1],
        sigma_u=sigma[:, 0],
        sigma_v=sigma[:, 1],
        gradient=np.zeros((count, 2, 2)),
        sigma_gradient=np.zeros((count, 2, 2)),
        zncc=zncc,
        iterations=np.ones(count, np.int16),
        valid_fraction=np.ones(count),
        status=status,
        subset=blocks.grid.subset,
        order=0,
        grid=blocks.grid,
    )


def _of_material(moved: AnyArray, tiles: Tiles) -> F64:
    """Motion u(X) of the material at the tiles, from that of what the frame shows there, d(x).

    d(x) = u(x - d), so u ≈ d + ∇d·d; where ∇d is not known the two are taken as one.
    """
    grid = moved.reshape(*tiles.shape, 2)
    if min(tiles.shape) < 2:
        return moved
    along_x, along_y = (np.asarray(np.gradient(grid, tiles.size, axis=a)) for a in (1, 0))
    turn = along_x * grid[..., :1] + along_y * grid[..., 1:]
    return (grid + np.nan_to_num(turn)).reshape(-1, 2)


def _of_light(light: AnyArray, pixels: int, ef: AnyArray, e: AnyArray) -> F64:
    """Σ∇f·e of the part of e that is α f + β, by least squares in every tile, (2, T)."""
    fx_f, fy_f, fx, fy, ff, f = light
    # A tile without pattern knows no gain: a part in 1e9 of a grey level holds it at zero.
    determinant = (ff + 1e-9 * pixels) * pixels - f * f
    gain = (pixels * ef - f * e) / determinant
    offset = (e - gain * f) / pixels
    return np.stack([gain * fx_f + offset * fx, gain * fy_f + offset * fy])


def _zncc(blocks: TileBlocks, sums: TileSums) -> F64:
    """Zero-normalised correlation of each block with the frame, -1…1; 0 where it is flat."""
    reference = blocks.reference
    ff, f = sums.light[:, 4], sums.light[:, 5]
    pixels = np.full_like(f, float(reference.tiles.size**2))
    stacked = np.stack([ff, f, ff + sums.ef, f + sums.e, ff + 2 * sums.ef + sums.ee, pixels], -1)
    ff, f, fg, g, gg, n = _block_sum(stacked, reference.tiles.shape, blocks.block).T
    spread = np.clip((ff - f * f / n) * (gg - g * g / n), 0.0, None)
    return np.where(spread > 0, (fg - f * g / n) / np.sqrt(np.maximum(spread, 1e-300)), 0.0)


def _block_sum(values: AnyArray, shape: tuple[int, int], block: int) -> F64:
    """Sum (T, k) values over block x block tiles around each tile."""
    planes = np.moveaxis(values.reshape(*shape, -1), -1, 0)
    summed = [
        cv2.boxFilter(
            np.ascontiguousarray(plane), -1, (block, block), normalize=False,
            borderType=cv2.BORDER_CONSTANT,
        )
        for plane in planes
    ]  # fmt: skip
    return np.stack(summed, axis=-1, dtype=np.float64).reshape(len(values), -1)


def _inverse(matrices: AnyArray) -> F64:
    return np.asarray(np.linalg.inv(matrices), dtype=np.float64)


def _two_by_two(xx: AnyArray, xy: AnyArray, yy: AnyArray) -> F64:
    return np.stack([np.stack([xx, xy], -1), np.stack([xy, yy], -1)], axis=1)
