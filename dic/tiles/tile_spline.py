"""Interpolating B-spline of degree 7 through an image, on its own pixels as knots."""

from __future__ import annotations

import numpy as np
from scipy import fft, ndimage

from dic.arrays import F64
from dic.tiles.tile_kernels import BEFORE, DEGREE, spline_weights


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


def _at_a_knot() -> tuple[F64, F64]:
    """Weigh the knots -3 … 3 for value and slope at a knot, (7,) each."""
    value, slope = np.empty(DEGREE + 1), np.empty(DEGREE + 1)
    spline_weights(0.0, value, slope)
    return value[:DEGREE], slope[:DEGREE]
