"""The whole plate of von Kármán on its mesh: the truth that the reduced plate is made from.

Of a plate with a shape w0 at rest it is Marguerre's: w is the deflection from there, and the slopes
that stretch the plate and that stress pulls at are those of w0 + w. Tension at rest stiffens it as
it does the linear plate.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import LinearOperator, cg

from fe.arrays import F64, I64, Mask
from fe.elements.band import Ordered, by_nodes, cholesky_by
from fe.elements.factor import Factor, factor
from fe.elements.mesh import Mesh
from fe.linear.energy import rigidities, stiffness
from fe.linear.energy_minimum import min_energy_fraction
from fe.linear.linear import Linear
from fe.linear.membrane import Membrane, Stretched, pull, stretch
from fe.plate.plate import Plate
from fe.reduced.tension import TensionPattern, tension_pattern

_ITERATIONS = 30
PREPARED = 3
"""Words of progress while a plate is prepared."""

_INNER = 200  # of the conjugate gradients in a step; some ten are usual


class Deflected(NamedTuple):
    """A state of the plate.

    Attributes
    ----------
    values : (2 nx + 2, 2 ny + 2, 1) float64, mm
        Unknowns of the deflection w along +z.
    plane : Stretched
        Stress and displacement in the plane.
    residual : float
        Norm of what is out of balance, over that of the load.
    iterations : int
    """

    values: F64
    plane: Stretched
    residual: float
    iterations: int


@dataclass(frozen=True, eq=False)
class Karman:
    """A plate ready for large loads on its whole mesh.

    Attributes
    ----------
    plate : Plate
    mesh : Mesh
    """

    plate: Plate
    mesh: Mesh

    @cached_property
    def linear(self) -> Linear:
        """The plate without stretching, and so without its shape."""
        return Linear(self.plate.flat, self.mesh)

    @cached_property
    def membrane(self) -> Membrane:
        """The plate in its plane."""
        return Membrane(self.plate, self.mesh)

    @cached_property
    def stiffness(self) -> sp.csc_array:
        """Stiffness of the free unknowns against bending and tension at rest, N/mm."""
        return stiffness(self.plate, self.mesh)

    @cached_property
    def rigidities(self) -> F64:
        """Bending rigidity of each element, (nx, ny) float64, N mm."""
        return rigidities(self.plate, self.mesh)

    def prepare(self, progress: Callable[[], object] = lambda: None) -> None:
        """Compute what all loads need, before threads ask for it at once.

        Parameters
        ----------
        progress : callable
            Called `PREPARED` times.
        """
        _ = self.linear.factor
        progress()
        _ = self.membrane.factor
        progress()
        _ = self.stiffness, self.pattern, self.order
        if self.plate.shape is not None:
            _ = self.membrane.rest
        progress()

    def bend(self, values: F64) -> F64:
        """Multiply deflections by the `stiffness` alone: tables (2 nx + 2, 2 ny + 2, C), N."""
        forces = np.zeros(values.shape)
        free = values[self.linear.free]
        product = self.stiffness @ free.reshape(-1, free.shape[2])
        forces[self.linear.free] = product.reshape(free.shape)
        return forces

    def tension(self, stress: F64) -> sp.csc_array:
        """Compute the stiffness of the free unknowns from stress (3, gx, gy) in the plane, N/mm."""
        return self.pattern.matrix(self.membrane.gauss.weights * stress)

    @cached_property
    def pattern(self) -> TensionPattern:
        """Where tension enters the stiffness."""
        return tension_pattern(self.membrane.gauss, self.mesh.lines, self.free)

    @cached_property
    def free(self) -> Mask:
        """Which unknowns (2 nx + 2, 2 ny + 2) no edge holds."""
        free = np.zeros(self.mesh.shape, dtype=bool)
        free[self.linear.free] = True
        return free

    @cached_property
    def order(self) -> I64:
        """Free unknowns (N,) in an order in which their stiffness has a narrow band."""
        order, free = by_nodes(self.mesh, 1), self.free.ravel()
        return (np.cumsum(free) - 1)[order[free[order]]]

    def factored(self, matrix: sp.csc_array) -> Ordered | Factor:
        """Factor a stiffness (N, N) of the free unknowns, which compression may make indefinite."""
        # In a band it takes a quarter of the time that a sparse one does.
        return cholesky_by(self.order, matrix) or factor(matrix)

    def solve(self, loads: F64, tolerance: float = 1e-9, start: F64 | None = None) -> Deflected:
        """Newton's method, from the linear solution cut back to least energy unless given a start.

        Each step is solved by conjugate gradients; the matrix without the stress that the step
        itself brings is their preconditioner.

        Parameters
        ----------
        loads : (2 nx + 2, 2 ny + 2, 1) float64, N
        tolerance : float
            Of the residual.
        start : (2 nx + 2, 2 ny + 2, 1) float64, mm, optional
        """
        values = self._first(loads) if start is None else start
        for iteration in range(_ITERATIONS):
            state, left = self._state(values, loads, iteration)
            if state.residual <= tolerance:
                return state
            values = values + self._step(state, left, min(0.1, state.residual))
        return self._state(values, loads, _ITERATIONS)[0]

    def _state(self, values: F64, loads: F64, iterations: int) -> tuple[Deflected, F64]:
        """State of a deflection, and the free forces that are out of balance, (N,)."""
        free, gauss = self.linear.free, self.membrane.gauss
        plane = self.membrane.relax(self.membrane.stretching(values))
        slopes = self.membrane.steeper(gauss.slopes(values))
        forces = self.bend(values) + gauss.loads(*pull(plane.stress, slopes))
        left = (loads - forces)[free].ravel()
        residual = float(np.linalg.norm(left) / np.linalg.norm(loads[free]))
        return Deflected(values, plane, residual, iterations), left

    def _first(self, loads: F64) -> F64:
        """Linear solution times the part of it that has the least energy."""
        values = self.linear.solve(loads)
        bowed = self.membrane.bowing(values)
        strains = np.concatenate([bowed, self.membrane.stretching(values) - bowed], axis=-1)
        works = self.membrane.work(self.membrane.relax(strains).stress, strains)
        (linear, mixed), (_, stretching) = works.tolist()
        return values * min_energy_fraction(
            float(np.vdot(values, loads)), linear, mixed, stretching
        )

    def _step(self, state: Deflected, left: F64, tolerance: float) -> F64:
        """Newton step from what is out of balance, to a part of it."""
        gauss, free, stress = self.membrane.gauss, self.linear.free, state.plane.stress
        slopes = self.membrane.steeper(gauss.slopes(state.values))
        ready = self.factored(self.stiffness + self.tension(stress[..., 0]))

        def table(vector: F64) -> F64:
            values = np.zeros(state.values.shape)
            values[free] = vector.reshape(values[free].shape)
            return values

        def tangent(vector: F64) -> F64:
            along = gauss.slopes(table(vector))
            more = self.membrane.relax(2.0 * stretch(slopes, along)).stress
            pulls = np.add(pull(stress, along), pull(more, slopes))
            return self.stiffness @ vector.ravel() + gauss.loads(*pulls)[free].ravel()

        def before(vector: F64) -> F64:
            return ready.solve(vector.reshape(-1, 1))[:, 0]

        matrix, preconditioner = (
            LinearOperator(self.stiffness.shape, matvec=product)  # pyright: ignore[reportCallIssue]
            for product in (tangent, before)
        )
        found, _ = cg(matrix, left, rtol=tolerance, maxiter=_INNER, M=preconditioner)
        return table(found)
