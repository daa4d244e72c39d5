"""Measurements of a plate as functions of the place of a touch."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fe.functional import derivative
from fe.linear import Linear
from fe.load import disc
from fe.mesh import Mesh
from fe.plate import Plate

# Measurements between two words of progress.
_BLOCK = 24


@dataclass(frozen=True, eq=False)
class Adjoint:
    """What C channels measure under a touch of 1 N, as functions of its place.

    A channel reads bᵀ w of the plate's unknowns w = K⁻¹ f. Since K is symmetric that is aᵀ f with
    K a = b, and for a touch f only evaluates a at its place: Maxwell's and Betti's reciprocity.

    Attributes
    ----------
    plate : Plate
    mesh : Mesh
    values : (2 nx + 2, 2 ny + 2, C) float64, read only
        Unknowns of the functions a, in the unit of the channel per N.
    """

    plate: Plate
    mesh: Mesh
    values: NDArray[np.float64]

    def __post_init__(self) -> None:
        channels = np.shape(self.values)[-1]
        object.__setattr__(self, "values", self.mesh.table(self.values, channels))

    def read(self, xy: ArrayLike, radius: float = 0.0) -> NDArray[np.float64]:
        """Channels for a touch of 1 N at each place (K, 2) mm: (K, C) float64.

        Raises
        ------
        ValueError
            A place, or a disc of `radius` mm about it, lies outside the plate.
        """
        return self._mean(xy, radius, 0, 0)

    def gradient(self, xy: ArrayLike, radius: float = 0.0) -> NDArray[np.float64]:
        """Exact derivative of `read` by the place: (K, C, 2) float64, per mm."""
        return np.stack([self._mean(xy, radius, 1, 0), self._mean(xy, radius, 0, 1)], axis=-1)

    def _mean(self, xy: ArrayLike, radius: float, p: int, q: int) -> NDArray[np.float64]:
        xy = self.plate.points(xy, "touch")
        points, weights = disc(self.plate, self.mesh, xy, radius)
        read = derivative(self.mesh, points, p, q).of(self.values)
        if len(weights) == 1:
            return read
        return np.einsum("q,kqc->kc", weights, read.reshape(len(xy), len(weights), -1))


def solve_adjoint(
    linear: Linear,
    channels: int,
    add_loads: Callable[[NDArray[np.float64], slice], None],
    progress: Callable[[int, int], object] | None = None,
) -> Adjoint:
    """Solve once for each channel.

    Parameters
    ----------
    linear : Linear
    channels : int
        Number C of them.
    add_loads : callable
        Adds the functionals b of the channels of a slice to a table (..., slice length) of zeros,
        for a force of 1 N into the plate.
    progress : callable, optional
        Called with the channels done and their number.
    """
    values = np.empty((*linear.mesh.shape, channels))
    for first in range(0, channels, _BLOCK):
        part = slice(first, min(first + _BLOCK, channels))
        loads = np.zeros((*linear.mesh.shape, part.stop - part.start))
        add_loads(loads, part)
        values[:, :, part] = linear.solve(loads)
        if progress is not None:
            progress(part.stop, channels)
    return Adjoint(linear.plate, linear.mesh, values)
