"""Displacement and strain of a full field whose window the data choose, point by point."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from dic.adaptive.adaptive_tiles import AdaptiveTiles, too_small, update
from dic.adaptive.evaluation import PointValues, evaluate
from dic.adaptive.tile_lattice import TILE
from dic.arrays import Mask
from dic.correlation.correlation import correlate
from dic.correlation.reference import Reference, prepare
from dic.fields.displacement import DisplacementField, Status
from dic.images.image import check_image, check_pair
from dic.numbers import check_type

_FOUND = 0.8  # ZNCC of the tiles around, below which it is not the same pattern
_UNDER = 21, 5  # px, subset and step of the grid under scattered points
_BY_TILES = (Status.OK, Status.BROKEN, Status.DISTURBED, Status.NOT_CONVERGED)


def adaptive_field(
    ref: Reference, image: ArrayLike, guess: DisplacementField | ArrayLike | None = None
) -> DisplacementField:
    """Measure the displacement of every point, and its gradient, over windows that the data choose.

    Parameters
    ----------
    ref : Reference
        Its subset finds the pattern again; it does not limit what is resolved.
    image : (H, W) uint8, uint16 or float, grey levels
        The deformed image, of the size of the reference.
    guess : DisplacementField or (N, 2) px, optional
        As for `dic.correlate`.

    Returns
    -------
    DisplacementField
        As of `dic.correlate`, with `gauge` and a gradient of its own, which `dic.strain` takes.
        A point that no block of tiles holds, as in a field too small for one, or alone between
        holes, is what `correlate` measures, and its gauge is the subset.

    Raises
    ------
    ValueError
        As `dic.correlate`.

    Notes
    -----
    The motion that `correlate` finds is taken to tiles of 5 px. Their sums Σ∇f∇fᵀ and Σ∇f r say
    what is left of it, as a white field with known noise, and overlapping blocks say what of that
    is signal: coefficients above a threshold, then Wiener's weights with the first result as the
    signal, after Dabov et al. (IEEE Trans. Image Process. 16, 2080, 2007), of polynomials in place
    of cosines, so that shifts, strains and bends cost few coefficients. The result is the motion of
    the next pass, so what a subset or a tile flattens comes back. σ is that of the error: noise,
    and what a dropped coefficient may hold. No block reaches over a hole, or over a crack that
    parts its tiles.
    """
    check_type(ref, Reference, "ref", "dic.prepare")
    image = check_image(image, "deformed")
    found = correlate(ref, image, guess)
    under = ref if ref.grid is not None else _grid_under(ref)
    start = found if ref.grid is not None else correlate(under, image)
    if too_small(under, start):
        return by_subsets(found)
    return tiles_at_points(found, update(under, start, image))


def adaptive_tiles(
    ref: Reference, image: ArrayLike, found: DisplacementField
) -> AdaptiveTiles | None:
    """Return what `adaptive_field` knows tile by tile; None where the field is too small for it.

    Parameters
    ----------
    ref : Reference
        On a grid.
    image : (H, W) uint8, uint16 or float, grey levels
    found : DisplacementField
        What `correlate` finds of it.

    Raises
    ------
    ValueError
        The image or the field is not of the reference, or the points are scattered.
    """
    check_type(ref, Reference, "ref", "dic.prepare")
    check_type(found, DisplacementField, "found", "dic.correlate")
    image = check_image(image, "deformed")
    check_pair(ref.image.shape, image.shape)
    if ref.grid is None or found.grid is None or found.grid.shape != ref.grid.shape:
        raise ValueError(
            "tiles lie under the grid of a reference and of its field, got scattered points or "
            "another grid; prepare a grid and correlate it"
        )
    return None if too_small(ref, found) else update(ref, found, image)


def _grid_under(ref: Reference) -> Reference:
    weight = ref.texture[3] > 0
    roi = None if weight.all() else weight
    return prepare(ref.image, *_UNDER, roi=roi, prefilter=ref.prefilter)


def tiles_at_points(found: DisplacementField, tiles: AdaptiveTiles) -> DisplacementField:
    """Put what tiles say in the place of what subsets found.

    Parameters
    ----------
    found : DisplacementField
        As of `dic.correlate`, at any points of the image of the tiles.
    tiles : AdaptiveTiles

    Returns
    -------
    DisplacementField
        Where no tile is near, or the pattern was not found again, it is what was found. A point
        about which the tiles see no pattern is FLAT: its subset follows the rim of a hole.
    """
    check_type(found, DisplacementField, "found", "dic.correlate")
    check_type(tiles, AdaptiveTiles, "tiles", "dic.adaptive_tiles")
    at = evaluate(tiles, found.xy)
    alike = np.isin(found.status, _BY_TILES) & (tiles.zncc.ravel()[at.tile] >= _FOUND)
    bare = tiles.bare.ravel()[at.tile] & ~at.known
    return _replaced(_without(by_subsets(found), bare), at, at.known & alike, tiles)


def by_subsets(found: DisplacementField) -> DisplacementField:
    """Return what was found as an adaptive field: its windows are the subsets themselves."""
    gauge = np.full(len(found.xy), float(found.subset))
    if found.order:
        return replace(found, gauge=gauge)
    unknown = np.full_like(found.gradient, np.nan)  # a shift knows no gradient
    return replace(found, gauge=gauge, gradient=unknown, sigma_gradient=unknown)


def _without(found: DisplacementField, bare: Mask) -> DisplacementField:
    """Leave out points that were measured though there is no pattern."""
    wrong = bare & found.valid
    if not wrong.any():
        return found
    unknown = {
        name: np.where(wrong, np.nan, getattr(found, name))
        for name in ("u", "v", "sigma_u", "sigma_v", "gauge")
    } | {
        name: np.where(wrong[:, None, None], np.nan, getattr(found, name))
        for name in ("gradient", "sigma_gradient")
    }
    status = np.where(wrong, Status.FLAT, found.status).astype(np.int8)
    return replace(found, **unknown, status=status)


def _replaced(
    found: DisplacementField, at: PointValues, known: Mask, tiles: AdaptiveTiles
) -> DisplacementField:
    """Write the values of the points that are known into the field that was found."""
    # The window that has this noise: its pixels over those of a tile are the variances inverted.
    alone = tiles.noise.reshape(2, -1)[:, at.tile]
    width = TILE * np.sqrt(np.mean(np.square(alone / at.sigma[:, 0]), axis=0))
    gradient, spread = (np.moveaxis(a[:, 1:], -1, 0) for a in (at.values, at.sigma))
    each = known[:, None, None]
    return replace(
        found,
        u=np.where(known, at.values[0, 0], found.u),
        v=np.where(known, at.values[1, 0], found.v),
        sigma_u=np.where(known, at.sigma[0, 0], found.sigma_u),
        sigma_v=np.where(known, at.sigma[1, 0], found.sigma_v),
        gradient=np.where(each, gradient, found.gradient),
        sigma_gradient=np.where(each, spread, found.sigma_gradient),
        status=np.where(known, Status.OK, found.status).astype(np.int8),
        gauge=np.where(known, width, found.gauge if found.gauge is not None else np.nan),
    )
