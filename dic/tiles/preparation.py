"""Prepares a reference image for tile sums: its spline, its gradient, and what both will err by."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from dic.arrays import F64, AnyArray
from dic.images.fourier import FADE, shifted
from dic.images.image import check_reference
from dic.images.prefilter import Prefilter, read_prefilter
from dic.images.spectrum import aliased_fraction, aliasing_bias, error_budget, measure_spectrum
from dic.numbers import read_real
from dic.tiles.smooth_gradient import SmoothGradient, tile_scale
from dic.tiles.tile_spline import noise_bias, slopes_at_knots, tile_spline
from dic.tiles.tiles import MARGIN, TileReference, Tiles, lay_tiles, tile_sums

_SHIFT = 0.25  # px, at which interpolation errs most
_UNSURE = 0.3  # of the bias by aliasing: its standard deviation over prints soft and hard


def prepare_tiles(
    image: AnyArray,
    size: int = 16,
    prefilter: Prefilter | float | None = 0.0,
    noise: float | None = None,
) -> TileReference:
    """Prepare a reference image for tile sums.

    Parameters
    ----------
    image : (H, W) uint8, uint16 or float, grey levels
        The mean of several frames where they can be had.
    size : int, px
        Side of a tile, 4 or more.
    prefilter : Prefilter, float in px or None
        Standard deviation of the Gaussian that the gradient passes twice, as if both images had
        passed it once; 0 is none. None chooses from the image alone, `tile_prefilter` with the
        noise of a frame.
    noise : float, grey levels, optional
        Standard deviation of the noise of this image, σ/√N of a mean of N frames. It makes motions
        look too large, which is a part of `TileReference.bias`, and is not the pattern's. Without
        it the image counts as one without noise.

    Raises
    ------
    ValueError
        If the image, the prefilter or the noise cannot be used, or the image is too small for one
        tile.
    """
    grey = check_reference(image).astype(np.float32)
    tiles = lay_tiles(grey.shape, size)
    everywhere = np.ones(grey.shape, dtype=np.bool_)
    chosen = read_prefilter(prefilter, grey, everywhere, size)
    if noise is not None:
        noise = read_real(noise, "noise", "grey levels")
    f = grey.astype(np.float64)
    coefficients = tile_spline(f)
    gradient = slopes_at_knots(coefficients)
    reference = TileReference(
        tiles=tiles,
        image=grey,
        coefficients=coefficients.astype(np.float32),
        gradient=gradient.astype(np.float32),
        hessian=_products(tiles, gradient),
        light=_light(tiles, gradient, f),
        bias=np.zeros(2),
    )
    if chosen.sigma:
        reference = _smoothed(reference, chosen, gradient)
    spectrum = measure_spectrum(grey, everywhere, noise)
    shifted_by, of_noise = _interpolation_bias(reference, noise or 0.0)
    aliased = aliasing_bias(spectrum, chosen.sigma) if spectrum else np.zeros(2)
    reference = replace(reference, bias=_known_part(shifted_by, aliased) - of_noise)
    if spectrum is None:
        return reference
    unsure = np.hypot(shifted_by - aliased, _UNSURE * aliased)
    return replace(
        reference,
        aliasing=error_budget(spectrum, chosen.sigma).random / size,
        roughness=aliased_fraction(spectrum) ** 0.5,
        gain_error=2.0 * np.pi * float(np.mean(unsure)),
    )


def _smoothed(reference: TileReference, prefilter: Prefilter, gradient: F64) -> TileReference:
    """Read frames by a smoothed gradient; that of the reference is (2, H, W)."""
    tiles, f = reference.tiles, reference.image.astype(np.float64)
    coefficients = tile_spline(prefilter.apply(prefilter.apply(f)).astype(np.float64))
    slopes = slopes_at_knots(coefficients)
    products = _products(tiles, slopes)
    mixed = np.stack([np.stack([tiles.sums(a * b) for b in gradient], -1) for a in slopes], 1)
    smooth = SmoothGradient(
        prefilter,
        coefficients.astype(np.float32),
        slopes.astype(np.float32),
        tile_scale(mixed, products),
    )
    hessian, light = smooth.hessian(products), smooth.light(_light(tiles, slopes, f))
    return replace(reference, hessian=hessian, light=light, smooth=smooth)


def _products(tiles: Tiles, slopes: F64) -> F64:
    """Sum the products of slopes (2, H, W) over each tile, (T, 3)."""
    fx, fy = slopes
    return np.column_stack([tiles.sums(a) for a in (fx * fx, fx * fy, fy * fy)])


def _light(tiles: Tiles, slopes: F64, f: F64) -> F64:
    """Give `TileReference.light` of an image (H, W) with such slopes."""
    fx, fy = slopes
    return np.column_stack([tiles.sums(a) for a in (fx * f, fy * f, fx, fy, f * f, f)])


def _known_part(bias: F64, aliased: F64) -> F64:
    """Take what aliasing has folded back off a bias (2,) px of images shifted by their series.

    From half of the bias on less and less counts, since its sign is not known, and evenly so, that
    a patch of a pattern says the same as all of it. 0 where aliasing is all of it.
    """
    left = np.maximum(bias - aliased, 0.0)
    return left * np.minimum(1.0, 2.0 * left / np.maximum(bias, _SHIFT * 1e-9))


def _interpolation_bias(reference: TileReference, noise: float) -> tuple[F64, F64]:
    """Measure what interpolation adds to the image itself, shifted by its Fourier series.

    That series takes what aliasing has folded back for what it looks like. It moves noise as well,
    which frames do not.

    Returns
    -------
    (2,) float64, px
        Of the pattern; 0 where no tile is far enough from the border, and without a pattern.
    (2,) float64, px
        What noise adds where it stays.
    """
    tiles, shape = reference.tiles, np.array(reference.image.shape[::-1])
    room = np.minimum(tiles.xy, shape - 1 - tiles.xy).min(axis=1) - tiles.size / 2
    inside = room >= FADE + MARGIN
    hessian = reference.hessian[inside].sum(axis=0)[[0, 2]]
    if not np.all(hessian > 0.0):
        return np.zeros(2), np.zeros(2)
    flow = np.full((len(tiles.xy), 2), _SHIFT)
    sums = tile_sums(reference, shifted(reference.image, (_SHIFT, _SHIFT)), flow)
    own, moved = (
        _even(reference, noise**2 * each)[inside].sum(axis=0)
        for each in noise_bias(reference.prefilter.sigma)
    )
    return (moved - sums.gradient[inside].sum(axis=0)) / hessian, own / hessian


def _even(reference: TileReference, each: float) -> F64:
    """Give Σ∇f·e of tiles each pixel of which adds the same along x and y, (T, 2)."""
    tiles, smooth = reference.tiles, reference.smooth
    sums = np.full((len(reference.hessian), 2), tiles.size**2 * each)
    return sums if smooth is None else smooth.vectors(sums)
