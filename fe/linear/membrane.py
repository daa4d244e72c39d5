"""The plate in its own plane: what stretches when it deflects, and the stress that follows.

With deflection w from its shape w0 at rest the middle surface has the strain
ε(u) + ½ ∇w ∇w + ½ (∇w0 ∇w + ∇w ∇w0) of von Kármán and Marguerre. For a given w the displacement u
in the plane follows from a linear problem, solved here on the same elements. Strain, stress and
displacement are those that come on top of the state at rest.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import isinf
from typing import NamedTuple, TypeVar

import numpy as np
import scipy.sparse as sp

from fe.arrays import F32, F64, I64, Mask
from fe.elements.band import Ordered, by_nodes, cholesky_by
from fe.elements.edge_gram import edge_gram
from fe.elements.factor import Factor, check_condition, factor
from fe.elements.gauss import Gauss, gauss
from fe.elements.mesh import Mesh, on_elements
from fe.elements.rise import rise
from fe.plate.edges import taper_of
from fe.plate.plate import Plate

Real = TypeVar("Real", F32, F64)


class Stretched(NamedTuple):
    """C states in the plane.

    Attributes
    ----------
    stress : (3, gx, gy, C) float64, N/mm
        Nxx, Nyy, Nxy at the Gauss points.
    values : (2, 2 nx + 2, 2 ny + 2, C) float64, mm
        Unknowns of u and v.
    """

    stress: F64
    values: F64


@dataclass(frozen=True, eq=False)
class Membrane:
    """Plane stress on the mesh of a plate; edges hold u and v where their membrane spring is rigid.

    Attributes
    ----------
    plate : Plate
    mesh : Mesh
    """

    plate: Plate
    mesh: Mesh

    @cached_property
    def gauss(self) -> Gauss:
        """Points at which strain and stress live."""
        return gauss(self.mesh)

    @cached_property
    def stiffness(self) -> F64:
        """Stretching stiffness E h / (1 - ν²) at the Gauss points, (gx, gy) float64, N/mm."""
        thickness, young = on_elements(self.plate, self.mesh)
        elements = young * thickness / (1.0 - self.plate.poisson**2)
        points = len(self.gauss.x.places) // self.mesh.counts[0]
        return elements.repeat(points, axis=0).repeat(points, axis=1)

    @cached_property
    def keep(self) -> Mask:
        """Which unknowns of u and v are free, (2, 2 nx + 2, 2 ny + 2)."""
        axes: list[Mask] = []
        for axis, line in enumerate(self.mesh.lines):
            keep = np.ones(line.unknowns, dtype=bool)
            for edge, first in zip(self.plate.sides.along(axis), (0, -2), strict=True):
                keep[first] = not isinf(edge.springs.membrane)
            axes.append(keep)
        keep = np.broadcast_to(np.logical_and.outer(*axes), (2, *self.mesh.shape)).copy()
        edges = [edge for axis in (0, 1) for edge in self.plate.sides.along(axis)]
        if all(edge.springs.membrane == 0 for edge in edges):
            # Nothing holds the plane. Its loads are in balance, so that three pins carry nothing.
            keep[:, 0, 0] = keep[1, -2, 0] = False
        return keep

    @cached_property
    def order(self) -> I64:
        """Free unknowns by their nodes, (N,) int64: the band of the stiffness is narrow."""
        order, free = by_nodes(self.mesh, 2), np.moveaxis(self.keep, 0, 2).ravel()
        number = np.moveaxis(np.cumsum(self.keep).reshape(self.keep.shape), 0, 2).ravel() - 1
        return number[order][free[order]]

    @cached_property
    def factor(self) -> Ordered | Factor:
        """Factors of the stiffness of the free unknowns; Cholesky's, as it is positive."""
        along, across = self.slopes
        area = (self.gauss.weights * self.stiffness).ravel()
        shear = 0.5 * (1.0 - self.plate.poisson) * area

        def product(left: sp.csr_array, weight: F64, right: sp.csr_array) -> sp.csr_array:
            return sp.csr_array(left.T @ sp.diags_array(weight) @ right)

        uu = product(along, area, along) + product(across, shear, across)
        vv = product(across, area, across) + product(along, shear, along)
        uv = product(along, self.plate.poisson * area, across) + product(across, shear, along)
        springs = self._springs()
        matrix = sp.csr_array(sp.block_array([[uu + springs, uv], [uv.T, vv + springs]]))
        free = self.keep.ravel()
        stiffness = sp.csc_array(matrix[free][:, free])
        ordered = cholesky_by(self.order, stiffness)
        if ordered is None:
            return factor(stiffness)
        scale = 1.0 / np.sqrt(stiffness.diagonal())
        scaled = sp.csc_array(sp.diags_array(scale) @ stiffness @ sp.diags_array(scale))
        check_condition(scaled, lambda right: (ordered.solve((right.T / scale).T).T / scale).T)
        return ordered

    @cached_property
    def slopes(self) -> tuple[sp.csr_array, sp.csr_array]:
        """Slopes along x and y at all Gauss points, two (gx gy, unknowns) matrices."""
        x, y = self.gauss.x, self.gauss.y
        along = sp.kron(sp.csr_array(x.slope), sp.csr_array(y.value))
        return sp.csr_array(along), sp.csr_array(
            sp.kron(sp.csr_array(x.value), sp.csr_array(y.slope))
        )

    def _springs(self) -> sp.csr_array:
        """Stiffness of elastic edges, the same along x and y."""
        unknowns = self.mesh.shape[0] * self.mesh.shape[1]
        matrix = sp.csr_array((unknowns, unknowns))
        for axis in (0, 1):
            for edge, place in zip(self.plate.sides.along(axis), (0, -2), strict=True):
                spring = edge.springs.membrane
                if spring == 0 or isinf(spring):
                    continue
                at_end = np.zeros(self.mesh.shape[axis])
                at_end[place] = spring
                along = edge_gram(self.mesh.lines[1 - axis], taper_of(edge).membrane)
                across = sp.diags_array(at_end)
                pair = (across, along) if axis == 0 else (along, across)
                matrix = matrix + sp.kron(*pair)
        return matrix

    def stress(self, strain: F64) -> F64:
        """Stress Nxx, Nyy, Nxy (3, gx, gy, C) N/mm of strain exx, eyy, exy at the Gauss points."""
        c, nu = self.stiffness[:, :, None], self.plate.poisson
        exx, eyy, exy = strain
        return np.stack([c * (exx + nu * eyy), c * (eyy + nu * exx), c * (1 - nu) * exy])

    @cached_property
    def rest(self) -> tuple[F64, F64]:
        """Slopes of the shape at rest, two (gx, gy, 1) float64."""
        return self.gauss.slopes(rise(self.plate, self.mesh))

    def stretching(self, values: F64) -> F64:
        """Strain of deflections (2 nx + 2, 2 ny + 2, C) mm without any u: (3, gx, gy, C)."""
        slopes = self.gauss.slopes(values)
        return stretch(slopes, self.steeper(slopes, 2.0))

    def bowing(self, values: F64) -> F64:
        """Linear part of `stretching`, that which comes from the shape at rest."""
        return 2.0 * stretch(self.gauss.slopes(values), self.rest)

    def steeper(self, slopes: tuple[F64, F64], times: float = 1.0) -> tuple[F64, F64]:
        """Slopes of deflections and of so many times the shape at rest."""
        if self.plate.shape is None:
            return slopes
        (wx, wy), (rx, ry) = slopes, self.rest
        return wx + times * rx, wy + times * ry

    def relax(self, strain: F64) -> Stretched:
        """Let the plane find its balance under initial strains.

        Parameters
        ----------
        strain : (3, gx, gy, C) float64
            exx, eyy and exy that are there without any u.
        """
        initial = self.stress(strain)
        loads = np.stack(
            [self.gauss.loads(initial[0], initial[2]), self.gauss.loads(initial[2], initial[1])]
        )
        values = self.solve(-loads)
        return Stretched(initial + self.stress(self.strain(values)), values)

    def strain(self, values: F64) -> F64:
        """Strain exx, eyy, exy (3, gx, gy, C) of displacements (2, 2 nx + 2, 2 ny + 2, C) mm."""
        (ux, uy), (vx, vy) = (self.gauss.slopes(component) for component in values)
        return np.stack([ux, vy, 0.5 * (uy + vx)])

    def solve(self, loads: F64) -> F64:
        """Unknowns of u and v under generalised loads, both (2, 2 nx + 2, 2 ny + 2, C)."""
        values = np.zeros(loads.shape)
        values[self.keep] = self.factor.solve(loads[self.keep])
        return values

    def work(self, stress: F64, strain: F64) -> F64:
        """Work ∫ N : E dA of C stresses on K strains (3, gx, gy, ...): (C, K) float64, N mm."""
        # One component after the other: what is weighed is a copy, and states are many.
        found = np.zeros((stress.shape[-1], strain[0, 0, 0].size))
        for part, along, times in zip(stress, strain, (1.0, 1.0, 2.0), strict=True):
            area = times * self.gauss.weights.reshape(-1, 1)
            found += part.reshape(len(area), -1).T @ (along.reshape(len(area), -1) * area)
        return found

    def weigh(self, stress: F64) -> F32:
        """Matrix (C, 3 gx gy) from strains at the Gauss points to their work with C stresses."""
        # The shear stands for both off-diagonal parts.
        area = self.gauss.weights * np.array([1.0, 1.0, 2.0])[:, None, None]
        weighed = np.empty((stress.shape[-1], area.size), dtype=np.float32)
        for row, one in zip(weighed, np.moveaxis(stress, -1, 0), strict=True):
            row[:] = (one * area).ravel()  # all at once would be three times as large for a moment
        return weighed


def stretch(left: tuple[Real, Real], right: tuple[Real, Real]) -> Real:
    """Strain ½ ∇v ∇w, symmetric part, (3, ...), from the slopes of v and of w."""
    (vx, vy), (wx, wy) = left, right
    return np.stack([vx * wx, vy * wy, (vx * wy + vy * wx) / 2]) / 2  # pyright: ignore[reportReturnType]


def pull(stress: F64, slopes: tuple[F64, F64]) -> tuple[F64, F64]:
    """Transverse pull N ∇w at the Gauss points, from stress (3, ...) and the slopes of w."""
    wx, wy = slopes
    return stress[0] * wx + stress[2] * wy, stress[2] * wx + stress[1] * wy
