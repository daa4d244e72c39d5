"""Spectrum of a pattern, and what noise, interpolation and aliasing make of a displacement.

The error of a displacement is Σ ∇f e over Σ ∇f², e being whatever the frame differs by from the
reference that moved. Of a stationary pattern all of it follows from power spectra: of the pattern,
of the noise, and of what the spline and the pixels do to a wave.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from dic.arrays import C128, F64, AnyArray, Mask
from dic.images.spline import spline_response

_SIDE = 64  # px of a tile, the smallest that tells a spot of 20 px from a slope
_SMALLEST = 16  # px of a tile below which a spectrum says nothing
_TILES = 16
_LATTICE = 8  # tiles are chosen from so many along each side
_PHASES = 8  # sub-pixel places at which interpolation is looked at
# Bands of |ω|, of Nyquist's frequency. A pattern falls to at most _FALL from the middle one to the
# corner, and to _AGAIN times what it fell to from the low one to the middle.
_LOW, _MIDDLE, _CORNER = (0.45, 0.6), (0.75, 0.9), (1.2, 2.0)
_FALL, _AGAIN = 0.3, 2.5
_ROUNDING = 1 / 12  # variance of integer grey levels
# Gaussian spots of 0.6 to 0.9 px (σ) and discs of 3 to 10 px through a lens fall faster beyond
# Nyquist's frequency than in equal ratios: so much of the power is there that this would give.
_FASTER = 0.4
_FAINT = 1e-7  # of the variance of an image: below it there is no noise to be measured


@dataclass(frozen=True)
class Spectrum:
    """Power of a pattern and of its noise.

    Attributes
    ----------
    pattern : (T, T/2 + 1) float64, (grey levels)²
        Density on the frequencies of `numpy.fft.rfft2`; its mean over all is the variance.
    noise : float, (grey levels)²
        Variance of white noise.
    """

    pattern: F64
    noise: float


@dataclass(frozen=True)
class Budget:
    """Error of the displacement of one pixel's worth of pattern, by its cause, px.

    Divided by the root of the number of pixels they are those of a subset; but for the bias, which
    no number of pixels lessens.
    """

    noise: float
    random: float
    bias: float

    def of_subset(self, pixels: float) -> float:
        """Root mean square error of a subset of so many pixels, px."""
        return float(np.sqrt((self.noise**2 + self.random**2) / pixels + self.bias**2))


def measure_spectrum(image: AnyArray, weight: Mask, noise: float | None = None) -> Spectrum | None:
    """Estimate the power spectrum of the pattern inside a ROI and the noise of the image.

    White noise, where its standard deviation is not given, is what the spectrum does not fall below
    at its corner: a pattern, however sharp, falls to a third from 0.8 to 1.3 of Nyquist's frequency
    (printed discs of 1.5 to 6 px), and a soft one, which falls fast before, goes on as fast: of 16
    prints and spots the corner holds at most 2.2 times what the same fall again would leave.

    Returns
    -------
    Spectrum or None
        None where the image is too small.

    References
    ----------
    Welch 1967, IEEE Trans. Audio Electroacoust. 15, 70.
    """
    side = min(_SIDE, *image.shape) // 2 * 2
    if side < _SMALLEST:
        return None
    tiles = _tiles(image, weight, side)
    fade = np.hanning(side + 2)[1:-1]
    window = np.outer(fade, fade).astype(np.float32)
    waves = np.fft.rfft2((tiles - tiles.mean(axis=(1, 2), keepdims=True)) * window)
    power = np.square(np.abs(waves)).mean(axis=0, dtype=np.float64) / np.square(window).sum()
    whole = np.issubdtype(image.dtype, np.integer)
    variance = _noise(power, side, whole) if noise is None else _floor(power, whole) + noise**2
    return Spectrum(np.maximum(power - variance, 1e-3 * variance), variance)


def _tiles(image: AnyArray, weight: Mask, side: int) -> AnyArray:
    """Cut tiles (T, side, side) that lie evenly over the image, those inside the ROI first."""
    height, width = (int(n) - side for n in image.shape)
    steps = np.linspace(0, 1, _LATTICE)
    places = sorted({(round(height * a), round(width * b)) for a in steps for b in steps})
    if not weight.all():
        inside = [float(weight[y : y + side : 4, x : x + side : 4].mean()) for y, x in places]
        best = max(inside)
        places = [p for p, part in zip(places, inside, strict=True) if part >= 0.9 * best]
    chosen = np.unique(np.linspace(0, len(places) - 1, _TILES).astype(int))
    corners = [places[int(n)] for n in chosen]
    cut = [image[y : y + side, x : x + side] for y, x in corners]
    return np.stack(cut).astype(np.float32)


def _noise(power: F64, side: int, whole: bool) -> float:
    low, middle, corner = (float(power[band].mean()) for band in _bands(side))
    fallen = max(middle - corner, 0.0) / max(low - corner, 1e-30)
    fall = min(_FALL, _AGAIN * fallen)
    return max((corner - fall * middle) / (1 - fall), _floor(power, whole))


def _floor(power: F64, whole: bool) -> float:
    """Give the least variance of noise that an image has, of integers or not."""
    return _FAINT * float(power.mean()) + (_ROUNDING if whole else 0.0)


@cache
def _waves(side: int) -> tuple[F64, F64, F64]:
    """ωx (1, T/2 + 1) and ωy (T, 1), rad per px, and how often each stands in the whole plane."""
    wx, wy = 2 * np.pi * np.fft.rfftfreq(side)[None], 2 * np.pi * np.fft.fftfreq(side)[:, None]
    count = np.full((side, side // 2 + 1), 2.0)
    count[:, [0, -1]] = 1.0
    return wx.astype(np.float64), wy.astype(np.float64), count / side**2


@cache
def _bands(side: int) -> tuple[Mask, Mask, Mask]:
    wx, wy, _ = _waves(side)
    away = np.hypot(wx, wy) / np.pi
    low, middle, corner = ((away > a) & (away < b) for a, b in (_LOW, _MIDDLE, _CORNER))
    return low, middle, corner


@cache
def _interpolated(side: int) -> tuple[tuple[F64, C128], tuple[F64, C128]]:
    """ω along x and along y, and what the spline makes of such waves over the truth, (8, ·, ·)."""
    places = (np.arange(_PHASES) + 0.5) / _PHASES
    wx, wy, _ = _waves(side)
    along, down = (
        np.stack([spline_response(wave, t) * np.exp(-1j * wave * t) for t in places])
        for wave in (wx, wy)
    )
    return (wx, along), (wy, down)


@cache
def _interpolation_error(side: int) -> F64:
    """Mean square error of an interpolated wave over its power, (T, T/2 + 1)."""
    (_, along), (_, down) = _interpolated(side)
    of_x, of_y = (np.mean(np.square(np.abs(part - 1)), axis=0) for part in (along, down))
    return of_x + of_y


@cache
def kept(side: int, sigma: float) -> F64:
    """Power that a Gaussian of `sigma` px keeps of each wave, (T, T/2 + 1)."""
    wx, wy, _ = _waves(side)
    return np.exp(-(wx**2 + wy**2) * sigma**2)


def error_budget(spectrum: Spectrum, sigma: float) -> Budget:
    """Predict the error of a displacement between images smoothed by a Gaussian of `sigma` px.

    Notes
    -----
    With S the pattern, N the noise and H² what the Gaussian keeps, ∫ over all waves,

        noise²  = [2 N ∫ωx² S H⁴ + 2 N² ∫ωx² H⁴]/(∫ωx² S H²)²,
        random² = ∫ωx² S (S E² + 2 S_a) H⁴/(∫ωx² S H²)²,
        bias(t) = ∫ωx S H² Im R(t)/∫ωx² S H²,

    R(t) being what the spline makes of a wave at the fraction t of a px, E² its mean square error,
    and S_a the power that lies beyond Nyquist's frequency and is folded back: the spectrum goes on
    there as it falls before, in equal ratios.
    """
    side = spectrum.pattern.shape[0]
    pattern, passed, (_, _, count) = spectrum.pattern, kept(side, sigma), _waves(side)
    own = 2 * spectrum.noise * (pattern + spectrum.noise)
    wrong = pattern * (pattern * _interpolation_error(side) + 2 * _folded(pattern))
    squares = np.zeros(3)  # of noise, random error and bias, mean of u and v
    for wave, ratio in _interpolated(side):
        slope = wave * passed * count
        steep = float(np.sum(wave * slope * pattern))
        shift = np.sum(slope * pattern * ratio.imag, axis=(1, 2)) / steep
        noise, random = (np.sum(wave * slope * passed * part) / steep**2 for part in (own, wrong))
        squares += noise / 2, random / 2, np.mean(shift**2) / 2
    noise, random, bias = np.sqrt(squares)
    return Budget(float(noise), float(random), float(bias))


def aliased_fraction(spectrum: Spectrum) -> float:
    """Power that interpolation and aliasing leave of a moved image, over that of the pattern.

    ∫(2 S E² + 4 S_a)/∫S, as in `error_budget`, at half a pixel: twice the mean over all motions.
    """
    pattern = spectrum.pattern
    side = pattern.shape[0]
    _, _, count = _waves(side)
    wrong = pattern * _interpolation_error(side) + 2 * _folded(pattern)
    return float(2 * np.sum(count * wrong) / np.sum(count * pattern))


def aliasing_bias(spectrum: Spectrum, sigma: float = 0.0) -> F64:
    """By how much aliasing makes a motion of a quarter pixel along x and y look too small, (2,) px.

    Waves beyond Nyquist's frequency are folded back, and seem to move the other way:
    ∫ωx S_a H²/∫ωx² S H², as in `error_budget` with a Gaussian of `sigma` px.
    """
    side = spectrum.pattern.shape[0]
    wx, wy, count = _waves(side)
    count = count * kept(side, sigma)
    folded = _FASTER * _folded(spectrum.pattern)
    bias = [
        np.sum(np.abs(wave) * count * folded) / np.sum(wave**2 * count * spectrum.pattern)
        for wave in (wx, wy)
    ]
    return np.array(bias, dtype=np.float64)


def _folded(pattern: F64) -> F64:
    """Power that aliasing folds onto each wave, half of it at Nyquist's frequency."""
    middle = pattern.shape[0] // 2
    along, down = np.square(pattern[:, -1:]), np.square(pattern[middle : middle + 1])
    half = pattern / 2
    return np.minimum(along / (4 * pattern), half) + np.minimum(down / (4 * pattern), half)
