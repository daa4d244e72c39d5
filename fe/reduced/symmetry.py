"""Symmetries of a plate: a state that was computed is as many states as the plate has copies."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import product
from typing import NamedTuple

import numpy as np

from fe.arrays import F64, I64
from fe.elements.mesh import Mesh
from fe.plate.edges import EVEN, Edges, taper_of
from fe.plate.plate import Plate, Touch


class Symmetry(NamedTuple):
    """A way to lay a rectangle on itself: exchange x and y, then mirror along x, then along y.

    Attributes
    ----------
    exchange : bool
    mirror : tuple of bool
        Along x and along y.
    """

    exchange: bool
    mirror: tuple[bool, bool]

    @property
    def turn(self) -> F64:
        """Matrix (2, 2) that moves places about the middle of the plate."""
        return np.diag(np.where(self.mirror, -1.0, 1.0)) @ np.eye(2)[:: -1 if self.exchange else 1]

    def touch(self, touch: Touch, size: tuple[float, float]) -> Touch:
        """Move a touch along with the plate of sides `size` mm."""
        x, y = (touch.y, touch.x) if self.exchange else (touch.x, touch.y)
        (a, b), (along, across) = size, self.mirror
        return replace(touch, x=a - x if along else x, y=b - y if across else y)

    def deflections(self, values: F64) -> F64:
        """Move unknowns (2 nx + 2, 2 ny + 2, C) of functions on the plate."""
        moved = values.swapaxes(0, 1) if self.exchange else values
        for axis, mirrored in enumerate(self.mirror):
            moved = _mirrored(moved, axis) if mirrored else moved
        return moved

    def displacements(self, plane: F64) -> F64:
        """Move unknowns (2, 2 nx + 2, 2 ny + 2, C) of u and v in the plane."""
        if self == IDENTITY:
            return plane
        u, v = plane[::-1] if self.exchange else plane
        signs = (-1.0 if mirrored else 1.0 for mirrored in self.mirror)
        return np.stack(
            [sign * self.deflections(part) for sign, part in zip(signs, (u, v), strict=True)]
        )

    def stresses(self, stress: F64) -> F64:
        """Move stresses Nxx, Nyy, Nxy (3, gx, gy, C) at the Gauss points."""
        moved = stress.swapaxes(1, 2)[[1, 0, 2]] if self.exchange else stress
        for axis, mirrored in enumerate(self.mirror, start=1):
            moved = np.flip(moved, axis) if mirrored else moved
        if self.mirror[0] != self.mirror[1]:
            moved = moved * np.array([1.0, 1.0, -1.0])[:, None, None, None]
        return moved


def from_to(ways: Sequence[Symmetry]) -> I64:
    """Find the number (W, W) of the way that leads from the copy by one to that by another."""
    turns = np.stack([way.turn for way in ways])
    between = np.einsum("gji,hjk->ghik", turns, turns)
    return (between[:, :, None] == turns).all(axis=(3, 4)).argmax(axis=2)


IDENTITY = Symmetry(False, (False, False))


def symmetries(plate: Plate, mesh: Mesh) -> list[Symmetry]:
    """Find the ways in which a plate and its mesh lie on themselves; the first changes nothing.

    Patches, a taper, uneven edges, shear at rest and shapes other than a sag are taken as
    symmetric in none.
    """
    uneven = any(taper_of(getattr(plate.sides, side)) != EVEN for side in Edges.__annotations__)
    odd_shape = plate.shape is not None and bool(plate.shape.modes)
    uneven = uneven or plate.taper != (0.0, 0.0)
    if plate.patches or uneven or odd_shape or plate.tension[2] != 0.0:
        return [IDENTITY]
    ways = (
        Symmetry(exchange, (along, across))
        for exchange, along, across in product((False, True), repeat=3)
    )
    return [way for way in ways if _lies_on_itself(way, plate, mesh)]


def _lies_on_itself(way: Symmetry, plate: Plate, mesh: Mesh) -> bool:
    west, east, south, north = (getattr(plate.sides, side) for side in Edges.__annotations__)
    nodes = mesh.nodes
    if way.exchange:
        tension = plate.tension
        if plate.size[0] != plate.size[1] or tension[0] != tension[1] or not _same(*nodes):
            return False
        west, east, south, north = south, north, west, east
    along, across = way.mirror
    west, east = (east, west) if along else (west, east)
    south, north = (north, south) if across else (south, north)
    moved = Edges(west, east, south, north)
    mirrored = (n for n, there in zip(nodes, way.mirror, strict=True) if there)
    even = all(_same(n, n[-1] - n[::-1]) for n in mirrored)
    return even and moved == plate.sides


def _same(one: F64, other: F64) -> bool:
    return len(one) == len(other) and bool(np.allclose(one, other, rtol=0.0, atol=1e-9 * one[-1]))


def _mirrored(values: F64, axis: int) -> F64:
    """Reverse the nodes along an axis of a table; slopes along it change sign."""
    lines = np.moveaxis(values, axis, 0)
    pairs = lines.reshape(-1, 2, *lines.shape[1:])[::-1].copy()
    pairs[:, 1] *= -1.0
    return np.moveaxis(pairs.reshape(lines.shape), 0, axis)
