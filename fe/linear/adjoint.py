"""Measurements of a plate as functions of the place of a touch."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from fe.arrays import F64
from fe.elements.functional import Functional, derivative
from fe.elements.hermite import hermite
from fe.elements.mesh import Mesh
from fe.linear.linear import Linear
from fe.linear.load import disc
from fe.plate.plate import Plate

# Measurements between two words of progress, all three of some points.
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
    values: F64

    def __post_init__(self) -> None:
        channels = np.shape(self.values)[-1]
        object.__setattr__(self, "values", self.mesh.table(self.values, channels))

    def read(self, xy: ArrayLike, radius: float = 0.0) -> F64:
        """Channels for a touch of 1 N at each place (K, 2) mm: (K, C) float64.

        Raises
        ------
        ValueError
            A place, or a disc of `radius` mm about it, lies outside the plate.
        """
        return self._mean(xy, radius, 0, 0)

    def gradient(self, xy: ArrayLike, radius: float = 0.0) -> F64:
        """Exact derivative of `read` by the place: (K, C, 2) float64, per mm."""
        return np.stack([self._mean(xy, radius, 1, 0), self._mean(xy, radius, 0, 1)], axis=-1)

    def read_and_gradient(self, xy: F64, radius: float = 0.0) -> tuple[F64, F64]:
        """Both at once, (K, C) and (K, C, 2); the caller has made sure that touches are inside."""
        points, weights = disc(self.plate, self.mesh, xy, radius)
        along_x, along_y = self.mesh.lines
        x, slope_x = (hermite(points[:, 0], along_x, order) for order in (0, 1))
        y, slope_y = (hermite(points[:, 1], along_y, order) for order in (0, 1))
        ways = Functional(x, y), Functional(slope_x, y), Functional(x, slope_y)
        value, by_x, by_y = (self._over(weights, way, len(xy)) for way in ways)
        return value, np.stack([by_x, by_y], axis=-1)

    def _mean(self, xy: ArrayLike, radius: float, p: int, q: int) -> F64:
        xy = self.plate.points(xy, "touch")
        points, weights = disc(self.plate, self.mesh, xy, radius)
        return self._over(weights, derivative(self.mesh, points, p, q), len(xy))

    def _over(self, weights: F64, way: Functional, places: int) -> F64:
        """Mean of functionals over the points of a disc at each place, (K, C)."""
        read = way.of(self.values)
        if len(weights) == 1:
            return read
        return np.einsum("q,kqc->kc", weights, read.reshape(places, len(weights), -1))


def solve_adjoint(
    linear: Linear,
    at: F64,
    orders: Sequence[tuple[int, int]],
    read: Callable[[Mesh, F64, int, int], Functional],
    scale: F64,
    progress: Callable[[int, int], object] | None = None,
) -> Adjoint:
    """Solve once for each of three derivatives of w at each point.

    Parameters
    ----------
    linear : Linear
    at : (M, 2) float64, mm
        The points.
    orders : three of (int, int)
        Orders p by x and q by y of the derivatives.
    read : callable
        Gives the functionals that take a derivative: `derivative`, or another with its arguments.
    scale : (3 M,) float64
        Factor of each channel, for a force of 1 N into the plate.
    progress : callable, optional
        Called with the channels done and their number.

    Returns
    -------
    Adjoint
        Of 3 M channels: all three of the first point, then of the second, ...
    """
    values = np.empty((*linear.mesh.shape, 3 * len(at)))
    for first in range(0, len(scale), _BLOCK):
        last = min(first + _BLOCK, len(scale))
        loads = np.zeros((*linear.mesh.shape, last - first))
        for component, (p, q) in enumerate(orders):
            channels = np.arange(first + component, last, 3)
            functional = read(linear.mesh, at[channels // 3], p, q)
            functional.add_to(loads, scale[channels], channels - first)
        values[:, :, first:last] = linear.solve(loads)
        if progress is not None:
            progress(last, len(scale))
    return Adjoint(linear.plate, linear.mesh, values)
