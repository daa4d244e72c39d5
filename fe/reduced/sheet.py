"""Motion in the plane at fixed points, from the slopes of the deflection on a grid of samples.

The middle surface moves as ½ ∇w ∇w stretches it, and at a point that is work of the stress which a
unit force there would bring. Few fixed fields hold most of it, as forms of the touches' places;
what they leave follows the touch and is taken here from the stretch itself. Slopes of the functions
that move with a touch are splines of its place, so that derivatives are exact.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from fe.arrays import F64
from fe.elements.functional import derivative
from fe.elements.gauss import dense
from fe.elements.mesh import Mesh
from fe.linear.load import disc
from fe.plate.plate import Plate
from fe.reduced.interpolation import between
from fe.reduced.karman import Karman
from fe.reduced.spline import SplineTable

# Samples along the side of a square. What fields leave is off by 2 % of itself with 36, and beside
# an edge by half with 28.
_SIDE = 36
_FEWEST = 12
# Points whose stresses are held at once.
_TOGETHER = 24


class SlopeSamples(NamedTuple):
    """Matrices from the unknowns of each line to values and slopes at the samples.

    Attributes
    ----------
    places : pair of (sx,), (sy,) float64, mm
    x, y : pair of (sx, 2 nx + 2), (sy, 2 ny + 2) float64
    """

    places: tuple[F64, F64]
    x: tuple[F64, F64]
    y: tuple[F64, F64]

    @property
    def readings(self) -> int:
        """Slopes 2 Q at all samples."""
        return 2 * len(self.places[0]) * len(self.places[1])

    def slopes(self, values: F64) -> F64:
        """Slopes of functions (2 nx + 2, 2 ny + 2, C): (2 Q, C) float64, along x, then y."""
        (x, slope_x), (y, slope_y) = self.x, self.y
        along = y @ np.tensordot(slope_x, values, 1), slope_y @ np.tensordot(x, values, 1)
        return np.stack(along).reshape(-1, values.shape[2])


def samples(mesh: Mesh) -> SlopeSamples:
    """Spread samples evenly over a plate, edges included."""
    element = (mesh.size[0] * mesh.size[1]) ** 0.5 / _SIDE
    x, y = (np.linspace(0.0, side, max(round(side / element), _FEWEST)) for side in mesh.size)
    ways = [
        (dense(at, line, 0), dense(at, line, 1))
        for at, line in zip((x, y), mesh.lines, strict=True)
    ]
    return SlopeSamples((x, y), *ways)


@dataclass(frozen=True, eq=False)
class Sheet:
    """Slopes at Q samples, of all that makes up a deflection.

    Attributes
    ----------
    fixed : (2 Q, n) float64
        Of the fixed shapes, that at rest included.
    moving : SplineTable
        Of 2 Q A functions of the place of a touch.
    resting : (n,) float64
        1 for the shape at rest, which stretches nothing by itself, and else 0.
    """

    fixed: F64
    moving: SplineTable
    resting: F64

    def stretched(
        self, plate: Plate, mesh: Mesh, touches: tuple[F64, float], state: tuple[F64, F64]
    ) -> tuple[F64, F64]:
        """Strain at the samples and its derivatives by x, y, F of each touch.

        Parameters
        ----------
        plate : Plate
        mesh : Mesh
        touches : (T, 2) float64, mm, and float, mm
            Places, and the radius of all.
        state : (n + T A,) and (n + T A, 3 T) float64
            Weights and their derivatives.

        Returns
        -------
        (3 Q,), (3 Q, 3 T) float64
            exx, eyy and exy that are there without any u.
        """
        (xy, radius), (weights, weights_by) = touches, state
        count, n = self.fixed.shape
        own = weights[n:].reshape(len(xy), -1)
        moving = [
            self.moving.at(*disc(plate, mesh, place[None], radius)).reshape(3, count, -1)
            for place in xy
        ]
        every = np.concatenate([self.fixed, *(part[0] for part in moving)], axis=1)
        slopes, slopes_by = every @ weights, every @ weights_by
        for t, part in enumerate(moving):
            slopes_by[:, 3 * t : 3 * t + 2] += (part[1:] @ own[t]).T
        rest = (self.fixed @ self.resting).reshape(2, -1)
        along, along_by = slopes.reshape(2, -1), slopes_by.reshape(2, count // 2, -1)
        strain = np.concatenate(_square(along) - _square(rest))
        (x, y), (x_by, y_by) = along[:, :, None], along_by
        by = np.concatenate([x * x_by, y * y_by, 0.5 * (x * y_by + y * x_by)])
        return strain, by


def _square(slopes: F64) -> F64:
    """Strain ½ ∇w ∇w of slopes (2, Q): (3, Q)."""
    x, y = slopes
    return 0.5 * np.stack([x * x, y * y, x * y])


def by_stretch(karman: Karman, loads: F64) -> F64:
    """Work of forces in the plane, (2, 2 nx + 2, 2 ny + 2, C), as the samples are stretched.

    Returns
    -------
    (C, 3 Q) float64
        Strain is taken for a cubic spline between samples.
    """
    membrane, count = karman.membrane, loads.shape[-1]
    gauss, grid = membrane.gauss, samples(karman.mesh).places
    x, y = (between(at, axis.places) for at, axis in zip(grid, (gauss.x, gauss.y), strict=True))
    rows = np.empty((count, 3, x.shape[1], y.shape[1]))
    # Shear stands for both off-diagonal parts.
    area = gauss.weights * np.array([1.0, 1.0, 2.0])[:, None, None]
    for first in range(0, count, _TOGETHER):
        part = slice(first, first + _TOGETHER)
        stress = membrane.stress(membrane.strain(membrane.solve(loads[..., part])))
        weighed = np.moveaxis(area[..., None] * stress, 3, 0)
        rows[part] = -(x.T @ (weighed @ y))
    return rows.reshape(count, -1)


def at_points(karman: Karman, xy: F64) -> F64:
    """Rows (2 M, 3 Q) that give u and v in mm of points (M, 2) mm, one point after the other."""
    loads = np.zeros((2, *karman.mesh.shape, 2 * len(xy)))
    read = derivative(karman.mesh, xy)
    for axis, table in enumerate(loads):
        read.add_to(table, np.ones(len(xy)), 2 * np.arange(len(xy)) + axis)
    return by_stretch(karman, loads)
