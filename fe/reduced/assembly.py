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
    """Forms on the functions that move with T touches; see `fe.reduced.kernel`.

    Attributes
    ----------
    rows : (T, 3, F, L) float64
        Each form as a row for each touch; second axis value, d/dx, d/dy by its place.
    projected : (T, 3, A, n) float64
        The moving functions on the fixed shapes. Form 0 gives the projection in bending energy, for
        the shapes are orthonormal.
    """

    rows: F64
    projected: F64


def assemble(plate: Plate, mesh: Mesh, forms: Forms, xy: F64, radius: F64) -> Assembled:
    """Put the forms of T touches (T, 2) mm, discs of radius (T,) mm or points, together."""
    each = [_one(plate, mesh, forms, *touch) for touch in zip(xy, radius, strict=True)]
    # One touch is the usual case, and the one that must be fastest: nothing is copied.
    found = each[0][None] if len(each) == 1 else np.array(each)
    n, functions = forms.fixed.shape[1], forms.functions
    projected = found[:, :, 0, : n * functions].reshape(len(xy), 3, functions, n)
    return Assembled(found, np.ascontiguousarray(projected))


def _one(plate: Plate, mesh: Mesh, forms: Forms, place: F64, radius: float) -> F64:
    """Forms of one touch, (3, F, L), as `Forms.rows` gives them.

    Those of one moving function are a mean over the disc. Those of two are the mean over two
    discs; the point's are tabled, and the small difference is taken on the fixed shapes.
    """
    rows = forms.rows(place[None], np.ones(1))
    if radius == 0.0:
        return rows
    spread = forms.rows(*disc(plate, mesh, place[None], radius))
    width = forms.fixed.shape[1] * forms.functions
    local = rows[:, :, width:] + _projected(forms, spread) - _projected(forms, rows)
    return np.concatenate([spread[:, :, :width], local], axis=2)


def _projected(forms: Forms, rows: F64) -> F64:
    """Forms of two functions of one touch by their projections, (3, F, A (A + 1) / 2)."""
    (count, n), functions = forms.fixed.shape[:2], forms.functions
    moving = rows[:, :, : n * functions].reshape(3, count, functions, n)
    own = moving[0, 0].T
    reach = (forms.fixed.reshape(-1, n) @ own).reshape(count, n, -1)
    cross = moving @ own + moving[:, :1] @ (moving[0].swapaxes(1, 2) - reach)
    cross[1:] += cross[1:].swapaxes(2, 3)
    left, right = np.triu_indices(functions)
    return cross[..., left, right]
