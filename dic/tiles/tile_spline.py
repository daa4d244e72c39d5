"""Interpolating B-spline of degree 7 through an image, on its own pixels as knots."""

from __future__ import annotations

from functools import cache

import numpy as np
from scipy import fft, ndimage

from dic.arrays import C128, F64
from dic.images.prefilter import gaussian_taps
from dic.tiles.tile_kernels import BEFORE, DEGREE, spline_weights

_WAVES = 4096  # at which the response of the spline is looked at
_QUARTER = 0.75  # px to the right of a pixel lies what has moved on from there by a quarter


def tile_spline(f: F64) -> F64:
    """Coefficients of the B-spline through f (H, W), mirrored at the borders.

    Under the cosine transform its values at the knots are a product, which is divided out.
    """
    value, _ = _at_a_knot()

    def response(count: int) -> F64:
        waves = np.pi * np.arange(count) / (count - 1)
        return sum((w * np.cos((k - BEFORE) * waves) for k, w in enumerate(value)), np.zeros(()))

    down, across = (response(count) for count in f.shape)
    spectrum = np.asarray(fft.dctn(f, type=1)) / np.outer(down, across)
    return np.asarray(fft.idctn(spectrum, type=1))


def slopes_at_knots(coefficients: F64) -> F64:
    """∂/∂x and ∂/∂y of the B-spline at its knots, (2, H, W)."""
    value, slope = _at_a_knot()

    def along(array: F64, weights: F64, axis: int) -> F64:
        return np.asarray(ndimage.correlate1d(array, weights, axis=axis, mode="mirror"))

    return np.stack(
        [
            along(along(coefficients, slope, 1), value, 0),
            along(along(coefficients, value, 1), slope, 0),
        ]
    )


@cache
def noise_bias(sigma: float) -> tuple[float, float]:
    """Compute what white noise of variance 1 in a reference adds to Σφe of a pixel.

    The reference is moved by a quarter pixel along both axes; φ is its gradient behind a Gaussian
    of `sigma` px that is passed twice. Between the pixels an interpolated image is less noisy than
    on them, so that least squares move it there.

    Returns
    -------
    own : float
        Where the frame has noise of its own.
    moved : float
        Where the frame is the reference, moved by its Fourier series.

    References
    ----------
    Wang, Sutton, Bruck, Schreier 2009, Strain 45, 160.
    """
    waves = np.linspace(-np.pi, np.pi, _WAVES, endpoint=False)
    taps, exact = gaussian_taps(sigma), np.exp(1j * _QUARTER * waves)
    lags = np.arange(len(taps)) - len(taps) // 2
    kept = np.square(np.cos(np.outer(waves, lags)) @ taps)
    turn = np.exp(1j * np.outer(waves, np.arange(DEGREE + 1) - BEFORE))
    value, slope = _at(_QUARTER)
    knot, _ = _at_a_knot()
    through = (turn[:, :DEGREE] @ knot).real
    f, rise = turn @ value / through, turn @ slope / through

    def mean(a: F64 | C128, b: F64 | C128) -> float:
        return float(np.mean(kept * (a * b.conj()).real))

    own = -mean(rise, f) * mean(f, f)
    return own, own + mean(rise, exact) * mean(f, exact)


def _at_a_knot() -> tuple[F64, F64]:
    """Weigh the knots -3 … 3 for value and slope at a knot, (7,) each."""
    value, slope = _at(0.0)
    return value[:DEGREE], slope[:DEGREE]


def _at(place: float) -> tuple[F64, F64]:
    """Weigh the knots -3 … 4 for value and slope at a fraction of a pixel, (8,) each."""
    value, slope = np.empty(DEGREE + 1), np.empty(DEGREE + 1)
    spline_weights(place, value, slope)
    return value, slope
