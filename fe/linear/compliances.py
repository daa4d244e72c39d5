"""How far the plate yields under a touch itself, where elements are least exact.

Under a point load the curvature grows without bound, and the deflection there is short by
0.002 P h² / D whatever the element length h. So the neighbourhood is solved on finer elements with
its rim held, and the coarse elements take over what the rim carries, level by level. Curvature
jumps at the rim, a line between elements, where Hermite functions let it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from fe.arrays import F64
from fe.elements.functional import derivative
from fe.elements.hermite import hermite
from fe.elements.line import Line
from fe.elements.mesh import Mesh
from fe.linear.energy import stiffness
from fe.linear.linear import Linear, LinearState
from fe.plate.edges import Clamped, Edge, Edges, part_of
from fe.plate.plate import Plate
from fe.plate.thin import check_thin

# A level reaches this many elements to each side of the touched one and cuts each in four. Two
# levels leave 1/256 of the error.
_REACH = 3
_CUT = 4
_LEVELS = 2


class _Window(NamedTuple):
    """Part of a plate on finer elements, and its corner on the plate, mm."""

    linear: Linear
    corner: F64


def compliance(linear: Linear, xy: ArrayLike) -> F64:
    """Deflection under a point touch of 1 N at each place, along the touch.

    Parameters
    ----------
    linear : Linear
    xy : (K, 2) array_like, mm

    Returns
    -------
    (K,) float64, mm/N
        To about 1e-6, and 2e-4 one element from an edge or a corner.

    Raises
    ------
    ValueError
        A place lies outside the plate, or the plate is thick.
    """
    check_thin(linear.plate)
    places = linear.plate.points(xy, "touch")
    return np.array([_under(linear, place) for place in places])


def _under(linear: Linear, place: F64) -> float:
    inner, loads = _point(linear, place, _LEVELS)
    return -(inner + _deflection(linear, linear.solve(loads), place))


def _point(linear: Linear, place: F64, levels: int) -> tuple[float, F64]:
    """Deflection inside windows under -1 N, and the loads (..., 1) that they leave to a mesh."""
    if levels == 0:
        loads = np.zeros((*linear.mesh.shape, 1))
        derivative(linear.mesh, place[None]).add_to(loads, -np.ones(1), np.zeros(1, dtype=int))
        return 0.0, loads
    window = _window(linear, place)
    inner, loads = _point(window.linear, place - window.corner, levels - 1)
    values = window.linear.solve(loads)
    inner += _deflection(window.linear, values, place - window.corner)
    return inner, _taken_over(linear, window, loads - _forces(window.linear, values))


def _deflection(linear: Linear, values: F64, place: F64) -> float:
    return float(LinearState(linear.plate, linear.mesh, values).deflection(place[None])[0])


def _forces(linear: Linear, values: F64) -> F64:
    """Return loads of all unknowns, held ones too, that keep the plate in its shape."""
    rows, columns = linear.mesh.shape
    everything = np.ones(rows, dtype=bool), np.ones(columns, dtype=bool)
    whole = stiffness(linear.plate, linear.mesh, everything)
    return (whole @ values.ravel()).reshape(values.shape)


def _window(linear: Linear, place: F64) -> _Window:
    """Neighbourhood of a place, held at its rim where that is not an edge of the plate."""
    plate, lines = linear.plate, linear.mesh.lines
    spans = [_span(line, x) for line, x in zip(lines, place, strict=True)]
    corner, end = np.array(
        [line.nodes[list(span)] for line, span in zip(lines, spans, strict=True)]
    ).T
    sides = [
        _part(edge, lines[1 - axis], spans[1 - axis])
        if node in (0, lines[axis].count)
        else Clamped()
        for axis, span in enumerate(spans)
        for node, edge in zip(span, plate.sides.along(axis), strict=True)
    ]
    thickness, young = (float(value[0]) for value in plate.material(place[None]))
    size = tuple((end - corner).tolist())
    part = Plate(size, thickness, young, plate.poisson, Edges(*sides), tension=plate.tension)
    nx, ny = (_CUT * (last - first) for first, last in spans)
    return _Window(Linear(part, Mesh(size, (nx, ny))), corner)


def _part(edge: Edge, line: Line, span: tuple[int, int]) -> Edge:
    """Edge of the window along a part of an edge of the plate."""
    low, high = 2.0 * line.nodes[list(span)] / line.nodes[-1] - 1.0
    return part_of(edge, float(low), float(high))


def _span(line: Line, x: float) -> tuple[int, int]:
    """First and last node of the window about x, inside its run of equal elements."""
    first, last = line.runs[int(line.run_of(np.array([x]))[0])]
    element = int(np.searchsorted(line.nodes, x, side="right")) - 1
    return max(element - _REACH, first), min(element + 1 + _REACH, last)


def _taken_over(linear: Linear, window: _Window, carried: F64) -> F64:
    """Turn loads that a window carries into those of the coarse elements."""
    along_x, along_y = (
        _finer(coarse, fine, offset)
        for coarse, fine, offset in zip(
            linear.mesh.lines, window.linear.mesh.lines, window.corner, strict=True
        )
    )
    return (along_x.T @ carried[:, :, 0] @ along_y)[:, :, None]


def _finer(coarse: Line, fine: Line, offset: float) -> F64:
    """Unknowns of the coarse functions on the finer line: (fine unknowns, coarse unknowns)."""
    # A node on a coarse one takes either side: value and slope are the same.
    places = np.clip(fine.nodes + offset, 0.0, coarse.nodes[-1])
    matrix = np.zeros((fine.unknowns, coarse.unknowns))
    for order in (0, 1):
        start, weights = hermite(places, coarse, order)
        rows = 2 * np.arange(len(places)) + order
        matrix[rows[:, None], start[:, None] + np.arange(4)] = fine.unit**order * weights
    return matrix
