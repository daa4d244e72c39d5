"""What is known of touches before anything is measured."""

from __future__ import annotations

from numbers import Real
from typing import NamedTuple, cast

import numpy as np

from models.arrays import F64
from models.checks import check_finite, read_array, shown

SMALLEST = 1e-100  # mm or N: the precision of less has no number


class Prior(NamedTuple):
    """Normal distribution of x, y, F of every touch, independent of one another.

    Attributes
    ----------
    mean : (3,) float64, mm, mm, N
    precision : (3,) float64, 1/mm², 1/mm², 1/N²
        1/σ²; 0 for what is not known.
    """

    mean: F64
    precision: F64

    @property
    def known(self) -> int:
        """Number of quantities of a touch that something is known of."""
        return int(np.count_nonzero(self.precision))


FLAT = Prior(np.zeros(3), np.zeros(3))


def prior(
    place: tuple[float, float] | None = None,
    place_sigma: float = np.inf,
    force: float | None = None,
    force_sigma: float = np.inf,
) -> Prior:
    """State what is known of touches.

    Parameters
    ----------
    place : (x, y), mm, optional
        Where they are expected.
    place_sigma : float, mm
        Standard deviation along x and along y.
    force : float, N, optional
        How hard they are expected to press.
    force_sigma : float, N

    Raises
    ------
    ValueError
        If a standard deviation is not positive.
    """
    for name, sigma, unit in (("place", place_sigma, "mm"), ("force", force_sigma, "N")):
        _check_sigma(name, sigma, unit)
    x, y = _read_expected("place", (0.0, 0.0) if place is None else place, "x, y in mm", (2,))
    (force_mean,) = _read_expected("force", [0.0 if force is None else force], "N", (1,))
    at = 0.0 if place is None else float(np.float64(place_sigma) ** -2)
    hard = 0.0 if force is None else float(np.float64(force_sigma) ** -2)
    mean = np.array([x, y, force_mean])
    return Prior(mean, np.array([at, at, hard]))


def _check_sigma(name: str, sigma: object, unit: str) -> None:
    real = not isinstance(sigma, bool) and isinstance(sigma, Real)
    if not real or not float(cast(float, sigma)) > SMALLEST:
        raise ValueError(
            f"sigma of the {name} expected must be positive, got {shown(sigma)} {unit}; leave the "
            "prior out where nothing is known"
        )


def _read_expected(name: str, value: object, unit: str, shape: tuple[int, ...]) -> F64:
    expected = read_array(f"{name} expected", value, unit, shape)
    return check_finite(f"{name} expected", expected, "leave the prior out where nothing is known")
