"""Displacement by the field net: the adaptive field, corrected where the net knows it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache
from importlib.util import find_spec
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike
from scipy.ndimage import maximum_filter, uniform_filter

from dic import (
    AdaptiveTiles,
    DisplacementField,
    Reference,
    adaptive_field,
    adaptive_tiles,
    correlate,
    tiles_at_points,
)
from models.arrays import F32, F64, Mask
from models.field_net.inputs import corrected, net_inputs
from models.field_net.store import FieldNet, load_field_net
from models.field_net.unet import run
from models.nets.on_device import read_device, run_on

SHIPPED = Path(__file__).with_name("weights.npz")
_AROUND = 9  # tiles, over which a correction is compared with what was seen
_WORSE = 0.3  # by which the χ² of a tile may grow: 2.7 σ of its mean over 81 tiles
_FARTHEST = 6.0  # σ, corrections beyond which nothing was trained
TOO_SMALL = "the image is too small for the net"
REINSTALL = "install touchplate again"  # to train a net does not replace that of the package


@dataclass(frozen=True, eq=False)
class NetField:
    """A field of which the net has corrected what it knows.

    Attributes
    ----------
    field : DisplacementField
        As of `dic.adaptive_field`.
    by_net : (N,) bool
        True where the net has spoken; elsewhere it is the adaptive field.
    reason : str
        What the rest is and why, one sentence.
    """

    field: DisplacementField
    by_net: Mask
    reason: str


def net_field(
    ref: Reference, image: ArrayLike, net: FieldNet | None = None, device: str | None = None
) -> NetField:
    """Measure the displacement of every point of a grid, corrected by the field net.

    Parameters
    ----------
    ref : Reference
        On a grid.
    image : (H, W) uint8, uint16 or float, grey levels
    net : FieldNet, optional
        The shipped one if left out.
    device : str, optional
        Where torch runs the net, such as "cuda"; that of the reference if left out, or else
        torch's CPU.

    Raises
    ------
    ValueError
        As `dic.correlate`; the points are scattered; torch is not installed, or cannot use the
        device.

    Notes
    -----
    Where what the net reads lies outside of what it was trained on, where it says what no training
    held, where its field fits what the tiles saw less well than the adaptive field does, and where
    the file of the shipped net cannot be read, the adaptive field stands and `NetField.reason` says
    so.
    """
    if find_spec("torch") is None:
        raise ValueError(
            "the field net needs torch, which is not installed; run 'pip install torch' or take "
            "the adaptive field"
        )
    start = correlate(ref, image)
    place = read_device(device, ref.device)
    tiles = adaptive_tiles(ref, image, start)
    if tiles is None:
        return adaptive_alone(adaptive_field(ref, image, start), TOO_SMALL)
    try:
        taken = net or shipped_net()
    except (OSError, ValueError) as error:
        return adaptive_alone(tiles_at_points(start, tiles), str(error))
    better, known = correct_tiles(tiles, taken, place)
    found = tiles_at_points(start, better)
    by_net = known.ravel()[tiles.lattice.nearest(found.xy)] & found.valid
    return NetField(found, by_net, _reason(by_net, found.valid))


def adaptive_alone(found: DisplacementField, why: str) -> NetField:
    """Return the adaptive field in the place of that of a net, and why it is; or nothing found."""
    none = np.zeros(len(found.xy), bool)
    reason = why if found.valid.any() else "nothing was found again"
    return NetField(found, none, f"all points are of the adaptive field: {reason}")


def correct_tiles(
    tiles: AdaptiveTiles, net: FieldNet, device: str = "cpu"
) -> tuple[AdaptiveTiles, Mask]:
    """Correct the field of tiles.

    Parameters
    ----------
    tiles : AdaptiveTiles
    net : FieldNet
    device : str
        Where torch runs the net.

    Returns
    -------
    AdaptiveTiles
    by_net : (R, C) bool
        Where the net has spoken.
    """
    inputs = net_inputs(tiles)
    said = evaluate(net, inputs, device)
    rows, columns = tiles.valid.shape
    better = corrected(tiles, said)
    strange = np.any((inputs < net.low) | (inputs > net.high), axis=(0, 1))
    wild = ~np.isfinite(said).all(axis=(0, 1)) | (np.abs(said[:, :3]) > _FARTHEST).any(axis=(0, 1))
    doubtful = np.asarray(maximum_filter(strange | wild, 5), bool)[:rows, :columns]
    known = ~doubtful & ~_fits_worse(tiles, better)
    values = np.where(known, better.values, tiles.values)
    sigma = np.where(known, better.sigma, tiles.sigma)
    factor = np.where(known, better.slope_factor, tiles.slope_factor)
    whole = replace(tiles, values=values, sigma=sigma, slope_factor=factor)
    return whole, known & np.isfinite(values[0, 0])


def evaluate(net: FieldNet, inputs: F32, device: str = "cpu") -> F32:
    """Run the net: (B, 9, R, C) float32 of inputs, (B, 6, R, C) of outputs."""
    return run_on(device, run, net.weights, inputs)


@cache
def shipped_net() -> FieldNet:
    """Load the net that this package ships.

    Raises
    ------
    FileNotFoundError
        Its file is missing.
    ValueError
        Its file is damaged or of another version.
    """
    return load_field_net(SHIPPED, REINSTALL)


def _fits_worse(tiles: AdaptiveTiles, better: AdaptiveTiles) -> Mask:
    seen = tiles.valid & np.isfinite(better.values[0, 0])
    weight = _mean(seen.astype(np.float64))
    worse = np.zeros(seen.shape, bool)
    for a in range(2):
        before, after = (
            np.where(seen, np.square((tiles.seen[a] - t.values[a, 0]) / tiles.noise[a]), 0.0)
            for t in (tiles, better)
        )
        worse |= _mean(after - before) > _WORSE * weight
    return worse


def _mean(plane: F64) -> F64:
    return np.asarray(uniform_filter(plane, _AROUND, mode="constant"))


def _reason(by_net: Mask, valid: Mask) -> str:
    rest = 1 - np.count_nonzero(by_net) / max(np.count_nonzero(valid), 1)
    if rest == 0:
        return "all points are those of the net"
    return f"{rest:.1%} of the points are of the adaptive field: the net has not seen the like"
