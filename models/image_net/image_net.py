"""Displacement by the image net: the adaptive field, refined where the net has seen the like."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from importlib.util import find_spec
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike
from scipy.ndimage import map_coordinates, spline_filter
from scipy.spatial import KDTree

from dic import (
    DisplacementField,
    Reference,
    Status,
    adaptive_field,
    adaptive_tiles,
    check_image,
    correlate,
    tiles_at_points,
)
from models.arrays import F64, I64, AnyArray, Mask
from models.field_net.field_net import REINSTALL, TOO_SMALL, NetField, adaptive_alone
from models.image_net.features import STRIDE
from models.image_net.refine import RefinedCells, refine
from models.image_net.store import ImageNet, load_image_net
from models.image_net.warped_pair import CELL, first_motion, image_pair
from models.nets.on_device import read_device

SHIPPED = Path(__file__).with_name("weights.npz")
_SMALLEST = 4 * STRIDE * CELL  # px along a side of an image
_REFINED = (
    Status.OK, Status.LOW_CORRELATION, Status.NOT_CONVERGED, Status.DISTURBED, Status.BROKEN,
)  # fmt: skip


def image_net_field(
    ref: Reference, image: ArrayLike, net: ImageNet | None = None, device: str | None = None
) -> NetField:
    """Measure the displacement of every point of a grid, refined by the image net from the images.

    Parameters
    ----------
    ref : Reference
        On a grid.
    image : (H, W) uint8, uint16 or float, grey levels
    net : ImageNet, optional
        The shipped one if left out.
    device : str, optional
        Where torch runs the net, such as "cuda"; that of the reference if left out, or else
        torch's CPU.

    Raises
    ------
    ValueError
        As `dic.adaptive_field`; the points are scattered; torch is not installed, or cannot use the
        device.

    Notes
    -----
    The second image is read back by the adaptive field; what is left over is refined in passes, of
    which each starts where the last has ended. Where what the net reads lies outside of what it was
    trained on, where its motion leaves more of the images than noise does, where it says no more
    than it makes of noise, and where its file cannot be read, the adaptive field stands and
    `NetField.reason` says so. Slopes are those of the refined field, and their σ is that of the
    adaptive field, grown as that of the displacement is; of what blocks lie apart by, which widens
    that σ, the net finds a part, and the root counts.
    """
    if find_spec("torch") is None:
        raise ValueError(
            "the image net needs torch, which is not installed; run 'pip install torch' or take "
            "the adaptive field"
        )
    start = correlate(ref, image)
    place = read_device(device, ref.device)
    if start.grid is None:
        raise ValueError(
            "the image net refines the field of a grid, got scattered points; prepare a grid"
        )
    tiles = adaptive_tiles(ref, image, start)
    if tiles is None:
        return adaptive_alone(adaptive_field(ref, image, start), TOO_SMALL)
    found = tiles_at_points(start, tiles)
    if min(ref.image.shape) < _SMALLEST or not found.valid.any():
        return adaptive_alone(found, TOO_SMALL)
    try:
        taken = net or shipped_image_net()
    except (OSError, ValueError) as error:
        return adaptive_alone(found, str(error))
    pair = image_pair(ref, check_image(image, "deformed"))
    cells = refine(taken, pair, first_motion(found, ref.image.shape), place)
    part = replace(tiles, slope_factor=np.sqrt(tiles.slope_factor))
    return _at_points(found, tiles_at_points(start, part).sigma_gradient, cells)


@cache
def shipped_image_net() -> ImageNet:
    """Load the net that this package ships.

    Raises
    ------
    FileNotFoundError
        Its file is missing.
    ValueError
        Its file is damaged or of another version.
    """
    return load_image_net(SHIPPED, REINSTALL)


def _at_points(found: DisplacementField, spread: F64, cells: RefinedCells) -> NetField:
    """Put what the net has found in the place of the adaptive field, where it is known.

    `spread` (N, 2, 2) is σ of slopes that grows where it does.
    """
    place = ((found.xy - (CELL - 1) / 2) / CELL)[:, ::-1].T  # rows, columns of cells
    nearest = np.rint(place).astype(np.int64)
    nearest = np.clip(nearest, 0, np.array(cells.known.shape)[:, None] - 1)
    known, changed = (part[nearest[0], nearest[1]] for part in (cells.known, cells.changed))
    by_net = known & changed & np.isin(found.status, _REFINED)
    splines = [spline_filter(part, 3, mode="nearest") for part in _finite(cells.motion)]
    values = np.stack([_interpolated(spline, place) for spline in splines])
    sigma = cells.sigma[:, nearest[0], nearest[1]].astype(np.float64)
    near = _nearest_measured(found)
    growth = sigma / np.stack([found.sigma_u, found.sigma_v])[:, near]
    slopes = np.stack([_slopes(spline, place) for spline in splines], axis=1)
    each = by_net[:, None, None]
    field = replace(
        found,
        u=np.where(by_net, values[0], found.u),
        v=np.where(by_net, values[1], found.v),
        sigma_u=np.where(by_net, sigma[0], found.sigma_u),
        sigma_v=np.where(by_net, sigma[1], found.sigma_v),
        gradient=np.where(each, slopes, found.gradient),
        sigma_gradient=np.where(each, growth.T[:, :, None] * spread[near], found.sigma_gradient),
        status=np.where(by_net, Status.OK, found.status).astype(np.int8),
        gauge=_gauge(found, near, np.where(by_net, growth, 1.0)),
    )
    return NetField(field, by_net, _reason(by_net, known, field.valid))


def _nearest_measured(found: DisplacementField) -> I64:
    """Return the nearest point that is measured for each point, (N,); its own number if it is."""
    measured = np.flatnonzero(found.valid)
    _, nearest = KDTree(found.xy[measured]).query(found.xy)
    return measured[np.asarray(nearest, dtype=np.int64)]


def _gauge(found: DisplacementField, near: I64, growth: F64) -> F64 | None:
    """Window of the points whose σ (2, N) has grown: its pixels go with the inverse variance."""
    if found.gauge is None:
        return None
    return np.asarray(found.gauge[near] / np.sqrt(np.mean(np.square(growth), axis=0)), np.float64)


def _finite(motion: AnyArray) -> F64:
    return np.nan_to_num(motion).astype(np.float64)


def _interpolated(spline: F64, place: F64) -> F64:
    """Read the cubic spline through the middles of the cells, given by its coefficients."""
    return np.asarray(map_coordinates(spline, place, order=3, mode="nearest", prefilter=False))


def _slopes(spline: F64, place: F64) -> F64:
    """∂/∂x and ∂/∂y at places, by differences over two cells: (N, 2) px per px."""
    down, right = np.array([[1.0], [0.0]]), np.array([[0.0], [1.0]])
    steps = [
        _interpolated(spline, place + step) - _interpolated(spline, place - step)
        for step in (right, down)
    ]
    return np.column_stack(steps) / (2 * CELL)


def _reason(by_net: Mask, known: Mask, valid: Mask) -> str:
    """Say why points are not those of the net: it adds nothing there, or it is not believed."""
    count = max(np.count_nonzero(valid), 1)
    causes = {
        "because the net changes nothing there": valid & ~by_net & known,
        "because it has not seen the like or leaves more of the images than noise": valid & ~known,
    }
    fractions = {why: np.count_nonzero(part) / count for why, part in causes.items()}
    said = [f"{part:.1%} {why}" for why, part in fractions.items() if part]
    if not said:
        return "all points are those of the net"
    total = sum(fractions.values())
    return f"{total:.1%} of the points are of the adaptive field: {', and '.join(said)}"
