"""Data sets of simulated touches: the strains that the gauges read and the places pressed."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from models.data.gauge_layout import even_steps


class StrainInfluence(Protocol):
    """What a data set needs of the plate; `fe.Influence` is one."""

    def strain(self, xy: np.ndarray) -> np.ndarray:
        """Return (K, M, 3) strain per newton at M gauges for touches at xy (K, 2) mm."""
        ...


@dataclass(frozen=True)
class Dataset:
    """N samples: what the gauges read, and what is to be estimated from it.

    Attributes
    ----------
    strain
        (N, 3 M) float, strain at M gauges: exx, eyy, exy of the first, then of the second, ...
    targets
        (N, D) float: x, y of each touch, mm, then whatever else is asked for, as magnitudes.
    """

    strain: np.ndarray
    targets: np.ndarray

    def __len__(self) -> int:
        return len(self.targets)


def simulate_dataset(influence: StrainInfluence, xy: np.ndarray) -> Dataset:
    """Return the data set of unit touches at `xy` (N, 2) mm, section 2.1 of the paper."""
    xy = np.asarray(xy, dtype=float)
    return Dataset(influence.strain(xy).reshape(len(xy), -1), xy)


def flatten_samples(strain: np.ndarray, touches: np.ndarray, unit: float | None = None) -> Dataset:
    """Return samples of several touches as a net learns them, section 2.3 of the paper.

    Parameters
    ----------
    strain
        (N, M, 3) float, strain at M gauges.
    touches
        (N, k, 3) float64, x, y in mm and force in N of k touches.
    unit
        Force of magnitude 1, N, where magnitudes are asked for; the forces are known otherwise.

    Returns
    -------
    Targets (N, 2 k): x1, y1, x2, ..., or (N, 3 k): x1, y1, x2, ..., m1, m2, ...
    """
    targets = touches[..., :2].reshape(len(touches), -1)
    if unit is not None:
        targets = np.column_stack([targets, touches[..., 2] / unit])
    return Dataset(strain.reshape(len(strain), -1), targets)


def grid_places(size: tuple[float, float], spacing: float, margin: float) -> np.ndarray:
    """Return the training places: a grid that keeps `margin` from the edges.

    Parameters
    ----------
    size
        (a, b) of the plate, mm.
    spacing, margin
        Distance of neighbours and of the outermost places from the edges, mm.

    Returns
    -------
    (N, 2) float64, mm, x fastest; 17 x 17 on the plate of the paper.

    Raises
    ------
    ValueError
        When no whole number of steps fits.
    """
    a, b = size
    return _product(even_steps(a, spacing, margin), even_steps(b, spacing, margin))


def midpoint_places(
    size: tuple[float, float], spacing: float, margin: float, count: int
) -> np.ndarray:
    """Return the validation places: `count` a side between those of `grid_places`.

    They run evenly from the first mid-point of the training grid to the last. The paper has 196
    and says no more; 14 a side on its plate stand at 12.5, 18.27, ... 87.5, none of them a place
    of the training grid.

    Parameters
    ----------
    size, spacing, margin
        As given to `grid_places`, mm.
    count
        Places a side, at least 2.

    Returns
    -------
    (count**2, 2) float64, mm, x fastest.

    Raises
    ------
    ValueError
        When `count` is below 2.
    """
    if count < 2:
        raise ValueError(f"validation places a side must be at least 2, got {count}; use 14")
    first = margin + spacing / 2.0
    return _product(*(np.linspace(first, length - first, count) for length in size))


def random_places(
    size: tuple[float, float], margin: float, count: int, rng: np.random.Generator
) -> np.ndarray:
    """Return the test places: `count` drawn evenly from the rectangle of the training places.

    Returns
    -------
    (count, 2) float64, mm.

    Raises
    ------
    ValueError
        When `count` is below 1.
    """
    if count < 1:
        raise ValueError(f"number of test places must be at least 1, got {count}; use 3000")
    return rng.uniform(margin, np.asarray(size) - margin, (count, 2))


def _product(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """All pairs (x, y), x fastest."""
    return np.column_stack([np.tile(x, len(y)), np.repeat(y, len(x))])
