"""Orthonormal polynomials on the points of a square block, and noisy blocks shrunk to them."""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.polynomial import legendre

from dic.arrays import F32, AnyArray

_THRESHOLD = 2.8  # σ above which a coefficient is taken for signal in the first pass
_ALWAYS = 2  # total degree below which coefficients are kept: shift and plane
_FAINT = 1.0  # (pilot/σ)² below which a coefficient is dropped
_CLEAR, _BESIDE = 0.8, 0.4  # a gain that is signal for certain, and what it says of the next one
_SHIFT, _PLANE = 0.62, 0.35  # of their variance in one block, that the mean of blocks keeps
_WIDE = 48  # points along a side, from which a block stands less among others and bends more
_WIDE_SHIFT, _WIDE_PLANE, _BENT = 0.85, 0.32, 1.3
_TINY = np.float32(1e-30)
VALUE, ALONG_X, ALONG_Y = 0, 1, 2


@cache
def basis(side: int) -> tuple[F32, F32]:
    """Polynomials (side, side) by degree and point, orthonormal, and their slopes per point."""
    x = (2 * np.arange(side) + 1) / side - 1
    unit = np.eye(side)
    values = np.stack([legendre.legval(x, c) for c in unit])
    slopes = np.stack([legendre.legval(x, legendre.legder(c)) for c in unit]) * 2 / side
    q, r = np.linalg.qr(values.T)
    return q.T.astype(np.float32), np.linalg.solve(r.T, slopes).astype(np.float32)


def analyse(blocks: AnyArray) -> F32:
    """Coefficients (M, n, n) of blocks (M, n, n): by degree along y, then along x."""
    value, _ = basis(blocks.shape[-1])
    return _both(np.asarray(blocks, np.float32), value, value.T)


def degrees(gain: F32) -> int:
    """Count the degrees along each axis that have a part in any block, and one beside them."""
    used = np.flatnonzero(np.any(gain, axis=(0, 1)) | np.any(gain, axis=(0, 2)))
    return min(int(used.max(initial=0)) + 2, gain.shape[-1])


def synthesise(coefficients: F32, side: int, derivative: int = VALUE) -> F32:
    """Blocks (M, n, n) of their first coefficients (M, k, k); or their slope, per point."""
    value, slope = basis(side)
    along, down = (slope if derivative == axis else value for axis in (ALONG_X, ALONG_Y))
    kept = coefficients.shape[-1]
    return _both(coefficients, down[:kept].T, along[:kept])


def spread(weights: F32, side: int, derivative: int = VALUE) -> F32:
    """Σ weight · φ² (M, n, n): variance of a point whose coefficients (M, k, k) have such ones."""
    value, slope = basis(side)
    along, down = (np.square(slope if derivative == axis else value) for axis in (ALONG_X, ALONG_Y))
    kept = weights.shape[-1]
    return _both(weights, down[:kept].T, along[:kept])


def gains(coefficients: F32, sigma: F32, pilot: F32 | None) -> F32:
    """Weigh coefficients (M, n, n) of noise σ (M,), 0…1.

    Without a pilot they are kept or dropped; with one, p²/(p² + σ²) as Wiener's filter does, and
    dropped where the pilot itself is below its noise: a thousand small weights make no field, but
    slopes that are noise.
    """
    power = np.square(sigma)[:, None, None]
    if pilot is None:
        gain = (np.square(coefficients) > _THRESHOLD**2 * power).astype(np.float32)
    else:
        signal = np.square(pilot)
        gain = np.where(signal > _FAINT * power, signal / (signal + power + _TINY), 0)
    for degree in range(_ALWAYS):
        for along in range(degree + 1):
            gain[:, along, degree - along] = 1
    return gain


def uncertainty(gain: F32, side: int) -> F32:
    """Variance of each coefficient over that of its noise: its gain, as of a Wiener filter.

    A coefficient that is dropped may be signal below the noise, the more so beside one that is not.
    Where there is nothing but a plane, blocks that lie over one another err in part on their own,
    and less on average. What a wide block drops of a field that bends is more.
    """
    beside = np.zeros_like(gain)
    large = np.where(gain > _CLEAR, np.float32(_BESIDE), np.float32(0))
    beside[:, 1:] = large[:, :-1]
    beside[:, :, 1:] = np.maximum(beside[:, :, 1:], large[:, :, :-1])
    found = np.maximum(gain, beside)
    clear = gain > _CLEAR
    plain = clear.sum(axis=(1, 2)) == clear[:, 0, 0] + clear[:, 0, 1].astype(int) + clear[:, 1, 0]
    wide = side >= _WIDE
    shift, slope, bent = (_WIDE_SHIFT, _WIDE_PLANE, _BENT) if wide else (_SHIFT, _PLANE, 1.0)
    found[plain, 0, 0] *= shift
    found[plain, 0, 1] *= slope
    found[plain, 1, 0] *= slope
    found[~plain] *= bent
    return found


def _both(blocks: F32, left: F32, right: F32) -> F32:
    """Multiply every block by a matrix on each side; on the right all of them at once."""
    count, first, last = blocks.shape
    rows = (blocks.reshape(-1, last) @ right).reshape(count, first, right.shape[1])
    return np.matmul(left, rows)
