"""Scripts of hands: what up to ten fingers do on a plate, and which gestures that makes."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from rig.live.gestures import Gesture
from rig.system.arrays import F64

RATE = 30.0  # frames a second
PLATE = (300.0, 240.0)  # mm
CELLS = [(x, y) for y in (60.0, 180.0) for x in (45.0, 115.0, 185.0, 255.0)]
PAIRS = (1, 6)  # cells with two fingers: ten in all
MOVERS = ("swipe", "", "pinch", "rotate")
LATE = 0.6  # s after its end by which a gesture is reported
Way = Callable[[float], F64]
"""x, y, force at a time from the landing on."""


@dataclass(frozen=True)
class Made:
    """One finger, or two, in a cell of the plate: what they do, from when to when."""

    kind: str  # empty where nothing shall be reported
    begin: float
    end: float
    fingers: tuple[Way, ...]
    cell: tuple[float, float]

    def at(self, now: float) -> list[F64]:
        """Return x, y, force of its fingers, (3,) each; none before and after."""
        there = self.begin <= now < self.end
        return [finger(now - self.begin) for finger in self.fingers] if there else []


def _path(start: F64, move: F64, force: float, lasts: float) -> Way:
    """Move evenly from a start by a way, (x, y) mm."""

    def at(age: float) -> F64:
        along = age / lasts
        soft = min(1.0, 4 * along + 0.3, 4 * (1 - along) + 0.3)
        return np.array([*(start + along * move), force * soft])

    return at


def tap(rng: np.random.Generator, cell: F64) -> tuple[float, tuple[Way, ...]]:
    """Touch briefly."""
    lasts = rng.uniform(0.1, 0.28)
    return lasts, (_path(cell, np.zeros(2), rng.uniform(0.5, 3), lasts),)


def hold(rng: np.random.Generator, cell: F64) -> tuple[float, tuple[Way, ...]]:
    """Rest."""
    lasts = rng.uniform(0.9, 1.8)
    return lasts, (_path(cell, rng.uniform(-1, 1, 2), rng.uniform(0.5, 3), lasts),)


def swipe(rng: np.random.Generator, cell: F64) -> tuple[float, tuple[Way, ...]]:
    """Slide off fast."""
    turn, far = rng.uniform(0, 2 * np.pi), rng.uniform(32, 45)
    move = far * np.array([np.cos(turn), np.sin(turn)])
    lasts = far / rng.uniform(150, 350)
    return lasts, (_path(cell - move / 2, move, rng.uniform(0.5, 2), lasts),)


def pinch(rng: np.random.Generator, cell: F64) -> tuple[float, tuple[Way, ...]]:
    """Bring two fingers together, or part them."""
    turn, lasts = rng.uniform(0, np.pi), rng.uniform(0.4, 0.9)
    out = np.array([np.cos(turn), np.sin(turn)])
    near, far = rng.uniform(9, 12), rng.uniform(20, 25)
    begin, end = (near, far) if rng.random() < 0.5 else (far, near)
    return lasts, tuple(
        _path(cell + sign * begin * out, sign * (end - begin) * out, rng.uniform(0.5, 2), lasts)
        for sign in (-1, 1)
    )


def rotate(rng: np.random.Generator, cell: F64) -> tuple[float, tuple[Way, ...]]:
    """Turn two fingers about their middle."""
    first, turn = rng.uniform(0, np.pi), rng.choice((-1, 1)) * rng.uniform(0.6, 1.2)
    radius, lasts = rng.uniform(16, 22), rng.uniform(0.5, 1.0)

    def at(sign: int, force: float, age: float) -> F64:
        angle = first + turn * age / lasts
        return np.array([*(cell + sign * radius * np.array([np.cos(angle), np.sin(angle)])), force])

    return lasts, tuple(partial(at, sign, rng.uniform(0.5, 2)) for sign in (-1, 1))


def hard_press(rng: np.random.Generator, cell: F64) -> tuple[float, tuple[Way, ...]]:
    """Rest, then press harder; the rest is a hold as well."""
    lasts, force, factor = rng.uniform(1.2, 2.0), rng.uniform(0.8, 1.5), rng.uniform(2.5, 3.5)

    def at(age: float) -> F64:
        harder = 1 + (factor - 1) * np.clip((age - 0.7) / 0.2, 0, 1)
        return np.array([*cell, force * harder])

    return lasts, (at,)


def slide(rng: np.random.Generator, cell: F64) -> tuple[float, tuple[Way, ...]]:
    """Slide slowly, which is no gesture."""
    turn, lasts = rng.uniform(0, 2 * np.pi), rng.uniform(0.8, 1.5)
    move = rng.uniform(25, 40) * np.array([np.cos(turn), np.sin(turn)])
    return lasts, (_path(cell - move / 2, move, rng.uniform(0.5, 2), lasts),)


KINDS = {
    "tap": tap, "hold": hold, "swipe": swipe, "pinch": pinch, "rotate": rotate,
    "hard press": hard_press, "": slide,
}  # fmt: skip


def script(rng: np.random.Generator, seconds: float) -> list[Made]:
    """Let both hands work in the cells of the plate, no more than ten fingers at a time."""
    made: list[Made] = []
    for index, cell in enumerate(CELLS):
        now = rng.uniform(0, 1)
        while now < seconds:
            kind = str(rng.choice(list(KINDS)))
            pair = kind in ("pinch", "rotate")
            if (pair and index not in PAIRS) or (kind in MOVERS and _crowded(made, now, cell)):
                kind = "tap"
            lasts, fingers = KINDS[kind](rng, np.array(cell))
            made.append(Made(kind, now, now + lasts, fingers, cell))
            now += lasts + rng.uniform(0.8, 1.6)
    return made


def _crowded(made: list[Made], now: float, cell: tuple[float, float]) -> bool:
    """Whether a neighbour sets out at the same time."""
    return any(
        one.kind in MOVERS
        and abs(one.begin - now) < 0.5
        and np.hypot(one.cell[0] - cell[0], one.cell[1] - cell[1]) < 100
        for one in made
    )


@dataclass
class Score:
    """Gestures that were made and those of them that were reported right, and others reported."""

    made: Counter[str] = field(default_factory=Counter[str])
    right: Counter[str] = field(default_factory=Counter[str])
    invented: int = 0

    def add(self, made: list[Made], reported: Iterable[Gesture]) -> None:
        """Compare what was reported with a script."""
        self.made += Counter(one.kind for one in made if one.kind)
        right: set[int] = set()
        for gesture in reported:
            index = _scripted(made, gesture)
            kind = made[index].kind if index is not None else ""
            if index is not None and index not in right and gesture.kind == kind:
                right.add(index)
            elif (kind, gesture.kind) != ("hard press", "hold"):  # it rests before it presses
                self.invented += 1
        self.right += Counter(made[index].kind for index in right)


def _scripted(made: list[Made], gesture: Gesture) -> int | None:
    """Return what was made where and when a gesture is reported."""
    at_work = {
        index: float(np.hypot(one.cell[0] - gesture.x, one.cell[1] - gesture.y))
        for index, one in enumerate(made)
        if one.begin <= gesture.time <= one.end + LATE
    }
    return min(at_work, key=lambda index: at_work[index], default=None)
