"""What gauges read for a small further touch on a bent plate."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from fe.arrays import F64
from fe.elements.band import cholesky
from fe.elements.functional import derivative, recovered
from fe.linear.linear import Face, height
from fe.linear.mesh_error import left
from fe.shell.measure import ORDERS, strain_variation, surface, turning
from fe.shell.state import ShellState


@dataclass(frozen=True, eq=False)
class ShellInfluence:
    """Strain of M gauges for a small further touch of 1 N on a state, by its place.

    It has the methods of `fe.Influence`. The touch presses against the normal of the state.

    Attributes
    ----------
    state : ShellState
    gauges : (M, 2) float64, mm
    values : (2 nx + 2, 2 ny + 2, 9 M) float64, strain per N, read only
        Unknowns of the responses to forces along x, then y, then z; of each gauge exx, eyy, exy.
    face : str
        On which the gauges lie, "top", "middle" or "bottom".
    """

    state: ShellState
    gauges: F64
    values: F64
    face: Face = "top"

    def strain(self, xy: ArrayLike) -> F64:
        """Change of strain of every gauge for a touch of 1 N at each place (K, 2) mm.

        Returns
        -------
        (K, M, 3) float64, strain per N
            exx, eyy and the tensor component exy, of Green-Lagrange strain.

        Raises
        ------
        ValueError
            A place lies outside the plate.
        """
        xy = self.state.plate.points(xy, "touch")
        return self._along(self.state.normal(xy), xy, 0, 0)

    def gradient(self, xy: ArrayLike) -> F64:
        """Exact derivative of `strain` by the place of the touch.

        Returns
        -------
        (K, M, 3, 2) float64, strain per N per mm
            Last axis d/dx, d/dy.
        """
        xy = self.state.plate.points(xy, "touch")
        g = self.state.place(xy, derivative)
        normal, turned = surface(g).normal, turning(g)
        parts = [
            self._along(turned[:, i], xy, 0, 0) + self._along(normal, xy, p, q)
            for i, (p, q) in enumerate(ORDERS[:2])
        ]
        return np.stack(parts, axis=-1)

    def mesh_error(self, xy: ArrayLike) -> F64:
        """Estimate how far `strain` is off because of the mesh: (K, M, 3) float64, strain per N.

        Solves the state once more on two thirds of the elements, at the first call, and then every
        gauge there.

        Raises
        ------
        ValueError
            A place lies outside the plate, or as for `ShellState.mesh_error`.
        """
        return left(self.strain(xy), self._on_less.strain(xy))

    @cached_property
    def _on_less(self) -> ShellInfluence:
        return shell_influence(self.state.on_less, self.gauges, self.face)

    def _along(self, direction: F64, xy: F64, p: int, q: int) -> F64:
        """Response (K, M, 3) to forces against directions (K, 3), or its derivative."""
        read = derivative(self.state.mesh, xy, p, q).of(self.values)
        each = read.reshape(len(xy), 3, len(self.gauges), 3)
        return -np.einsum("kc,kcmi->kmi", direction, each)


def shell_influence(state: ShellState, gauges: ArrayLike, face: Face = "top") -> ShellInfluence:
    """Strain of gauges for a small further touch at any place on a bent plate.

    Solves the adjoint of each measurement on the tangent of the state.

    Parameters
    ----------
    state : ShellState
    gauges : (M, 2) array_like, mm
    face : str
        Of the gauges, "top", "middle" or "bottom"; touches press on the top.

    Returns
    -------
    ShellInfluence

    Raises
    ------
    ValueError
        A gauge lies outside the plate, or the state is not a stable equilibrium.
    """
    gauges = state.plate.points(gauges, "gauge")
    shell, mesh = state.shell, state.mesh
    free = shell.support(state.base).free
    factor = None
    if state.stability.tangent_known:
        factor = cholesky(free.T @ shell.system.tangent(state.values.ravel()) @ free)
    if factor is None:
        raise ValueError(
            "influence needs a stable equilibrium, got a state of residual "
            f"{state.stability.residual:.2g} and smallest eigenvalue "
            f"{state.stability.eigenvalue:.2g} of that at rest; use a smaller load or base"
        )
    g = state.place(gauges, recovered)
    variation = strain_variation(g, height(state.plate, gauges, face))
    count = 3 * len(gauges)
    loads = np.zeros((*mesh.shape, 3, count))
    for c in range(3):
        part = np.zeros((*mesh.shape, count))
        for d, (p, q) in enumerate(ORDERS):
            reading = recovered(mesh, gauges, p, q)
            for i in range(3):
                columns = 3 * np.arange(len(gauges)) + i
                reading.add_to(part, variation[:, i, d, c], columns)
        loads[:, :, c] = part
    solved = free @ factor.solve(free.T @ loads.reshape(-1, count))
    values = solved.reshape(*mesh.shape, 3 * count)
    return ShellInfluence(state, gauges, mesh.table(values, 3 * count), face)
