"""States of a whole plate along a script: solved at some times, interpolated between them.

A state is its linear part, which carries all that is singular under a touch and is exact at every
time, and a smooth rest that Newton's method has found at the nodes of Chebyshev's polynomials of
each piece of the script: from where a finger lands, leaves or turns to where the next one does.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from math import hypot

import numpy as np

import fe
from rig.sources.script import RAMP, ScriptedPress
from rig.system import cache
from rig.system.arrays import F32, F64

APART = 20.0  # mm that a touch moves from node to node: the stretching under it is as wide
FEWEST = 6  # nodes of a piece in which anything changes
SAME = 1e-9  # s

Pressed = Callable[[float], tuple[fe.Touch, ...]]
"""Touches at a time, s."""


@dataclass(frozen=True, eq=False)
class Piece:
    """A part of a script in which touches change smoothly.

    Attributes
    ----------
    start, end : float, s
    times : (n,) float64, s
        Of its nodes.
    """

    start: float
    end: float
    times: F64

    def weights(self, time: float) -> F64:
        """Weights (n,) of the states at the nodes for a time between them, barycentric."""
        away = time - self.times
        if (nearest := np.abs(away)).min() < SAME:
            return np.asarray(nearest == nearest.min(), dtype=np.float64)
        sign = (-1.0) ** np.arange(len(away))
        sign[[0, -1]] *= 0.5
        weights: F64 = sign / away
        return weights / weights.sum()


def pieces(presses: Sequence[ScriptedPress], size: tuple[float, float]) -> list[Piece]:
    """Cut a script where its presses have kinks, and place the nodes of each piece."""
    kinks = sorted({round(time, 9) for press in presses for time in _kinks(press)})
    found: list[Piece] = []
    for start, end in pairwise(kinks):
        acting = [press for press in presses if press.at(0.5 * (start + end), size)]
        if acting:
            count = max(_nodes(press, start, end, size) for press in acting)
            turns = np.pi * np.arange(count) / max(count - 1, 1)
            times = 0.5 * (start + end) - 0.5 * (end - start) * np.cos(turns)
            found.append(Piece(start, end, times))
    return found


def _kinks(press: ScriptedPress) -> list[float]:
    """List when a press lands, is down, turns, begins to leave and is gone, s."""
    legs = max(len(press.path) - 1, 1)
    turns = [press.duration * leg / legs for leg in range(legs + 1)]
    ages = [*turns, RAMP, press.duration - RAMP]
    return [press.start + age for age in ages]


def _rest(press: ScriptedPress) -> tuple[float, float]:
    """When a press begins to rest where it ends, and when it is gone, s."""
    end = press.start + press.duration
    return end if len(set(press.path)) > 1 else press.start, end


def _nodes(press: ScriptedPress, start: float, end: float, size: tuple[float, float]) -> int:
    """How many nodes a piece of a press needs: one where it rests."""
    inner = np.array([0.01, 0.5, 0.99]) * (end - start) + start
    touches = [touch for time in inner.tolist() if (touch := press.at(time, size))]
    first, last = touches[0], touches[-1]
    if first == last:
        return 1
    return FEWEST + round(hypot(last.x - first.x, last.y - first.y) / APART)


@dataclass(frozen=True, eq=False)
class Lasting:
    """What a press has moved where it ends.

    Attributes
    ----------
    rests : float, s
        Since when it presses where it ends, in the script: its end, where it glides there.
    end : float, s
        When it is gone.
    field : (K, 3) float64, mm
    """

    rests: float
    end: float
    field: F64


@dataclass(frozen=True, eq=False)
class ScriptedStates:
    """What a plate does along a script that starts again and again.

    Attributes
    ----------
    plate : fe.WholePlate
    pressed : callable
        Touches at a time of the script.
    length : float, s
        Of the script.
    parts : tuple of (Piece, (n, K, 3) float32)
        Displacement at the nodes less its linear part, mm.
    lasting : tuple of Lasting
        One for each press.
    """

    plate: fe.WholePlate
    pressed: Pressed
    length: float
    parts: tuple[tuple[Piece, F32], ...]
    lasting: tuple[Lasting, ...]

    def displacement(self, time: float, touches: tuple[fe.Touch, ...]) -> F64:
        """Displacement (K, 3) mm of the plate from rest under touches.

        Those of the script at that time are interpolated, any others solved.
        """
        if not touches:
            return np.zeros((len(self.plate.points), 3))
        within = time % self.length
        part = next((p for p in self.parts if p[0].start <= within <= p[0].end), None)
        if part is None or touches != self.pressed(time):
            return self.plate.pressed(touches)
        piece, rests = part
        return self.plate.linear(touches) + np.tensordot(piece.weights(within), rests, 1)


def scripted_states(
    plate: fe.WholePlate,
    presses: Sequence[ScriptedPress],
    pressed: Pressed,
    length: float,
    report: Callable[[int, int], None],
) -> ScriptedStates:
    """Solve a plate at all nodes of a script, or take what the cache has of it.

    Parameters
    ----------
    plate : fe.WholePlate
    presses : sequence of ScriptedPress
        What the script is made of.
    pressed : callable
        Touches at a time of the script, s.
    length : float, s
        After which it starts again.
    report : callable
        Called with how many of how many states are solved.
    """
    found = pieces(presses, plate.plate.size)
    nodes = [tuple(pressed(float(time)) for time in piece.times) for piece in found]
    ends = [_last(press, plate.plate.size) for press in presses]
    states = _solved(plate, [*(one for each in nodes for one in each), *ends], report)
    parts = [np.stack([states[touches] for touches in each]) for each in nodes]
    lasting = [
        Lasting(*_rest(press), plate.linear(touches) + states[touches])
        for press, touches in zip(presses, ends, strict=True)
    ]
    given = tuple(zip(found, parts, strict=True)), tuple(lasting)
    return ScriptedStates(plate, pressed, length, *given)


def _last(press: ScriptedPress, size: tuple[float, float]) -> tuple[fe.Touch, ...]:
    """Return a press alone where it ends, as hard as it was when it began to leave."""
    touch = press.at(press.start + press.duration - RAMP, size)
    if touch is None:
        return ()
    x, y = (fraction * side for fraction, side in zip(press.path[-1], size, strict=True))
    return (replace(touch, x=x, y=y),)


def _solved(
    plate: fe.WholePlate,
    wanted: Sequence[tuple[fe.Touch, ...]],
    report: Callable[[int, int], None],
) -> dict[tuple[fe.Touch, ...], F32]:
    """Displacement (K, 3) mm under touches less its linear part, from the cache where it is."""
    different = list(dict.fromkeys(touches for touches in wanted if touches))

    still = np.zeros((len(plate.points), 3), np.float32)
    if not different:
        return {(): still}

    def compute() -> cache.Arrays:
        report(0, len(different))
        plate.prepare()
        rests = np.empty((len(different), len(plate.points), 3), np.float32)
        for number, moved in enumerate(plate.pressed_in_turn(different)):
            rests[number] = moved - plate.linear(different[number])
            report(number + 1, len(different))
        return {"rests": rests}

    described = [[(t.x, t.y, t.force, t.radius) for t in touches] for touches in different]
    key = fe, plate.plate, plate.mesh.counts, plate.points, described
    rests = np.asarray(cache.fetch("states", key, compute)["rests"], np.float32)
    return {(): still} | dict(zip(different, rests, strict=True))
