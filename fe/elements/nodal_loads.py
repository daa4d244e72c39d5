"""Generalised nodal loads: work of pressure, lines, forces along the face and moments."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from fe.arrays import F64
from fe.elements.functional import derivative
from fe.elements.mesh import Mesh
from fe.plate.loads import FaceForce, LineLoad, Load, PointMoment, Pressure
from fe.plate.plate import Plate

_POINTS, _WEIGHTS = np.polynomial.legendre.leggauss(4)  # a bicubic along a line has degree 6


class _Work(NamedTuple):
    """Σ scale · ∂^(p + q) of the component at points: the work of a load, N mm."""

    xy: F64
    component: int
    order: tuple[int, int]
    scale: F64


def nodal_loads(plate: Plate, mesh: Mesh, loads: Sequence[Load]) -> F64:
    """Work of loads on the unknowns of u, v and w, exact for the functions of the mesh.

    They keep their direction and place on the face of the plate at rest. A force along the touched
    face, at z = h/2, bends the plate as well: it works on u = -z w,x (Kirchhoff).

    Parameters
    ----------
    plate : Plate
    mesh : Mesh
    loads : sequence of Load

    Returns
    -------
    (2 nx + 2, 2 ny + 2, 3) float64, N
        As `ShellState.load` takes them; the last of three is what `Linear.solve` takes.

    Raises
    ------
    ValueError
        A load lies outside the plate.
    """
    table = np.zeros((*mesh.shape, 3))
    for load in loads:
        for work in _works(plate, mesh, load):
            column = np.full(len(work.xy), work.component, dtype=np.int64)
            derivative(mesh, work.xy, *work.order).add_to(table, work.scale, column)
    return table


def _works(plate: Plate, mesh: Mesh, load: Load) -> list[_Work]:
    match load:
        case Pressure():
            xy, areas = _over_rectangle(plate, mesh, load)
            return [_Work(xy, 2, (0, 0), -load.pressure * areas)]
        case LineLoad():
            xy, parts = _along_line(plate, mesh, load)
            pressed = _Work(xy, 2, (0, 0), -load.force * parts)
            return [pressed, *_along_face(plate, xy, load.along_x * parts, load.along_y * parts)]
        case FaceForce():
            xy = plate.points([(load.x, load.y)], "face force")
            return _along_face(plate, xy, np.array([load.along_x]), np.array([load.along_y]))
        case PointMoment():
            xy = plate.points([(load.x, load.y)], "point moment")
            about_x = _Work(xy, 2, (0, 1), np.array([load.about_x]))  # turns by w,y about x
            return [about_x, _Work(xy, 2, (1, 0), np.array([-load.about_y]))]


def _along_face(plate: Plate, xy: F64, along_x: F64, along_y: F64) -> list[_Work]:
    arm = 0.5 * plate.material(xy)[0]
    return [
        _Work(xy, 0, (0, 0), along_x),
        _Work(xy, 1, (0, 0), along_y),
        _Work(xy, 2, (1, 0), -arm * along_x),
        _Work(xy, 2, (0, 1), -arm * along_y),
    ]


def _over_rectangle(plate: Plate, mesh: Mesh, load: Pressure) -> tuple[F64, F64]:
    """Gauss points over the elements that a rectangle covers, and their areas, mm²."""
    low, high = zip(*(ends or (0.0, side) for ends, side in _sides(plate, load)), strict=True)
    plate.points([low, high], "corner of a pressure")
    lines = zip(mesh.nodes, low, high, strict=True)
    (x, along_x), (y, along_y) = (_gauss(_between(*one)) for one in lines)
    xy = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2)
    return xy, np.outer(along_x, along_y).ravel()


def _sides(plate: Plate, load: Pressure) -> list[tuple[tuple[float, float] | None, float]]:
    return [(load.x, plate.size[0]), (load.y, plate.size[1])]


def _along_line(plate: Plate, mesh: Mesh, load: LineLoad) -> tuple[F64, F64]:
    """Gauss points of a line between the grid lines that it crosses, and their parts of 1."""
    ends = plate.points([load.start, load.end], "end of a line load")
    reach = ends[1] - ends[0]
    crossed = [
        (nodes - ends[0, axis]) / reach[axis]
        for axis, nodes in enumerate(mesh.nodes)
        if reach[axis] != 0
    ]
    places, parts = _gauss(_between(np.concatenate(crossed), 0.0, 1.0))
    return ends[0] + places[:, None] * reach, parts


def _between(nodes: F64, low: float, high: float) -> F64:
    """Give the ends of an interval and the nodes inside it, in order."""
    return np.unique(np.concatenate([[low, high], nodes[(nodes > low) & (nodes < high)]]))


def _gauss(ends: F64) -> tuple[F64, F64]:
    """Points and weights on the intervals between some ends."""
    half, middle = 0.5 * np.diff(ends), 0.5 * (ends[1:] + ends[:-1])
    return (middle[:, None] + half[:, None] * _POINTS).ravel(), np.outer(half, _WEIGHTS).ravel()
