"""What is known of touches before anything is measured."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray


class Prior(NamedTuple):
    """Normal distribution of x, y, F of every touch, independent of one another.

    Attributes
    ----------
    mean : (3,) float64, mm, mm, N
    precision : (3,) float64, 1/mm², 1/mm², 1/N²
        1/σ²; 0 for what is not known.
    """

    mean: NDArray[np.float64]
    precision: NDArray[np.float64]

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
        if not sigma > 0:
            raise ValueError(
                f"sigma of the {name} expected must be positive, got {sigma:g} {unit}; leave the "
                "prior out where nothing is known"
            )
    x, y = (0.0, 0.0) if place is None else place
    at = 0.0 if place is None else 1.0 / place_sigma**2
    hard = 0.0 if force is None else 1.0 / force_sigma**2
    mean = np.array([x, y, 0.0 if force is None else force], dtype=np.float64)
    return Prior(mean, np.array([at, at, hard]))
