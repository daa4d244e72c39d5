"""Linear functionals of a function on the plate: a derivative at a point, read or loaded."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fe.arrays import F64, I64
from fe.compiled import njit
from fe.elements.hermite import Stencil, hermite
from fe.elements.mesh import Mesh
from fe.elements.recovery import recover
from fe.elements.window import mean


class Functional(NamedTuple):
    """K functionals of a table of unknowns, each the product of one stencil an axis."""

    x: Stencil
    y: Stencil

    def of(self, values: F64) -> F64:
        """Apply each functional to each function.

        Parameters
        ----------
        values : (2 nx + 2, 2 ny + 2, C) float64
            Unknowns of C functions; last axis the functions, so that a point reads few long rows.

        Returns
        -------
        (K, C) float64
        """
        return _gather(values, *self.x, *self.y)

    def add_to(self, table: F64, scale: F64, columns: I64) -> None:
        """Add each functional, times its scale, to one column of a table of load vectors.

        Parameters
        ----------
        table : (2 nx + 2, 2 ny + 2, C) float64
            Changed in place.
        scale : (K,) float64
        columns : (K,) int64
        """
        rows_x, rows_y = self.x.columns, self.y.columns
        product = self.x.weights[:, :, None] * (scale[:, None] * self.y.weights)[:, None, :]
        place = rows_x[:, :, None], rows_y[:, None, :], columns[:, None, None]
        np.add.at(table, place, product)


def derivative(mesh: Mesh, xy: F64, p: int = 0, q: int = 0) -> Functional:
    """Take the derivative of order p by x and q by y of the bicubic function at points.

    Parameters
    ----------
    mesh : Mesh
    xy : (K, 2) float64, mm
        Points on the plate.
    p, q : int
        Orders 0 to 3.

    Returns
    -------
    Functional
        K of them, in the unit of the function per mm^(p + q).
    """
    along_x, along_y = mesh.lines
    return Functional(hermite(xy[:, 0], along_x, p), hermite(xy[:, 1], along_y, q))


def recovered(mesh: Mesh, xy: F64, p: int, q: int) -> Functional:
    """Take the derivative of order p by x and q by y with an error of h⁴, see `recovery`.

    Same arguments and result as `derivative`, orders 0 to 2.
    """
    along_x, along_y = mesh.lines
    return Functional(recover(xy[:, 0], along_x, p), recover(xy[:, 1], along_y, q))


def averaged(mesh: Mesh, xy: F64, length: float, p: int, q: int) -> Functional:
    """Take the mean of a derivative over squares of a side about points.

    Same arguments and result as `derivative`; `length` is the side in mm, and a square must lie on
    the plate.
    """
    along_x, along_y = mesh.lines
    return Functional(mean(xy[:, 0], length, along_x, p), mean(xy[:, 1], length, along_y, q))


@njit(cache=True, nogil=True)
def _gather(values: F64, start_x: I64, weight_x: F64, start_y: I64, weight_y: F64) -> F64:
    out = np.zeros((start_x.size, values.shape[2]))
    for k in range(start_x.size):
        for i in range(weight_x.shape[1]):
            for j in range(weight_y.shape[1]):
                weight = weight_x[k, i] * weight_y[k, j]
                row = values[start_x[k] + i, start_y[k] + j]
                for c in range(row.size):
                    out[k, c] += weight * row[c]
    return out
