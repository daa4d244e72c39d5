"""A shell between its supports under dead loads."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fe.arrays import F64
from fe.shell.support import Support
from fe.shell.system import System

TINY = float(np.finfo(np.float64).tiny)
"""Keeps parts of nothing from being nothing divided by nothing."""


class Problem(NamedTuple):
    """What to bring into equilibrium.

    Attributes
    ----------
    system : System
    support : Support
    load : (N,) float64, N
        Dead loads on all unknowns.
    reference_eigenvalue : float, N/mm³
        Smallest eigenvalue of the plate at rest, a measure for the mass to add.
    """

    system: System
    support: Support
    load: F64
    reference_eigenvalue: float

    def potential(self, values: F64) -> float:
        """Energy less the work of the loads, N mm."""
        return self.system.forces(values)[0] - float(self.load @ values)

    def residual(self, values: F64) -> float:
        """Norm of the forces left over, in parts of the norm of those that add up to it."""
        _, gradient, size = self.system.forces(values)
        left = np.linalg.norm(self.support.free.T @ (gradient - self.load))
        return float(left / max(np.linalg.norm(size), TINY))
