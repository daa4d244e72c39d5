"""What a frame says of the motion of every tile: a white field with its noise."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from dic.adaptive import tile_kernels
from dic.adaptive.tile_lattice import TILE, TileLattice
from dic.arrays import F32, F64, AnyArray, Mask
from dic.correlation.reference import Reference
from dic.fields.displacement import Status
from dic.images.spline import noise_slope

_LIGHT = 7  # tiles along the side of the square over which gain and offset are one
_SMOOTH = 5  # tiles, over which the texture counts as even
_LOUD, _LOUDEST = 3.0, 9.0  # times the usual variance, of the tiles around and of all
_SOME = 2000  # tiles that say what is usual
_HERE = 3  # tiles along the side of the square that has a pattern or none
_ALONE = 3  # loud tiles that touch, at most, and part nothing
_WHOLE = 0.6  # fraction of the pixels of a tile that must lie in the ROI
_EXACT = 1e-4  # px, of a tile: images that are drawn have no noise, but are rounded
_OFF = 0.5  # px beyond the last pixel at which a tile is lost
_PATTERN = 1.5  # times the gradient that noise alone has: less is no pattern


@dataclass(frozen=True)
class TileTexture:
    """What the reference gives to every frame.

    Attributes
    ----------
    sums : (R, C, 10) float64
        As `tile_kernels.sum_reference`.
    even : (R, C, 2, 2) float64
        Inverse of the Hessian that the tiles around a tile have on average.
    known : (R, C) bool
        Tiles with a pattern in the ROI.
    gain : (2,) float64
        What a prefilter makes of the variance of u and of v, because it correlates the noise.
    """

    lattice: TileLattice
    sums: F64
    even: F64
    known: Mask
    gain: F64


@dataclass(frozen=True)
class Observation:
    """Motion of every tile as it was seen, and its noise, white from tile to tile.

    Attributes
    ----------
    moved : (2, R, C) float64, px
        u and v of each tile.
    sigma : (2, R, C) float64, px
        One standard deviation, smooth over tiles.
    valid : (R, C) bool
    bare : (R, C) bool
        Tiles without pattern.
    zncc : (R, C) float64
        Correlation of the tiles around each.
    variance : (R, C) float64, grey levels²
        A pixel, that the own motion of each tile leaves.
    """

    moved: F64
    sigma: F64
    valid: Mask
    bare: Mask
    zncc: F64
    variance: F64


def tile_texture(ref: Reference, lattice: TileLattice) -> TileTexture:
    """Sum the texture of a reference over the tiles."""
    sums = np.empty((*lattice.shape, tile_kernels.OF_REFERENCE))
    tile_kernels.sum_reference(ref.texture, *lattice.origin, sums)
    known = sums[..., 9] >= _WHOLE * TILE**2
    counted = box(known.astype(np.float64), _SMOOTH)
    xx, xy, yy = (box(sums[..., k] * known, _SMOOTH) / np.maximum(counted, 1e-9) for k in range(3))
    determinant = xx * yy - xy * xy
    flat = determinant <= 1e-6 * np.square(xx + yy)
    safe = np.where(flat, 1.0, determinant)
    even = np.stack([np.stack([yy, -xy], -1), np.stack([-xy, xx], -1)], -2) / safe[..., None, None]
    even[flat] = 0.0
    usable = ref.noise_gain[ref.status == Status.OK]
    gain = np.median(usable, axis=0) if len(usable) else np.ones(2)
    return TileTexture(lattice, sums, even, known & ~flat, gain)


def observe(
    ref: Reference, texture: TileTexture, spline: F32, motion: F64, torn: Mask
) -> Observation:
    """Compare a frame with the reference, tile by tile, about a motion that is nearly right.

    Parameters
    ----------
    spline : (H + 2 PAD, W + 2 PAD) float32
        Coefficients of the frame.
    motion : (2, 6, R, C) float64, px
        u, v of each tile, their gradients and second derivatives: what bends within a tile would
        be flattened otherwise.
    torn : (R, C) bool
        Tiles that a crack cuts.

    Notes
    -----
    With H = Σ∇f∇fᵀ, H̄ its mean over the tiles around and b = -Σ∇f r, the motion left over is
    δ + H̄⁻¹(b - H δ) for an estimate δ of it: right on average, whatever δ, and with the noise
    2σ²H̄⁻¹H H̄⁻¹ that no tile without pattern makes large. H⁻¹b alone would have that.
    """
    frame = np.empty((*texture.lattice.shape, tile_kernels.OF_FRAME))
    laid = np.ascontiguousarray(np.moveaxis(motion, (0, 1), (2, 3)))
    tile_kernels.sum_frame(ref.texture, spline, *texture.lattice.origin, laid, frame)
    hessian, known = _hessian(texture.sums), texture.known & ~torn
    valid = known & ~_leaves(ref, texture.lattice, motion)
    b, variance, zncc = _seen(texture.sums, frame, hessian, valid)
    loud = valid & _loud(variance, valid)
    if loud.any():  # what is hidden says nothing of the light
        b, variance, zncc = _seen(texture.sums, frame, hessian, valid & ~loud)
        loud = valid & _loud(variance, valid & ~loud)
    bare = _bare(hessian, texture.sums[..., 9], variance, valid & ~loud, ref.prefilter.sigma)
    valid &= ~bare
    trusted = valid & ~loud
    # A tile that stands alone parts nothing: what is around it says what it has not seen.
    valid = trusted | (loud & ~lines(loud))
    b, hessian = b * trusted[..., None], hessian * trusted[..., None, None]
    start = _around(hessian, b)
    innovation = b - (hessian @ start[..., None])[..., 0]
    delta = start + (texture.even @ innovation[..., None])[..., 0]
    counted = box(trusted.astype(np.float64), _LIGHT)
    noise = box(np.where(trusted, variance, 0.0), _LIGHT) / np.maximum(counted, 1e-9)
    spread = np.maximum(noise, 0.0)[..., None] * texture.even[..., [0, 1], [0, 1]] * texture.gain
    moved = motion[:, 0] + np.moveaxis(delta, -1, 0)
    sigma = np.maximum(np.sqrt(np.moveaxis(spread, -1, 0)), _EXACT)
    return Observation(moved, sigma, valid, bare, zncc, variance)


def box(values: AnyArray, side: int) -> F64:
    """Mean over side x side tiles around each; nothing lies beyond the border."""
    return np.asarray(
        cv2.boxFilter(np.ascontiguousarray(values), -1, (side, side), normalize=True,
                      borderType=cv2.BORDER_CONSTANT),
        dtype=np.float64,
    )  # fmt: skip


def _hessian(sums: F64) -> F64:
    xx, xy, yy = sums[..., 0], sums[..., 1], sums[..., 2]
    return np.stack([np.stack([xx, xy], -1), np.stack([xy, yy], -1)], -2)


def _seen(sums: F64, frame: F64, hessian: F64, lit: Mask) -> tuple[F64, F64, F64]:
    """-Σ∇f r, the variance that the own motion of each tile leaves, and ZNCC."""
    b, squares, zncc = residual(sums, frame, lit)
    return b, _left_over(hessian, b, squares, sums[..., 9]), zncc


def residual(sums: F64, frame: F64, lit: Mask) -> tuple[F64, F64, F64]:
    """Sum what a frame leaves over, tile by tile.

    Parameters
    ----------
    sums : (R, C, 10) float64
        Of the reference.
    frame : (R, C, 5) float64
        Of the frame.
    lit : (R, C) bool
        Tiles that say how bright it is.

    Returns
    -------
    b : (R, C, 2) float64
        -Σ∇f r, r = (g - B)/A - f with the gain A and the offset B of the tiles around.
    squares : (R, C) float64
        Σr².
    zncc : (R, C) float64
        Of the tiles around.
    """
    fx_g, fy_g, g, gg, fg = np.moveaxis(frame, -1, 0)
    _, _, _, fx_f, fy_f, fx, fy, ff, f, n = np.moveaxis(sums, -1, 0)
    mean_n, mean_f, mean_g, mean_ff, mean_gg, mean_fg = (
        box(a * lit, _LIGHT) for a in (n, f, g, ff, gg, fg)
    )
    count = np.maximum(mean_n, 1e-9)
    var_f = np.maximum(mean_ff - mean_f**2 / count, 1e-12)
    var_g = np.maximum(mean_gg - mean_g**2 / count, 1e-12)
    gain = np.sqrt(var_g / var_f)
    offset = (mean_g - gain * mean_f) / count
    b = np.stack([fx_f - (fx_g - offset * fx) / gain, fy_f - (fy_g - offset * fy) / gain], -1)
    squares = (gg - 2 * offset * g + offset**2 * n) / gain**2
    squares += ff - 2 * (fg - offset * f) / gain
    return b, squares, (mean_fg - mean_f * mean_g / count) / np.sqrt(var_f * var_g)


def _left_over(hessian: F64, b: F64, squares: F64, count: F64) -> F64:
    """Variance a pixel that the own motion of each tile leaves, (R, C), grey levels²."""
    xx, xy, yy = hessian[..., 0, 0], hessian[..., 0, 1], hessian[..., 1, 1]
    determinant = np.maximum(xx * yy - xy * xy, 1e-6 * np.square(xx + yy) + 1e-12)
    bx, by = b[..., 0], b[..., 1]
    taken = (yy * bx**2 - 2 * xy * bx * by + xx * by**2) / determinant
    return np.maximum(squares - taken, 0.0) / np.maximum(count - 2, 1.0)


def _loud(variance: F64, valid: Mask) -> Mask:
    """Tiles that leave more over than noise does: hidden, or torn."""
    if not valid.any():
        return np.zeros_like(valid)
    usual = float(np.median(variance[valid][:: max(np.count_nonzero(valid) // _SOME, 1)]))
    filled = np.where(valid, variance, usual).astype(np.float32)
    around = np.asarray(cv2.medianBlur(filled, 5))
    return (variance > _LOUD * np.maximum(around, usual / 2)) | (variance > _LOUDEST * usual)


def lines(loud: Mask) -> Mask:
    """Tiles of which so many touch that they may be a crack or the rim of a hand."""
    from scipy.ndimage import label

    if not loud.any():
        return loud
    labels, _ = label(loud, np.ones((3, 3), int))
    return np.asarray(np.bincount(labels.ravel())[labels] > _ALONE) & loud


def _bare(hessian: F64, count: F64, variance: F64, trusted: Mask, sigma: float) -> Mask:
    """Tiles without pattern: about them the gradient is that of noise, as in a hole.

    Noise of the reference has a gradient, which would hold the tile where it is supposed to be.
    """
    pixels, tiles = box(count * trusted, _HERE), box(trusted.astype(np.float64), _HERE)
    energy = box(np.trace(hessian, axis1=-2, axis2=-1) * trusted, _HERE)
    # A tile leaves the noise of both images.
    noise = box(np.where(trusted, variance, 0.0), _HERE) / np.maximum(tiles, 1e-9) / 2.0
    bare = trusted & (energy < _PATTERN * 2.0 * noise_slope(sigma) * noise * pixels)
    return np.asarray(cv2.dilate(bare.astype(np.uint8), np.ones((_HERE, _HERE), np.uint8)) > 0)


def _leaves(ref: Reference, lattice: TileLattice, motion: F64) -> Mask:
    x, y = lattice.xy.T.reshape(2, *lattice.shape) + motion[:, 0]
    height, width = ref.image.shape
    reach = TILE // 2 - _OFF
    inside = (x >= reach) & (y >= reach) & (x <= width - 1 - reach) & (y <= height - 1 - reach)
    return ~inside


def _around(hessian: F64, b: F64) -> F64:
    """Motion left over of the 3 x 3 tiles around each, (R, C, 2)."""
    xx, xy, yy, bx, by = (
        box(a, 3)
        for a in (
            hessian[..., 0, 0],
            hessian[..., 0, 1],
            hessian[..., 1, 1],
            *np.moveaxis(b, -1, 0),
        )
    )
    determinant = xx * yy - xy * xy
    good = determinant > 1e-3 * np.square(xx + yy)
    safe = np.where(good, determinant, 1.0)
    found = np.stack([yy * bx - xy * by, xx * by - xy * bx], -1) / safe[..., None]
    return np.where(good[..., None], found, 0.0)
