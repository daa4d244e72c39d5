"""Gauss points of a mesh: slopes of functions there, and loads from what acts there."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fe.arrays import F64
from fe.elements.hermite import hermite
from fe.elements.line import Line
from fe.elements.mesh import Mesh

# Points an element and axis. Three integrate a product of two slopes of bicubics times a smooth
# stress nearly exactly, and leave no motion of the plane unstrained.
_POINTS = 3


@dataclass(frozen=True, eq=False)
class Axis:
    """Gauss points of one axis.

    Attributes
    ----------
    places : (g,) float64, mm
    weights : (g,) float64, mm
    value, slope : (g, 2 n + 2) float64, 1 and 1/mm
        Matrices from the unknowns of a line to values and slopes at the points.
    """

    places: F64
    weights: F64
    value: F64
    slope: F64


@dataclass(frozen=True, eq=False)
class Gauss:
    """Gauss points of a mesh, the product of those of its two axes.

    Fields at the points have the shape (gx, gy, ...), functions the shape of the mesh's table.
    """

    x: Axis
    y: Axis

    @property
    def weights(self) -> F64:
        """Area of each point, (gx, gy) float64, mm²."""
        return np.multiply.outer(self.x.weights, self.y.weights)

    def slopes(self, values: F64) -> tuple[F64, F64]:
        """Slopes along x and y of functions (2 nx + 2, 2 ny + 2, C): two (gx, gy, C) float64."""
        along_x = np.tensordot(self.x.slope, values, 1)
        along_y = np.tensordot(self.x.value, values, 1)
        return self.y.value @ along_x, self.y.slope @ along_y

    def loads(self, along_x: F64, along_y: F64) -> F64:
        """Adjoint of `slopes`: table of ∫ (p f,x + q f,y) dA for every function f.

        Parameters
        ----------
        along_x, along_y : (gx, gy, C) float64
            p and q.

        Returns
        -------
        (2 nx + 2, 2 ny + 2, C) float64
        """
        area = self.weights[:, :, None]
        return self.gathered(area * along_x, area * along_y)

    def gathered(self, along_x: F64, along_y: F64) -> F64:
        """Compute `loads` of what has been multiplied by the area of each point."""
        across_x, across_y = self.y.value.T @ along_x, self.y.slope.T @ along_y
        return np.tensordot(self.x.slope.T, across_x, 1) + np.tensordot(self.x.value.T, across_y, 1)


def gauss(mesh: Mesh) -> Gauss:
    """Gauss points of a mesh."""
    along_x, along_y = (_axis(line) for line in mesh.lines)
    return Gauss(along_x, along_y)


def dense(x: F64, line: Line, order: int) -> F64:
    """Matrix (K, 2 n + 2) of a derivative at points of a line."""
    stencil = hermite(x, line, order)
    matrix = np.zeros((len(x), line.unknowns))
    np.put_along_axis(matrix, stencil.columns, stencil.weights, axis=1)
    return matrix


def _axis(line: Line) -> Axis:
    t, weight = np.polynomial.legendre.leggauss(_POINTS)
    lengths = np.diff(line.nodes)[:, None]
    places = (line.nodes[:-1, None] + 0.5 * lengths * (t + 1)).ravel()
    weights = (0.5 * lengths * weight).ravel()
    return Axis(places, weights, dense(places, line, 0), dense(places, line, 1))
