"""The filter that an image passes before it is correlated: none, or a Gaussian."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from dic.arrays import F32, AnyArray, Mask
from dic.images.spectrum import Budget, Spectrum, error_budget, measure_spectrum
from dic.numbers import read_real

SIGMAS = (0.0, 0.8, 1.1, 1.5, 2.0)
"""Gaussians that are chosen from, px."""

_NEAR = 1.25  # times the least error: the smallest filter below it is taken
_GAIN = 1.05  # ratio of predicted errors from which a filter is worth its loss of resolution
_MATTERS = 0.5e-3  # px, errors below this are those of the best patterns
_LARGEST = 5.0  # px


@dataclass(frozen=True)
class Prefilter:
    """A Gaussian before correlation, and what it was chosen from.

    Attributes
    ----------
    sigma : float, px
        Standard deviation of the Gaussian; 0 is none.
    noise : float, grey levels
        Standard deviation of the noise of an image, from its spectrum or from several; NaN if not
        measured.
    without, predicted : float, px
        Error of a displacement predicted without a filter and with this one, of noise,
        interpolation and aliasing; NaN if not predicted.
    bias : float, px
        The part of `predicted` that is the same for every subset, a wave over the fraction of a px.
    """

    sigma: float = 0.0
    noise: float = float("nan")
    without: float = float("nan")
    predicted: float = float("nan")
    bias: float = 0.0

    @property
    def reason(self) -> str:
        """What was chosen and why, in a sentence."""
        name = f"prefilter: Gaussian of {self.sigma:g} px" if self.sigma else "no prefilter"
        if not np.isfinite(self.predicted):
            return f"{name}, as asked for"
        predicted = f"{name}, an error of {self.predicted:.2g} px is predicted"
        return f"{predicted}, {self.without:.2g} px without it" if self.sigma else predicted

    def apply(self, image: AnyArray) -> AnyArray:
        """Smooth an image (H, W): float32, or the image itself where there is no filter."""
        return smooth_image(image, self.sigma) if self.sigma else image


def smooth_image(image: AnyArray, sigma: float) -> F32:
    """Convolve an image (H, W) with a Gaussian of `sigma` px.

    Beyond its border it goes on as in `dic.spline_coefficients`.
    """
    import cv2

    plain, taps = np.asarray(image, dtype=np.float32), gaussian_taps(sigma)
    reach = min(len(taps) // 2, *(n - 1 for n in plain.shape))
    padded = cv2.copyMakeBorder(plain, reach, reach, reach, reach, cv2.BORDER_REFLECT_101)
    for lines in (padded, padded.T, padded[::-1], padded.T[::-1]):
        lines[:reach] = 2 * lines[reach] - lines[:reach]
    smooth = cv2.sepFilter2D(padded, cv2.CV_32F, taps, taps)[reach:-reach, reach:-reach]
    return np.ascontiguousarray(smooth, dtype=np.float32)


def gaussian_power(sigma: float) -> float:
    """Variance that a Gaussian of `sigma` px leaves of white noise of variance 1."""
    return float(np.sum(np.square(gaussian_taps(sigma), dtype=np.float64)) ** 2)


@cache
def gaussian_taps(sigma: float) -> F32:
    """Weights of a Gaussian of `sigma` px along one axis, (2 R + 1,), (1,) for none."""
    reach = int(np.ceil(4 * sigma))
    taps = np.exp(-np.square(np.arange(-reach, reach + 1)) / (2 * max(sigma, 1e-6) ** 2))
    return (taps / taps.sum()).astype(np.float32)


def read_prefilter(
    given: Prefilter | float | None, image: AnyArray, roi: Mask, subset: int
) -> Prefilter:
    """Return the filter asked for, or choose one from the image where none is.

    Raises
    ------
    ValueError
        It is neither a `Prefilter` nor a width in px.
    """
    if isinstance(given, Prefilter):
        return given
    if given is None:
        return choose_prefilter(image, roi, subset)
    sigma = read_real(given, "prefilter", "px")
    if not 0 <= sigma <= _LARGEST:
        raise ValueError(
            f"prefilter must be from 0 to {_LARGEST:g} px, got {sigma:g} px; "
            "0 is none, and 0.7 to 1 px is usual"
        )
    return Prefilter(sigma)


def choose_prefilter(
    image: AnyArray, roi: Mask, subset: int, noise: float | None = None
) -> Prefilter:
    """Choose between no filter and a Gaussian by the errors that the pattern's spectrum predicts.

    `noise` is that of a frame, in grey levels, where it is known; else the spectrum says it.

    The smallest Gaussian that comes near the best is taken, and none where the best gains little:
    a filter flattens the pattern, and what is gained beside strong noise is lost in resolution.
    """
    spectrum = _measured(image, roi, noise)
    if spectrum is None:
        return Prefilter()
    return _smallest_near_best(spectrum, [error_budget(spectrum, s) for s in SIGMAS], subset)


def choose_tile_prefilter(image: AnyArray, size: int, noise: float) -> Prefilter:
    """Choose likewise for tiles of `size` px of a reference without noise.

    `noise` is that of a frame less the reference, in grey levels. The bias of interpolation does
    not count: tile sums have it taken off.
    """
    spectrum = _measured(image, np.ones(image.shape, dtype=np.bool_), noise / np.sqrt(2))
    if spectrum is None:
        return Prefilter()
    budgets = [replace(error_budget(spectrum, s), bias=0.0) for s in SIGMAS]
    return _smallest_near_best(spectrum, budgets, size)


def _measured(image: AnyArray, roi: Mask, noise: float | None) -> Spectrum | None:
    """Spectrum of a pattern, with the noise of a frame where it is known."""
    spectrum = measure_spectrum(image, roi)
    if spectrum is None or noise is None:
        return spectrum
    return replace(spectrum, noise=noise**2)


def _smallest_near_best(spectrum: Spectrum, budgets: list[Budget], side: int) -> Prefilter:
    """Take one of `SIGMAS` by the error that is predicted of a square of `side` px."""
    errors = np.array([budget.of_subset(side**2) for budget in budgets])
    best = errors.min()
    near = errors <= _NEAR * best
    near[0] = errors[0] <= _GAIN * best + _MATTERS
    chosen = int(np.argmax(near))
    return Prefilter(
        SIGMAS[chosen],
        spectrum.noise**0.5,
        float(errors[0]),
        float(errors[chosen]),
        budgets[chosen].bias,
    )
