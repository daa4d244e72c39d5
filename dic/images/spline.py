"""Quintic B-spline interpolation of images: the smooth function whose samples are the pixels.

A cubic costs half and is biased three to four times as much between the pixels: 3.0 against 0.9 mpx
on rendered speckle with edges of three pixels.
"""

from __future__ import annotations

import math
from functools import cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dic.arrays import F32, F64, AnyArray
from dic.compiled import njit
from dic.images.image import check_image
from dic.images.warp import PAD, knot_weights
from dic.numbers import check_array, shown

_POLES = (  # of the inverse of (1, 26, 66, 26, 1)/120
    math.sqrt(135 / 2 - math.sqrt(17745 / 4)) + math.sqrt(105 / 4) - 13 / 2,
    math.sqrt(135 / 2 + math.sqrt(17745 / 4)) - math.sqrt(105 / 4) - 13 / 2,
)
_GAIN = 120
_HORIZON = 25  # _POLES[0] ** 25 = 7e-10, below float32


def spline_coefficients(image: ArrayLike) -> F32:
    """Coefficients of the interpolating quintic B-spline.

    Beyond a border the image goes on as its mirror turned by half a turn about the last pixel,
    2 f(0) - f(k): values and slopes pass the border. A plain mirror, without slope, biases the
    outermost points by 10 mpx.

    Parameters
    ----------
    image : (H, W), grey levels

    Returns
    -------
    (H + 2 PAD, W + 2 PAD) float32, C-contiguous

    Raises
    ------
    ValueError
        The image cannot be used.

    References
    ----------
    Unser, Aldroubi, Eden 1993, B-spline signal processing: part II, IEEE Trans. Signal Process. 41,
    834, equation 2.5.
    """
    return prefilter(check_image(image, "interpolated"))


def prefilter(image: AnyArray) -> F32:
    """Do what `spline_coefficients` does to an image (H, W) that was checked."""
    import cv2

    lying = np.asarray(cv2.transpose(np.asarray(image, dtype=np.float32)), dtype=np.float32)
    _filter(lying)
    spline = np.asarray(cv2.transpose(lying), dtype=np.float32)
    _filter(spline)
    spline *= np.float32(_GAIN * _GAIN)
    padded = cv2.copyMakeBorder(spline, PAD, PAD, PAD, PAD, cv2.BORDER_REFLECT_101)
    padded = np.asarray(padded, dtype=np.float32)
    for lines in (padded, padded.T, padded[::-1], padded.T[::-1]):
        lines[:PAD] = 2 * lines[PAD] - lines[:PAD]
    return padded


def spline_gradient(
    spline: F32,
) -> tuple[NDArray[np.floating], NDArray[np.floating]]:
    """Differentiate at the pixels: ∂/∂x and ∂/∂y, each (H, W) float32, grey levels per px.

    Raises
    ------
    ValueError
        `spline` is not what `spline_coefficients` gives.
    """
    check_array(spline, "spline", "f", 2)
    if spline.dtype != np.float32 or min(spline.shape) <= 2 * PAD:
        raise ValueError(
            f"spline must be float32 and larger than its border of {2 * PAD} px, "
            f"got {shown(spline)}; take it from spline_coefficients"
        )
    slope = [1 / 24, 10 / 24, 0.0, -10 / 24, -1 / 24]
    value = [1 / 120, 26 / 120, 66 / 120, 26 / 120, 1 / 120]
    return _cut(_weigh(spline, value, slope)), _cut(_weigh(spline, slope, value))


def _weigh(spline: AnyArray, down: list[float], across: list[float]) -> F32:
    import cv2

    x, y = (np.array(taps[::-1], np.float32) for taps in (across, down))
    return np.asarray(cv2.sepFilter2D(spline, cv2.CV_32F, x, y), dtype=np.float32)


def _cut(padded: F32) -> F32:
    return padded[PAD:-PAD, PAD:-PAD]


