"""The energy of a plate with its edges, and its equilibrium under dead loads."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.sparse as sp

from fe.arrays import F64, I32, I64
from fe.elements.hermite import hermite_gram
from fe.elements.mesh import Mesh
from fe.plate.plate import Plate
from fe.shell.elements import pattern, rule
from fe.shell.kernel import Rule, forces, stresses, tangent
from fe.shell.support import springs


@dataclass(frozen=True, eq=False)
class System:
    """Energy of a plate and its elastic edges as a function of all unknowns, from rest.

    At rest the tension is in balance with what holds the plate; what it does further is its work
    on the strain less that of those forces.

    Attributes
    ----------
    plate : Plate
    mesh : Mesh
    """

    plate: Plate
    mesh: Mesh

    @cached_property
    def rule(self) -> Rule:
        """Elements with their quadrature."""
        return rule(self.plate, self.mesh)

    @cached_property
    def pattern(self) -> tuple[I64, I32]:
        """Row starts and columns of the tangent."""
        return pattern(self.mesh)

    @cached_property
    def springs(self) -> sp.csr_array:
        """Stiffness of the elastic edges, (N, N), N/mm."""
        return springs(self.plate, self.mesh)

    @cached_property
    def mass(self) -> sp.csr_array:
        """Mass of a plate of 1 per area: ∫ U·U dA = Uᵀ mass U, (N, N), mm²."""
        along_x, along_y = (hermite_gram(line, 0, 0) for line in self.mesh.lines)
        return sp.csr_array(sp.kron(sp.kron(along_x, along_y), sp.eye_array(3)))

    @cached_property
    def at_rest(self) -> F64:
        """Forces (N,) N of the tension on the plate at rest, which hold it there."""
        return forces(np.zeros((*self.mesh.shape, 3)), self.rule)[1].ravel()

    def forces(self, values: F64) -> tuple[float, F64, F64]:
        """Energy in N mm, its gradient (N,) in N, and the size of what adds up to it (N,) in N."""
        energy, gradient, size = forces(self.table(values), self.rule)
        pull = self.springs @ values
        energy += 0.5 * float(values @ pull) - float(values @ self.at_rest)
        return energy, gradient.ravel() + pull - self.at_rest, size.ravel() + np.abs(pull)

    def stresses(self, values: F64, step: F64) -> F64:
        """Membrane forces at the points, linear in a step from the values."""
        return stresses(self.table(values), self.table(step), self.rule)

    def tangent(self, values: F64, stress: F64 | None = None) -> sp.csr_array:
        """Second derivative (N, N) of the energy, N/mm, with the membrane forces of the values.

        With other forces it is the tangent of `fe.shell.newton`.
        """
        starts, columns = self.pattern
        data = np.zeros(len(columns))
        if stress is None:
            stress = self.stresses(values, np.zeros_like(values))
        tangent(self.table(values), stress, self.rule, starts, data)
        shape = (len(values), len(values))
        return sp.csr_array((data, columns, starts), shape=shape) + self.springs

    def table(self, values: F64) -> F64:
        """All unknowns (N,) as their table (2 nx + 2, 2 ny + 2, 3)."""
        return values.reshape(*self.mesh.shape, 3)
