"""Gestures of scripted hands: right, missed and invented.

Parts: some, all. Up to ten fingers of two hands at once, each with noise of 0.3 mm and 5 % of its
force, now and then missing for a frame, at 30 frames a second; the truth is the script. The fingers
get their identities from the tracker of the live loop. *Right* is one gesture of the kind that was
made, in its cell of the plate and within its time; *invented* is any other. Fingers that slide
slowly make none. Neighbours do not set out together: two such fingers are a pinch.
"""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial

import numpy as np

from models import Estimate, Result
from rig.live.gestures import Gesture, Gestures
from rig.live.tracks import Tracks
from rig.report.figure import Figure, at_least, at_most
from rig.studies.study import line, run
from rig.system.arrays import F64

RATE, SEED = 30.0, 8
NOISE, FORCE_NOISE, LOST = 0.3, 0.05, 0.02  # mm, of the force, and frames that miss a finger
PLATE = (300.0, 240.0)
CELLS = [(x, y) for y in (60.0, 180.0) for x in (45.0, 115.0, 185.0, 255.0)]
PAIRS = (1, 6)  # cells with two fingers: ten in all
MOVERS = ("swipe", "", "pinch", "rotate")
TABLE = "Scripted hands: tracker and gestures alone, on touches with noise"
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


def seen(made: list[Made], now: float, rng: np.random.Generator) -> Estimate:
    """Return what a frame shows."""
    rows: list[F64] = []
    for one in made:
        for finger in one.fingers if one.begin <= now < one.end else ():
            if rng.random() > LOST:
                x, y, force = finger(now - one.begin)
                noise = rng.normal(0, (NOISE, NOISE, FORCE_NOISE * force))
                rows.append(np.array([x, y, force]) + noise)
    touches = np.array(rows).reshape(-1, 3)
    touches = touches[np.lexsort((touches[:, 1], touches[:, 0]))]
    spread = np.diag(np.tile((NOISE**2, NOISE**2, 1e-3), len(rows)))
    result = Result.FOUND if rows else Result.NO_TOUCH
    return Estimate(touches[:, :2], touches[:, 2], spread, 0.0, 1, 1.0, result)


def reported(made: list[Made], seconds: float, seed: int) -> Iterator[Gesture]:
    """Follow a script frame by frame."""
    rng, tracks, gestures = np.random.default_rng(seed), Tracks(), Gestures()
    for number in range(round((seconds + 4) * RATE)):
        now = number / RATE
        estimate = seen(made, now, rng)
        tracks, identities, _ = tracks.follow(estimate, now)
        places = zip(identities, estimate.xy.tolist(), estimate.force.tolist(), strict=True)
        touches = [(identity, *place, force, NOISE) for identity, place, force in places]
        yield from gestures.follow(touches, now)


def scripted(made: list[Made], gesture: Gesture) -> int | None:
    """Return what was made where and when a gesture is reported."""
    at_work = {
        index: float(np.hypot(one.cell[0] - gesture.x, one.cell[1] - gesture.y))
        for index, one in enumerate(made)
        if one.begin <= gesture.time <= one.end + LATE
    }
    return min(at_work, key=lambda index: at_work[index], default=None)


def judged(seconds: float, seed: int) -> tuple[Counter[str], Counter[str], int]:
    """Count gestures that were made, those that were reported right, and others reported."""
    made = script(np.random.default_rng((SEED, seed)), seconds)
    total = Counter(one.kind for one in made if one.kind)
    right: set[int] = set()
    invented = 0
    for gesture in reported(made, seconds, seed):
        index = scripted(made, gesture)
        kind = made[index].kind if index is not None else ""
        if index is not None and index not in right and gesture.kind == kind:
            right.add(index)
        elif (kind, gesture.kind) != ("hard press", "hold"):  # it rests before it presses
            invented += 1
    return total, Counter(made[index].kind for index in right), invented


def hands(runs: int, seconds: float = 60.0) -> Iterator[Figure]:
    """Let scripted hands work for some minutes."""
    total: Counter[str] = Counter()
    right: Counter[str] = Counter()
    invented, began = 0, time.process_time()
    for seed in range(runs):
        made, good, other = judged(seconds, seed)
        total, right, invented = total + made, right + good, invented + other
    frames = runs * (seconds + 4) * RATE
    rate = frames / (time.process_time() - began)
    for kind in total:
        part = 100 * right[kind] / total[kind]
        yield from line(TABLE, kind, right=(part, "%", at_least(98), total[kind]))
    yield from line(
        TABLE,
        "all, ten fingers",
        right=(100 * right.total() / total.total(), "%", at_least(98), total.total()),
        invented=(invented, "", at_most(0), total.total()),
        rate=(rate, "frames/s", at_least(30)),
    )


PARTS = {"some": partial(hands, 2), "all": partial(hands, 20)}

if __name__ == "__main__":
    run(PARTS, __doc__)
