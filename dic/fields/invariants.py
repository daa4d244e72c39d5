"""What a strain is in any axes: principal strains and their angle, largest shear, von Mises."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dic.arrays import F64
from dic.fields.strain_field import StrainField
from dic.numbers import check_type


@dataclass(frozen=True)
class StrainInvariants:
    """Invariants of an in-plane strain at N points, NaN where it is.

    Attributes
    ----------
    first, second : (N,) float64, strain
        Principal strains, the larger one first.
    angle : (N,) float64, rad
        From x to the axis of the first, -π/2…π/2, positive from x towards y.
    max_shear : (N,) float64, strain
        Largest engineering shear in the plane, first - second.
    von_mises : (N,) float64, strain
        Equivalent strain √(first² + first second + second²) · 2/√3 at constant volume.
    sigma : (N, 5) float64
        One standard deviation of each, in the order above.
    """

    first: F64
    second: F64
    angle: F64
    max_shear: F64
    von_mises: F64
    sigma: F64


def strain_invariants(eps: StrainField) -> StrainInvariants:
    """Take the invariants of a strain, with σ to first order.

    Parameters
    ----------
    eps : StrainField

    Returns
    -------
    StrainInvariants

    Notes
    -----
    exx, eyy and exy are taken for independent. Where both principal strains are equal within their
    σ the angle says nothing: its σ is bounded by that of an angle that may be anything, π/√12.
    """
    check_type(eps, StrainField, "eps", "dic.strain")
    middle, half = (eps.exx + eps.eyy) / 2, (eps.exx - eps.eyy) / 2
    radius = np.hypot(half, eps.exy)
    first, second = middle + radius, middle - radius
    von_mises = 2 / np.sqrt(3) * np.sqrt(np.maximum(first**2 + first * second + second**2, 0))
    size = np.maximum(radius, 1e-30)
    cosine, sine = half / size, eps.exy / size  # of twice the angle
    by_first = np.stack([(1 + cosine) / 2, (1 - cosine) / 2, sine], axis=-1)
    by_second = np.stack([(1 - cosine) / 2, (1 + cosine) / 2, -sine], axis=-1)
    by_angle = np.stack([-sine, sine, 2 * cosine], axis=-1) / (4 * size)[:, None]
    scale = 2 / (3 * np.maximum(von_mises, 1e-30))
    by_mises = (scale * (2 * first + second))[:, None] * by_first
    by_mises = by_mises + (scale * (2 * second + first))[:, None] * by_second
    slopes = np.stack([by_first, by_second, by_angle, by_first - by_second, by_mises], axis=1)
    sigma = np.sqrt(np.sum(np.square(slopes * eps.sigma[:, None, :]), axis=2))
    free = np.pi / np.sqrt(12)
    sigma[:, 2] = np.where(radius > 0, np.minimum(sigma[:, 2], free), free)
    sigma[np.isnan(radius)] = np.nan
    angle = np.arctan2(eps.exy, half) / 2
    return StrainInvariants(first, second, angle, first - second, von_mises, sigma)
