"""What a unit touch does to the plate, without and with tension: functions that move with it.

g is the linear solution of the plate, and carries what is singular under the touch. Under large
loads the plate around the touch is stretched, and the solution narrows to the length √(D/T) of its
tension T. That moves with the touch, so that no few fixed shapes hold it; the differences between
the solutions of a plate under even tension and of the plate without do.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fe.arrays import F64
from fe.elements.band import Ordered
from fe.elements.factor import Factor
from fe.elements.functional import derivative
from fe.reduced.karman import Karman

# Tensions times b²/D of the shorter side b: the solution narrows to b/8 and b/26. Between one
# deflection and ten thicknesses they cover what the middle of a held plate carries.
_TENSIONS = (66.0, 664.0)


@dataclass(frozen=True, eq=False)
class TouchShapes:
    """The A functions that move with a touch: g, and h_k of each tension.

    Attributes
    ----------
    karman : Karman
    tensions : (A - 1,) float64, N/mm
    factors : tuple of Ordered or Factor
        Of the stiffness under no tension and under each of them.
    """

    karman: Karman
    tensions: F64
    factors: tuple[Ordered | Factor, ...]

    def solve(self, loads: F64) -> F64:
        """Solutions g, h_1, ... under generalised loads.

        The operator is symmetric, so that the same solves read a functional of all of them for a
        touch at any place.

        Parameters
        ----------
        loads : (2 nx + 2, 2 ny + 2, C) float64, N

        Returns
        -------
        (2 nx + 2, 2 ny + 2, C, A) float64, mm
        """
        free = self.karman.linear.free
        right = loads[free]
        plain, *tense = (f.solve(right.reshape(-1, right.shape[2])) for f in self.factors)
        values = np.zeros((*loads.shape, len(self.factors)))
        solutions = np.stack([plain, *(solution - plain for solution in tense)], axis=-1)
        values[free] = solutions.reshape(*right.shape, -1)
        return values

    def at(self, xy: F64, weight: F64) -> F64:
        """Functions for 1 N into the plate, spread over points by weights.

        Parameters
        ----------
        xy : (Q, 2) float64, mm
        weight : (Q,) float64

        Returns
        -------
        (2 nx + 2, 2 ny + 2, A) float64, mm
        """
        loads = np.zeros((*self.karman.mesh.shape, 1))
        derivative(self.karman.mesh, xy).add_to(loads, -weight, np.zeros(len(xy), dtype=np.int64))
        return self.solve(loads)[:, :, 0]

    def each(self, xy: F64) -> F64:
        """Functions for 1 N into the plate at each place (P, 2) mm, as `at` gives them.

        Returns
        -------
        (2 nx + 2, 2 ny + 2, P, A) float64, mm
        """
        loads = np.zeros((*self.karman.mesh.shape, len(xy)))
        derivative(self.karman.mesh, xy).add_to(loads, -np.ones(len(xy)), np.arange(len(xy)))
        return self.solve(loads)


def touch_shapes(karman: Karman) -> TouchShapes:
    """Factor the plate under each tension."""
    even = np.zeros((3, *karman.membrane.stiffness.shape))
    even[:2] = 1.0
    rigidity = np.median(karman.rigidities)
    tensions = np.array(_TENSIONS) * rigidity / min(karman.plate.size) ** 2
    pull = karman.tension(even)
    factors = (karman.factored(karman.stiffness + tension * pull) for tension in (0.0, *tensions))
    return TouchShapes(karman, tensions, tuple(factors))
