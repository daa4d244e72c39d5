"""What a bent plate does along a script of presses: solved at nodes, interpolated between them.

The whole shell is solved on elements of its own, at some bases on the way that the clamps take and
under some forces of each press. In between the displacement is a polynomial of both, which is exact
where a press rests on a base that does not move.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

import fe
import synthetic
from rig.sources.script import ScriptedPress
from rig.system import cache
from rig.system.arrays import F32, F64

ELEMENTS = 28  # along a side; what estimates has others
FORCES = (0.25, 0.75, 1.0)  # of a press, at which the plate is solved, beside none
BASES = 4  # on the way of the clamps, where they move

Report = Callable[[int, int], None]


@dataclass(frozen=True, eq=False)
class BaseWay:
    """The way that the clamps take: from one base to another.

    Attributes
    ----------
    first, last : fe.Base
    """

    first: fe.Base
    last: fe.Base

    @property
    def nodes(self) -> F64:
        """Fractions of the way at which the plate is solved: Chebyshev's, (S,)."""
        if self.first == self.last:
            return np.zeros(1)
        return 0.5 - 0.5 * np.cos(np.pi * np.arange(BASES) / (BASES - 1))

    def at(self, fraction: float) -> fe.Base:
        """Give the base after a fraction of the way."""
        return fe.Base(
            (1.0 - fraction) * self.first.bend + fraction * self.last.bend,
            (1.0 - fraction) * self.first.twist + fraction * self.last.twist,
        )


@dataclass(frozen=True, eq=False)
class BentStates:
    """Displacement of the points of a bent plate from the flat one.

    Attributes
    ----------
    way : BaseWay
    presses : tuple of fe.Touch
        Each as hard as it gets.
    fields : (S, 1 + 3 P, G, 3) float32, mm
        At each base without a touch, and then under `FORCES` of each press.
    """

    way: BaseWay
    presses: tuple[fe.Touch, ...]
    fields: F32

    def displacement(self, fraction: float, touches: Sequence[fe.Touch]) -> F64 | None:
        """Displacement (G, 3) mm on the way; None under touches that are none of the presses."""
        on_way = lagrange(self.way.nodes, fraction)
        if not touches:
            return np.tensordot(on_way, self.fields[:, 0], 1)
        if len(touches) > 1:
            return None
        number = next((k for k, press in enumerate(self.presses) if _same(press, touches[0])), None)
        if number is None:
            return None
        forces = lagrange(np.array([0.0, *FORCES]), touches[0].force / self.presses[number].force)
        first = 1 + len(FORCES) * number
        fields = self.fields[:, [0, *range(first, first + len(FORCES))]]
        return np.tensordot(np.outer(on_way, forces), fields, 2)


def lagrange(nodes: F64, at: float) -> F64:
    """Weights (n,) of the values at nodes for the polynomial through them."""
    others = nodes[:, None] - nodes + np.eye(len(nodes))
    ahead = at - nodes + np.zeros_like(others)
    np.fill_diagonal(ahead, 1.0)
    return np.asarray((ahead / others).prod(axis=1), dtype=np.float64)


def twin_shape(plate: fe.Plate, base: fe.Base, number: int) -> fe.ShellState:
    """Solve the stable shape of a base with a number, from 1, on the elements of the twin.

    Raises
    ------
    ValueError
        There are not so many, or the plate cannot take the base.
    """
    shapes = fe.base_shapes(plate, base, fe.even_grid(plate, ELEMENTS))
    if number > len(shapes):
        raise ValueError(
            f"source.shape is {number}, and a base of {base.bend:g} mm and {base.twist:g} degrees"
            f" has {len(shapes)} stable shapes; give one of them"
        )
    return shapes[number - 1].state


def bent_states(
    untouched: fe.ShellState,
    way: BaseWay,
    presses: Sequence[ScriptedPress],
    radius: float,
    points: F64,
    face: synthetic.Face,
    report: Report,
) -> BentStates:
    """Solve a plate at all nodes, or take what the cache has of it.

    Parameters
    ----------
    untouched : fe.ShellState
        On the first base.
    way : BaseWay
    presses : sequence of ScriptedPress
        Each rests at one place.
    radius : float, mm
        Of the disc that a touch presses.
    points : (G, 2) float64, mm
    face : {"top", "bottom"}
    report : callable
        Called with how many of how many states are solved.
    """
    size = untouched.plate.size
    touches = tuple(
        fe.Touch(press.path[0][0] * size[0], press.path[0][1] * size[1], press.force[0], radius)
        for press in presses
    )

    def compute() -> cache.Arrays:
        total = len(way.nodes) * (1 + len(FORCES) * len(touches))
        fields = np.empty((total, len(points), 3), np.float32)
        for number, state in enumerate(_solved(untouched, way, touches)):
            fields[number] = state.displacement(points, face)
            report(number + 1, total)
        return {"fields": fields.reshape(len(way.nodes), -1, len(points), 3)}

    described = [(t.x, t.y, t.force, t.radius) for t in touches]
    bases = [(base.bend, base.twist) for base in (way.first, way.last)]
    parts = fe, untouched.plate, untouched.values, bases, described, points, face
    kept = cache.fetch("bent-states", parts, compute)
    return BentStates(way, touches, np.asarray(kept["fields"], np.float32))


def _solved(
    untouched: fe.ShellState, way: BaseWay, touches: Sequence[fe.Touch]
) -> Iterator[fe.ShellState]:
    state = untouched
    for fraction in way.nodes.tolist():
        if fraction:
            state = untouched.shell.moved(state, way.at(fraction))
        yield state
        for touch in touches:
            for part in FORCES:
                pressed = fe.Touch(touch.x, touch.y, part * touch.force, touch.radius)
                yield state.touch([pressed])


def _same(press: fe.Touch, touch: fe.Touch) -> bool:
    return (press.x, press.y, press.radius) == (touch.x, touch.y, touch.radius)
