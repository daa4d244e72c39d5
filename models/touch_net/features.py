"""What the second net looks at: how proposals fitted."""

from __future__ import annotations

import numpy as np

from models.arrays import F64, Mask
from models.compiled import njit
from models.touch_net.network import COUNT_FEATURES, TOUCH_FEATURES
from models.touch_net.prior import MAX_TOUCHES
from models.touch_net.unrolled import Fits

FAR = 40.0  # of the logarithm of a density: less by more than this does not count


def count_features(fits: Fits, preliminary: F64, sharpness: float) -> F64:
    """Gather what says how many touches there are, (32,).

    Parameters
    ----------
    fits : Fits
    preliminary : (5,) float64
        Logarithms of how likely each number seemed from the maps.
    sharpness : float
        Of `Maps`.
    """
    return _count_features(
        fits.chi2,
        fits.evidence,
        fits.fall,
        fits.weakest,
        fits.apart,
        fits.fitted,
        preliminary,
        sharpness,
        fits.residual.shape[1],
    )


def touch_features(
    fits: Fits, number: int, certainty: float, strange: float, bounds: F64
) -> tuple[F64, F64]:
    """Gather what says how each of `number` touches scatters about its fit, and its unit.

    Parameters
    ----------
    fits : Fits
    number : int
    certainty : float
        Logarithm of how likely this number is.
    strange : float
        Largest part of the residual that one touch more would explain, in standard deviations.
    bounds : (2, 3) float64

    Returns
    -------
    features : (n, 27) float64
    factors : (n, 3, 3) float64
        Lower Cholesky factors of the covariance of each touch.
    """
    row, size = number - 1, 3 * number
    return _touch_features(
        fits.touches[row, :number],
        fits.spread[row, :size, :size],
        np.array(
            [
                fits.chi2[number],
                fits.fall[row],
                fits.weakest[row],
                fits.apart[row],
                certainty,
                strange,
            ]
        ),
        bounds,
        fits.residual.shape[1],
    )


@njit(cache=True, nogil=True)
def _unusual(chi2: float, freedom: int) -> float:
    """How far χ² lies above its mean, compressed."""
    return np.arcsinh((chi2 - freedom) / np.sqrt(2.0 * freedom))


@njit(cache=True, nogil=True)
def _count_features(
    chi2: F64,
    evidence: F64,
    fall: F64,
    weakest: F64,
    apart: F64,
    fitted: Mask,
    preliminary: F64,
    sharpness: float,
    freedom: int,
) -> F64:
    found, best = np.zeros(COUNT_FEATURES), evidence.max()
    for n in range(MAX_TOUCHES + 1):
        found[n] = max(evidence[n] - best, -FAR) / 10.0
        found[5 + n] = max(preliminary[n], -FAR) / 5.0
        if n == 0 or fitted[n - 1]:
            found[10 + n] = _unusual(chi2[n], freedom - 3 * n) / 4.0
    for n in range(MAX_TOUCHES):
        if fitted[n]:
            found[15 + n] = np.log1p(max(fall[n], 0.0)) / 4.0
            found[19 + n] = np.log(max(weakest[n], 1e-3)) / 8.0
            found[23 + n] = np.log(min(max(apart[n], 1e-3), 1e9)) / 8.0
            found[27 + n] = 1.0
    found[31] = sharpness
    return found


@njit(cache=True, nogil=True)
def _touch_features(
    touches: F64,
    spread: F64,
    whole: F64,
    bounds: F64,
    freedom: int,
) -> tuple[F64, F64]:
    """Fill the features; `whole` (6,) are those that all touches have in common."""
    chi2, fall, weakest, apart, certainty, strange = whole
    number, side = len(touches), bounds[1] - bounds[0]
    found, factors = np.zeros((number, TOUCH_FEATURES)), np.empty((number, 3, 3))
    for i in range(number):
        block = spread[3 * i : 3 * i + 3, 3 * i : 3 * i + 3]
        factors[i] = np.linalg.cholesky(block)
        sigma = np.sqrt(np.diag(block))
        row = found[i]
        row[number - 1] = 1.0
        nearest, force = 4.0, 1.0
        for j in range(number):
            if j != i:
                off = (touches[i, :2] - touches[j, :2]) / side[:2]
                distance = np.sqrt(off @ off)
                if distance < nearest:
                    nearest, force = distance, touches[j, 2] / touches[i, 2]
        for k in range(3):
            row[4 + k] = 2.0 * (touches[i, k] - bounds[0, k]) / side[k] - 1.0
            row[7 + k] = (np.log(sigma[k] / side[k]) + 5.0) / 2.0
            row[21 + 2 * k] = np.tanh(0.5 * (touches[i, k] - bounds[0, k]) / sigma[k])
            row[22 + 2 * k] = np.tanh(0.5 * (bounds[1, k] - touches[i, k]) / sigma[k])
        row[10] = block[0, 1] / (sigma[0] * sigma[1])
        row[11] = block[0, 2] / (sigma[0] * sigma[2])
        row[12] = block[1, 2] / (sigma[1] * sigma[2])
        row[13] = np.log(max(nearest, 1e-3))
        row[14] = np.log(max(force, 1e-3))
        row[15] = np.log(min(max(apart, 1e-3), 1e6)) / 8.0
        row[16] = _unusual(chi2, freedom - 3 * number)
        row[17] = np.log1p(max(fall, 0.0)) / 4.0
        row[18] = max(certainty, -10.0)
        row[19] = np.log(max(weakest, 1e-3)) / 8.0
        row[20] = np.arcsinh(strange / 3.0)
    return found, factors
