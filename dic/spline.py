"""Cubic B-spline interpolation of pictures: the smooth function whose samples are the pixels."""

from __future__ import annotations

import math
from functools import cache

import numpy as np
from numba import njit
from numpy.typing import ArrayLike, NDArray

PAD = 3  # px of mirrored coefficients on each side, for the four taps at up to half a px outside
_POLE = math.sqrt(3.0) - 2.0  # of the inverse of (1, 4, 1)/6
_HORIZON = 16  # _POLE ** 16 = 7e-10, below float32


def coefficients(image: ArrayLike) -> NDArray[np.float32]:
    """Coefficients of the interpolating cubic B-spline, mirrored at the borders.

    Parameters
    ----------
    image : (H, W), grey levels

    Returns
    -------
    (H + 2 PAD, W + 2 PAD) float32, C-contiguous

    References
    ----------
    Unser, Aldroubi, Eden 1993, B-spline signal processing: part II, IEEE Trans. Signal Process. 41,
    834, equation 2.5.
    """
    spline = np.array(image, dtype=np.float32, order="C")
    _filter_rows(spline)
    _filter_columns(spline)
    return np.pad(spline, PAD, mode="reflect")


def gradient(spline: NDArray[np.float32]) -> tuple[NDArray[np.floating], NDArray[np.floating]]:
    """Differentiate at the pixels: ∂/∂x and ∂/∂y, each (H, W) float32, grey levels per px."""
    inner = slice(PAD, -PAD)
    before, after = slice(PAD - 1, -PAD - 1), slice(PAD + 1, -PAD + 1)
    third, twelfth = np.float32(1 / 3), np.float32(1 / 12)
    along_x = spline[:, after] - spline[:, before]
    along_y = spline[after, :] - spline[before, :]
    gx = twelfth * (along_x[before] + along_x[after]) + third * along_x[inner]
    gy = twelfth * (along_y[:, before] + along_y[:, after]) + third * along_y[:, inner]
    return gx, gy


@njit(cache=True, nogil=True, fastmath=True)
def sample(spline, x, y):
    """Value of the spline at (x, y) px; places off the picture are moved to its edge."""
    height, width = spline.shape[0] - 2 * PAD, spline.shape[1] - 2 * PAD
    x = min(max(x, -0.5), width - 0.5)
    y = min(max(y, -0.5), height - 0.5)
    column, row = math.floor(x), math.floor(y)
    # The fraction is small, so single precision holds it; the place itself would lose 2e-4 px.
    a0, a1, a2, a3 = _weights(np.float32(x - column))
    b0, b1, b2, b3 = _weights(np.float32(y - row))
    i, j = row + PAD - 1, column + PAD - 1
    r0 = a0 * spline[i, j] + a1 * spline[i, j + 1] + a2 * spline[i, j + 2] + a3 * spline[i, j + 3]
    i += 1
    r1 = a0 * spline[i, j] + a1 * spline[i, j + 1] + a2 * spline[i, j + 2] + a3 * spline[i, j + 3]
    i += 1
    r2 = a0 * spline[i, j] + a1 * spline[i, j + 1] + a2 * spline[i, j + 2] + a3 * spline[i, j + 3]
    i += 1
    r3 = a0 * spline[i, j] + a1 * spline[i, j + 1] + a2 * spline[i, j + 2] + a3 * spline[i, j + 3]
    return b0 * r0 + b1 * r1 + b2 * r2 + b3 * r3


@njit(cache=True, nogil=True, fastmath=True)
def _weights(t):
    sixth, half, one = np.float32(1 / 6), np.float32(0.5), np.float32(1)
    s = one - t
    w0, w3 = s * s * s * sixth, t * t * t * sixth
    w1 = np.float32(2 / 3) - t * t * (one - half * t)
    return w0, w1, one - w0 - w1 - w3, w3


@njit(cache=True, nogil=True)
def _filter_rows(c):
    for row in c:
        last, total = row.shape[0] - 1, row[0]
        for k in range(1, min(_HORIZON, last)):
            total += _POLE**k * row[k]
        row[0] = total
        for k in range(1, last + 1):
            row[k] += _POLE * row[k - 1]
        row[last] = _POLE / (_POLE * _POLE - 1) * (row[last] + _POLE * row[last - 1])
        for k in range(last - 1, -1, -1):
            row[k] = _POLE * (row[k + 1] - row[k])
        row *= 6


@njit(cache=True, nogil=True)
def _filter_columns(c):
    last = c.shape[0] - 1
    for k in range(1, min(_HORIZON, last)):
        c[0] += _POLE**k * c[k]
    for k in range(1, last + 1):
        c[k] += _POLE * c[k - 1]
    c[last] = _POLE / (_POLE * _POLE - 1) * (c[last] + _POLE * c[last - 1])
    for k in range(last - 1, -1, -1):
        c[k] = _POLE * (c[k + 1] - c[k])
    c *= 6


@cache
def noise_power() -> tuple[float, float]:
    """Mean and first harmonic of the variance that white noise keeps between the pixels.

    The spline leaves noise of variance 1 at a pixel and smooths it between pixels. Along one axis
    the variance at the fraction t is mean + harmonic · cos(2πt) to 2 %; the two axes multiply.
    """
    omega = 2 * np.pi * np.arange(256) / 256
    prefilter = (4 + 2 * np.cos(omega)) / 6
    power = []
    for t in np.arange(8) / 8:
        s = 1 - t
        taps = (s**3, 4 - 6 * t**2 + 3 * t**3, 4 - 6 * s**2 + 3 * s**3, t**3)
        response = sum(w / 6 * np.exp(1j * omega * k) for k, w in enumerate(taps)) / prefilter
        power.append(np.mean(np.abs(response) ** 2))
    harmonic = 2 * np.mean(power * np.cos(2 * np.pi * np.arange(8) / 8))
    return float(np.mean(power)), float(harmonic)


@cache
def noise_slope() -> float:
    """Variance of ∂/∂x of the spline at the pixels of white noise of variance 1, px⁻²."""
    omega = 2 * np.pi * np.arange(256) / 256
    return float(np.mean((np.sin(omega) * 6 / (4 + 2 * np.cos(omega))) ** 2))
