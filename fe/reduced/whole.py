"""A plate solved whole, on its mesh, as the points of its seen face move."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from math import hypot

import numpy as np

from fe.arrays import F64
from fe.elements.functional import Functional, derivative
from fe.elements.mesh import Mesh
from fe.elements.rise import rise
from fe.linear.linear import Face, height
from fe.linear.load import spread
from fe.plate.plate import Plate, Touch
from fe.reduced.karman import Deflected, Karman

_BALANCED = 1e-5  # of the load: less than any image shows
_NEAR, _LIKE = 40.0, 2.0  # mm, and ratio of forces, within which a touch is like another


@dataclass(frozen=True, eq=False)
class WholePlate:
    """The plate of von Kármán and Marguerre on its whole mesh, read at points of a face.

    No modes, no training and no tables: reduced plates are compared with it. A load takes tenths
    of a second, its linear part a millisecond.

    Attributes
    ----------
    plate : Plate
        With its tension, its shape at rest and its springs.
    mesh : Mesh
    points : (K, 2) float64, mm
        Where it is read.
    face : {"top", "middle", "bottom"}
    """

    plate: Plate
    mesh: Mesh
    points: F64
    face: Face = "top"

    def prepare(self) -> None:
        """Factor what all loads need.

        Raises
        ------
        ValueError
            The plate buckles under its tension, or its edges are too soft.
        """
        self._karman.prepare()

    @cached_property
    def at_rest(self) -> F64:
        """Displacement (K, 3) mm, from a flat plate to the shape at rest."""
        raised = rise(self.plate, self.mesh)
        return self._bent(raised) if np.any(raised) else np.zeros((len(self.points), 3))

    def linear(self, touches: Sequence[Touch]) -> F64:
        """Displacement (K, 3) mm from rest by the theory of small deflections, u, v and w."""
        return self._bent(self._karman.linear.solve(self._loads(touches)))

    def pressed(self, touches: Sequence[Touch]) -> F64:
        """Displacement (K, 3) mm from rest, u, v and w.

        Raises
        ------
        ValueError
            A touch lies outside the plate, or no balance of forces is found.
        """
        return next(self.pressed_in_turn([touches]))

    def pressed_in_turn(self, sequence: Iterable[Sequence[Touch]]) -> Iterator[F64]:
        """Yield `pressed` for one load after the other; those that are like the last take less.

        Raises
        ------
        ValueError
            As `pressed`.
        """
        before, rest = tuple[Touch, ...](), None
        for touches in sequence:
            if not touches:
                yield np.zeros((len(self.points), 3))
                continue
            state, linear = self._balanced(touches, rest if _alike(before, touches) else None)
            before, rest = tuple(touches), state.values - linear
            yield self._moved(state)

    def _balanced(self, touches: Sequence[Touch], rest: F64 | None) -> tuple[Deflected, F64]:
        """State under touches and its linear part; `rest` is what a state like it has beside."""
        loads = self._loads(touches)
        linear = self._karman.linear.solve(loads)
        starts = [None] if rest is None else [linear + rest, None]
        for start in starts:
            state = self._karman.solve(loads, _BALANCED, start)
            if state.residual <= _BALANCED:
                return state, linear
        raise ValueError(
            f"plate finds no balance of forces under {sum(t.force for t in touches):.3g} N; press"
            " less"
        )

    def _moved(self, state: Deflected) -> F64:
        moved = self._bent(state.values)
        for axis, along in enumerate(state.plane.values):
            moved[:, axis] += self._value.of(along)[:, 0]
        return moved

    @cached_property
    def _karman(self) -> Karman:
        return Karman(self.plate, self.mesh)

    @cached_property
    def _value(self) -> Functional:
        return derivative(self.mesh, self.points)

    @cached_property
    def _slopes(self) -> tuple[Functional, Functional]:
        return derivative(self.mesh, self.points, 1, 0), derivative(self.mesh, self.points, 0, 1)

    @cached_property
    def _height(self) -> F64:
        return height(self.plate, self.points, self.face)

    def _bent(self, values: F64) -> F64:
        """Move the face by a deflection: normals stay straight and normal (Kirchhoff)."""
        along_x, along_y = (-self._height * slope.of(values)[:, 0] for slope in self._slopes)
        return np.column_stack([along_x, along_y, self._value.of(values)[:, 0]])

    def _loads(self, touches: Sequence[Touch]) -> F64:
        xy, along_z, _ = spread(self.plate, self.mesh, touches)
        loads = np.zeros((*self.mesh.shape, 1))
        derivative(self.mesh, xy).add_to(loads, along_z, np.zeros(len(xy), dtype=np.int64))
        return loads


def _alike(before: Sequence[Touch], touches: Sequence[Touch]) -> bool:
    """Whether a state is a start for another."""
    return len(before) == len(touches) and all(
        hypot(one.x - other.x, one.y - other.y) < _NEAR
        and max(one.force, other.force) < _LIKE * min(one.force, other.force)
        for one, other in zip(before, touches, strict=True)
    )
