"""Is this pattern good enough for this camera, and which subset and step does it ask for."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from dic.arrays import F64, I64, AnyArray
from dic.correlation.correlation import correlate
from dic.correlation.reference import prepare
from dic.images.fourier import FADE, faded, shifted
from dic.images.image import check_reference
from dic.images.quality import box_sums, check_subset, noise_floor
from dic.images.spline import noise_slope, prefilter, spline_gradient
from dic.numbers import read_array, read_real

_SPOTS = 3  # speckles across a subset, iDICs Good Practices Guide
_SIZES = range(11, 102, 2)  # px
_PERCENTILE = 95  # of the subsets, that shall reach the σ asked for


@dataclass(frozen=True)
class SettingsAdvice:
    """Subset and step for a pattern and a camera.

    Attributes
    ----------
    subset, step : int, px
    sigma : float, px
        Standard deviation of a displacement that 95 % of the subsets stay below.
    speckle : float, px
        Diameter of a speckle.
    """

    subset: int
    step: int
    sigma: float
    speckle: float


def mean_intensity_gradient(image: ArrayLike) -> float:
    """Mean of |∇f|, grey levels per px: MIG (Pan, Lu, Xie 2010, Opt. Lasers Eng. 48, 469)."""
    fx, fy = spline_gradient(prefilter(check_reference(image)))
    return float(np.mean(np.hypot(fx, fy)))


def speckle_size(image: ArrayLike) -> float:
    """Diameter of a speckle, px.

    The autocorrelation of round Gaussian spots of the diameter d (width at half height) is √2 d
    wide at half height. White noise, which stands at zero distance alone, is left out.

    Raises
    ------
    ValueError
        The image cannot be used, or has no spots: its autocorrelation never falls to one half.
    """
    grey = check_reference(image).astype(np.float64)
    spectrum = np.square(np.abs(np.fft.rfft2(faded(grey - grey.mean()))))
    peak = np.fft.irfft2(spectrum, s=grey.shape)
    reach = min(grey.shape) // 2
    falls = [_half_width(line) for line in (peak[0, :reach], peak[:reach, 0])]
    return float(np.sqrt(2) * np.mean(falls))


def _half_width(line: AnyArray) -> float:
    """Distance at which an autocorrelation falls to one half of its smooth part."""
    # A parabola through the distances 1 and 2, even in the distance, stands for the top.
    top = line[1] + (line[1] - line[2]) / 3
    below = np.flatnonzero(line[1:] < top / 2)
    if not len(below) or top <= 0:
        raise ValueError("reference has no spots whose size could be measured; check focus")
    first = int(below[0]) + 1
    before, after = top if first == 1 else line[first - 1], line[first]
    return first - 1 + (before - top / 2) / (before - after)


def sub_pixel_bias(
    image: ArrayLike, subset: int = 21, shifts: ArrayLike = (0.25, 0.5, 0.75)
) -> F64:
    """Measure what interpolation does to shifts of this very image.

    The image is shifted by its Fourier series, which is exact for what the camera resolves, and
    correlated with itself.

    Parameters
    ----------
    image : (H, W), grey levels
    shifts : (S,), px
        Along x and y at a time.

    Returns
    -------
    (S, 2) float64, px
        Mean error of u and v.
    """
    grey = check_reference(image).astype(np.float64)
    plain, subset = faded(grey - grey.mean()), check_subset(subset, grey.shape)
    ref = prepare(plain, subset, max(subset // 2, 1))
    apart = np.abs(ref.xy - (np.array(grey.shape[::-1]) - 1) / 2)
    room = np.array(grey.shape[::-1]) / 2 - FADE - subset
    inside = np.all(apart <= np.maximum(room, subset), axis=1)
    bias: list[tuple[float, float]] = []
    for shift in _read_shifts(shifts):
        field = correlate(
            ref, shifted(grey, (shift, shift)) - grey.mean(), guess=np.full_like(ref.xy, shift)
        )
        found = np.column_stack([field.u, field.v])[inside & field.valid]
        error = found.mean(axis=0) - shift if len(found) else np.full(2, np.nan)
        bias.append((float(error[0]), float(error[1])))
    return np.array(bias).reshape(-1, 2)


def _read_shifts(shifts: ArrayLike) -> F64:
    given = np.atleast_1d(read_array(shifts, "shifts", "px"))
    if given.ndim != 1 or not np.all(np.abs(given) <= 1):
        raise ValueError(
            f"shifts must be (S,) from -1 to 1 px, got shape {given.shape}; "
            "the bias repeats from px to px"
        )
    return given


def recommend_settings(image: ArrayLike, noise: float, sigma: float = 0.01) -> SettingsAdvice:
    """Choose the smallest subset that measures to `sigma`, and a step of a quarter of it.

    Parameters
    ----------
    image : (H, W), grey levels
        Of the pattern, by the camera of the test.
    noise : float, grey levels
        Standard deviation of its noise.
    sigma : float, px
        Standard deviation asked for, of a displacement at order 1.

    Raises
    ------
    ValueError
        The image cannot be used, or no subset up to 101 px reaches `sigma`.
    """
    grey = check_reference(image)
    noise = read_real(noise, "noise", "grey levels")
    sigma = read_real(sigma, "sigma", "px")
    speckle = speckle_size(grey)
    steep = np.stack([np.square(slope) for slope in spline_gradient(prefilter(grey))])
    for subset in _SIZES:
        if subset < _SPOTS * speckle or subset > min(grey.shape):
            continue
        reached = _floor(steep, subset, noise)
        if reached <= sigma:
            return SettingsAdvice(subset, max(subset // 4, 1), reached, speckle)
    raise ValueError(
        f"no subset up to {min(_SIZES[-1], *grey.shape)} px measures to {sigma:g} px at a noise of "
        f"{noise:g} grey levels; give the pattern more contrast or light, or choose the subset"
        " yourself and take the larger sigma that it has"
    )


def _floor(steep: AnyArray, subset: int, noise: float) -> float:
    """σ that 95 % of the subsets of an image stay below, px; noise in ∇f is no texture."""
    half = subset // 2
    height, width = (int(side) for side in steep.shape[1:])
    xs: I64 = np.arange(half, width - half, half)
    ys: I64 = np.arange(half, height - half, half)
    centres = np.stack(np.meshgrid(xs, ys), axis=-1).reshape(-1, 2)
    own = noise_slope() * noise**2 * subset**2
    sums = np.stack([box_sums(plane, centres, half) for plane in steep]) - own
    texture = np.maximum(sums.min(axis=0), 1e-12)
    return float(np.percentile(noise_floor(noise, texture), _PERCENTILE))
