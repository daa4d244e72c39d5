"""Noise and gain of a camera from still images at several exposures (photon transfer)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import cast

import numpy as np

from rig.system.arrays import F64, I64, AnyArray

CLIPPED = 250.0  # grey levels, from which on a pixel may be cut off
BINS = 24


@dataclass(frozen=True)
class Photon:
    """How the noise of a camera grows with its signal: variance = read² + gain · (mean - black).

    Attributes
    ----------
    gain : float
        Grey levels per electron.
    read : float, grey levels
        Standard deviation in the dark, rounding included.
    sigma_gain, sigma_read : float
        Standard deviations of the two.
    residual : float
        RMS of the fit over the variances, as a fraction.
    """

    gain: float
    read: float
    sigma_gain: float
    sigma_read: float
    residual: float


def photon_transfer(series: Sequence[Sequence[AnyArray]], black: float = 0.0) -> Photon:
    """Fit the line of photon transfer to series of still images (Janesick 2007, chapter 5).

    The noise is taken from differences of neighbouring frames, which a lamp that drifts hardly
    changes; pixels are sorted by their mean, so that a pattern serves as well as a grey card.

    Parameters
    ----------
    series : sequence of sequences of (H, W) images
        Four frames or more at each of some exposures.
    black : float, grey levels
        Level of an image without light.

    Raises
    ------
    ValueError
        If there are too few images, or all have one brightness.
    """
    if not series or min(len(frames) for frames in series) < 4:
        raise ValueError("noise and gain need 4 still images or more at each exposure; take some")
    means, variances, weights = (
        np.concatenate(part) for part in zip(*map(_bins, series), strict=True)
    )
    if np.ptp(means) < 20:
        raise ValueError(
            f"noise and gain need images of several brightnesses, got {means.min():.0f} to"
            f" {means.max():.0f} grey levels; change the exposure between the series"
        )
    # The variance of an estimated variance v of n numbers is 2 v² / n.
    root = np.sqrt(weights / 2) / variances
    design = np.column_stack([means - black, np.ones_like(means)])
    normal = np.linalg.inv((design * root[:, None] ** 2).T @ design)
    gain, floor = normal @ (design.T @ (root**2 * variances))
    left = variances / (design @ (gain, floor)) - 1
    read = float(np.sqrt(max(floor, 0.0)))
    inflated = max(1.0, float(np.mean((root * (variances - design @ (gain, floor))) ** 2)))
    sigma = np.sqrt(np.diag(normal) * inflated)
    return Photon(
        gain=float(gain),
        read=read,
        sigma_gain=float(sigma[0]),
        sigma_read=float(sigma[1] / (2 * max(read, 1e-3))),
        residual=float(np.sqrt(np.mean(left**2))),
    )


def _bins(frames: Sequence[AnyArray]) -> tuple[F64, F64, F64]:
    """Mean, variance and weight of pixels of like brightness."""
    stack = np.stack([np.asarray(frame, dtype=np.float64) for frame in frames])
    mean = stack.mean(axis=0)
    steps = np.diff(stack, axis=0)
    steps -= steps.mean(axis=(1, 2), keepdims=True)
    variance = np.square(steps).mean(axis=0) / 2
    usable = stack.max(axis=0) < CLIPPED
    mean, variance = mean[usable], variance[usable]
    edges = np.quantile(mean, np.linspace(0, 1, BINS + 1)[1:-1]) if mean.size else np.empty(0)
    name = cast(I64, np.searchsorted(edges, mean))
    count = np.bincount(name, minlength=BINS)
    full = count > 100
    level, spread = (np.bincount(name, part, BINS)[full] / count[full] for part in (mean, variance))
    # Neighbouring differences share a frame: worth two thirds of as many independent ones.
    return level, spread, count[full] * (len(frames) - 1) * 2 / 3
