"""Forms of the plate under given touches, and how they change as the touches move."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fe.arrays import F64
from fe.elements.mesh import Mesh
from fe.linear.load import disc
from fe.plate.plate import Plate
from fe.reduced.forms import Forms


class Assembled(NamedTuple):
    """Forms on the n fixed shapes and on the t = T A functions that move with T touches.

    Attributes
    ----------
    mixed : (F, n, t) float64
    local : (F, t, t) float64
    mixed_by : (T, 2, F, n, t) float64
        Derivatives by x and y of each touch.
    local_by : (T, 2, F, t, t) float64
    """

    mixed: F64
    local: F64
    mixed_by: F64
    local_by: F64

    @property
    def functions(self) -> int:
        """A, the functions that move with one touch."""
        return self.local.shape[1] // len(self.local_by)


def assemble(plate: Plate, mesh: Mesh, forms: Forms, xy: F64, radius: F64) -> Assembled:
    """Put the forms of T touches (T, 2) mm, discs of radius (T,) mm or points, together."""
    (count, n), functions, touches = forms.fixed.shape[:2], forms.functions, len(xy)
    found = [_one(plate, mesh, forms, *touch) for touch in zip(xy, radius, strict=True)]
    if touches == 1:
        # The usual case, and the one that must be fastest: nothing is copied.
        ((mixed, local),) = found
        return Assembled(mixed[0], local[0], mixed[None, 1:], local[None, 1:])
    total = touches * functions
    local = np.empty((count, total, total))
    mixed_by = np.zeros((touches, 2, count, n, total))
    local_by = np.zeros((touches, 2, count, total, total))
    own = [slice(i * functions, (i + 1) * functions) for i in range(touches)]
    reach = [forms.reach(mixed[0, 0]) for mixed, _ in found]
    for i, (mixed, here) in enumerate(found):
        mixed_by[i, ..., own[i]] = mixed[1:]
        local[:, own[i], own[i]] = here[0]
        local_by[i, :, :, own[i], own[i]] = here[1:]
        for j in range(touches):
            if i == j:
                continue
            cross = _cross(mixed, found[j][0][0], reach[j])
            local[:, own[i], own[j]] = cross[0]
            local_by[i, :, :, own[i], own[j]] = cross[1:]
            local_by[i, :, :, own[j], own[i]] = cross[1:].swapaxes(2, 3)
    return Assembled(np.concatenate([mixed[0] for mixed, _ in found], 2), local, mixed_by, local_by)


def _one(plate: Plate, mesh: Mesh, forms: Forms, place: F64, radius: float) -> tuple[F64, F64]:
    """Forms of one touch, as `Forms.at` gives them.

    Those of one moving function are a mean over the disc. Those of two are the mean over two
    discs; the point's are tabled, and the small difference is taken on the fixed shapes.
    """
    mixed, local = forms.at(place[None], np.ones(1))
    if radius == 0.0:
        return mixed, local
    spread, _ = forms.at(*disc(plate, mesh, place[None], radius))
    for sign, part in ((1.0, spread), (-1.0, mixed)):
        cross = sign * _cross(part, part[0], forms.reach(part[0, 0]))
        local[0] += cross[0]
        local[1:] += cross[1:] + cross[1:].swapaxes(2, 3)
    return spread, local


def _cross(moving: F64, other: F64, reach: F64) -> F64:
    """Forms of the functions of two touches, (3, F, A, A), by x and y of the first.

    B(v, w) ≈ B(v, Πw) + B(Πv, w) - B(Πv, Πw) with Π the projection on the fixed shapes in bending
    energy: off by B of what the projections leave, which is small and lies about each touch.

    Parameters
    ----------
    moving : (3, F, n, A) float64
        Of one touch, value and slopes; form 0 gives the projection, for the shapes are orthonormal.
    other : (F, n, A) float64
        Of the other.
    reach : (F, n, A) float64
        Forms of the fixed shapes and the projected functions of the other.
    """
    projected = moving[:, :1].swapaxes(2, 3)
    return moving.swapaxes(2, 3) @ other[0] + projected @ (other - reach)