@njit(cache=True, nogil=True, fastmath=True)
def _filter(c: F32) -> None:
    """Filter along the first axis, all columns at a time; unscaled.

    About the ends the image is odd but for a constant, which the filter only scales.
    """
    last = c.shape[0] - 1
    for pole in _POLES:
        end = np.float32(-pole / (1 - pole) ** 2) * c[last]
        c[0] *= np.float32((1 + pole) / (1 - pole))
        for k in range(1, min(_HORIZON, last)):
            _add(c[0], np.float32(-(pole**k)), c[k])
        for k in range(1, last):
            _add(c[k], np.float32(pole), c[k - 1])
        c[last] = end
        for k in range(last - 1, -1, -1):
            _turn(c[k], np.float32(pole), c[k + 1])


@njit(cache=True, nogil=True, fastmath=True)
def filter_square(square: F32, scratch: F32) -> None:
    """Turn a square image (n, n) float32 into its coefficients."""
    _filter(square)
    _lay(square, np.float32(1), scratch)
    _filter(scratch)
    _lay(scratch, np.float32(_GAIN * _GAIN), square)


@njit(cache=True, nogil=True, fastmath=True)
def _lay(square: F32, scale: np.float32, out: F32) -> None:
    for i in range(square.shape[0]):
        row = out[i]
        for j in range(square.shape[0]):
            row[j] = scale * square[j, i]


@njit(cache=True, nogil=True, fastmath=True)
def _add(row: F32, factor: np.float32, other: F32) -> None:
    for x in range(row.shape[0]):
        row[x] += factor * other[x]


@njit(cache=True, nogil=True, fastmath=True)
def _turn(row: F32, factor: np.float32, after: F32) -> None:
    for x in range(row.shape[0]):
        row[x] = factor * (after[x] - row[x])


@cache
def noise_power(sigma: float = 0.0) -> tuple[float, float]:
    """Mean and first harmonic of the variance that noise keeps between the pixels.

    The noise is white, smoothed by a Gaussian of `sigma` px, and of variance 1 at a pixel. The
    spline smooths it between pixels. Along one axis the variance at the fraction t is
    mean + harmonic · cos(2πt) to 2 %; the two axes multiply.
    """
    omega, density = _noise_spectrum(sigma)
    places = np.arange(8) / 8
    power = [np.sum(density * np.abs(spline_response(omega, t)) ** 2) for t in places]
    harmonic = 2 * np.mean(power * np.cos(2 * np.pi * places))
    return float(np.mean(power)), float(harmonic)


@cache
def noise_slope(sigma: float = 0.0) -> float:
    """Variance of ∂/∂x of the spline at the pixels of noise of variance 1, px⁻²."""
    omega, density = _noise_spectrum(sigma)
    slope = (10 * np.sin(omega) + np.sin(2 * omega)) / 12
    return float(np.sum(density * (slope / _prefilter(omega)) ** 2))


def _noise_spectrum(sigma: float) -> tuple[F64, F64]:
    """Frequencies along one axis, and the power of smoothed noise on them, 1 in all."""
    omega = np.asarray(2 * np.pi * np.fft.fftfreq(256), dtype=np.float64)
    power = np.exp(-np.square(omega * sigma))
    return omega, power / power.sum()


def spline_response(omega: F64, t: float) -> NDArray[np.complex128]:
    """Interpolate the waves exp(iωx) at the fraction t of a px, where exp(iωt) is exact."""
    knots = np.arange(-2, 4)
    waves = np.exp(1j * np.multiply.outer(omega, knots)) @ np.array(knot_weights(np.float32(t)))
    return np.asarray(waves / _prefilter(omega), dtype=np.complex128)


def impulse_response(reach: int) -> F64:
    """Coefficients of an image that is 1 at one pixel, along one axis, (2 reach + 1,)."""
    omega = 2 * np.pi * np.fft.rfftfreq(256)
    behind = np.fft.irfft(1 / _prefilter(omega))
    return np.asarray(behind[np.arange(-reach, reach + 1)], dtype=np.float64)


def _prefilter(omega: AnyArray) -> F64:
    return (66 + 52 * np.cos(omega) + 2 * np.cos(2 * omega)) / 120
