"""Where touches press: one point, or points spread over a disc."""

from __future__ import annotations

from collections.abc import Sequence
from math import ceil, inf
from typing import NamedTuple

import numpy as np

from fe.arrays import F64, I64
from fe.elements.mesh import Mesh
from fe.plate.checks import number
from fe.plate.plate import Plate, Touch

# Points of a disc lie at most this many elements apart, and on this many rings at least: the mean
# of a cubic over the disc is then right to 1e-5, and so is that of the load on one element.
_APART = 0.5
_FEWEST_RINGS = 4


class Loads(NamedTuple):
    """Forces at points that stand for some touches.

    Attributes
    ----------
    xy : (Q, 2) float64, mm
    along_z : (Q,) float64, N
        Force along +z; a touch presses along -z.
    touch : (Q,) int64
        Touch to which each belongs.
    """

    xy: F64
    along_z: F64
    touch: I64


def spread(plate: Plate, mesh: Mesh, touches: Sequence[Touch]) -> Loads:
    """Points and forces of touches: one for a point, many for a disc of even pressure.

    Raises
    ------
    ValueError
        A touch, or a part of its disc, lies outside the plate.
    """
    places = np.array([(t.x, t.y) for t in touches], dtype=np.float64).reshape(-1, 2)
    places = plate.points(places, "touch")
    parts = [disc(plate, mesh, xy[None], t.radius) for xy, t in zip(places, touches, strict=True)]
    counts = [len(points) for points, _ in parts]
    forces = [-t.force * weights for t, (_, weights) in zip(touches, parts, strict=True)]
    return Loads(
        np.concatenate([np.empty((0, 2)), *(points for points, _ in parts)]),
        np.concatenate([np.empty(0), *forces]),
        np.repeat(np.arange(len(touches)), counts),
    )


def check_touches(plate: Plate, touches: Sequence[Touch]) -> None:
    """Raise where a touch, or a part of its disc, lies outside the plate."""
    places = np.array([(t.x, t.y) for t in touches], dtype=np.float64).reshape(-1, 2)
    for place, touch in zip(plate.points(places, "touch"), touches, strict=True):
        if touch.radius > 0:
            _check_inside(plate, place[None], touch.radius)


def disc(plate: Plate, mesh: Mesh, xy: F64, radius: float) -> tuple[F64, F64]:
    """Quadrature of the mean over discs: rings of Gauss in r², evenly spaced points on each.

    Parameters
    ----------
    plate : Plate
    mesh : Mesh
        Sets how close the points lie.
    xy : (K, 2) float64, mm
        Middles of the discs.
    radius : float, mm
        0 for points.

    Returns
    -------
    points : (K * Q, 2) float64, mm
        Q points of each disc, one disc after the other.
    weights : (Q,) float64
        Of sum 1.

    Raises
    ------
    ValueError
        A disc reaches over an edge.
    """
    if number(radius, "touch radius", "mm") == 0:
        return xy, np.ones(1)
    _check_inside(plate, xy, radius)
    apart = _APART * mesh.finest
    nodes, parts = np.polynomial.legendre.leggauss(max(_FEWEST_RINGS, ceil(radius / apart)))
    offsets: list[F64] = []
    weights: list[F64] = []
    for r, part in zip(radius * np.sqrt(0.5 * (nodes + 1)), 0.5 * parts, strict=True):
        count = max(8, 4 * ceil(0.5 * np.pi * r / apart))
        angle = 2 * np.pi * (np.arange(count) + 0.5) / count
        offsets.append(r * np.column_stack([np.cos(angle), np.sin(angle)]))
        weights.append(np.full(count, part / count))
    points = xy[:, None] + np.concatenate(offsets)
    return points.reshape(-1, 2), np.concatenate(weights)


def _check_inside(plate: Plate, xy: F64, radius: float) -> None:
    if not 0 < radius < inf:
        raise ValueError(
            f"touch radius must be 0 mm or more and finite, got {radius:g} mm; write 0 for a point"
        )
    room = np.minimum(xy, np.array(plate.size) - xy).min(axis=1)
    if (room < radius).any():
        k = int(np.argmin(room))
        raise ValueError(
            f"touch disc of radius {radius:g} mm at ({xy[k, 0]:g}, {xy[k, 1]:g}) mm must lie on "
            f"the plate, got {room[k]:g} mm to the nearest edge; use a smaller radius"
        )
