"""Gestures of scripted hands: right, missed and invented.

Parts: some, all (tracker and gestures alone, on touches with noise), loop (a minute of a twin
through the whole live loop), glimpse (ten seconds of that). Up to ten fingers of two hands at once
at 30 frames a second; the truth is the script. Without the loop each finger has noise of 0.3 mm and
5 % of its force, and is now and then missing for a frame; the fingers get their identities from the
tracker of the live loop. *Right* is one gesture of the kind that was made, in its cell of the plate
and within its time; *invented* is any other. Fingers that slide slowly make none. Neighbours do not
set out together: two such fingers are a pinch.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from functools import partial

import numpy as np

from models import Estimate, Result
from rig.live.gestures import Gesture, Gestures
from rig.live.tracks import Tracks
from rig.report.figure import Figure, at_least, at_most
from rig.studies.gestures.script import RATE, Made, Score, script
from rig.studies.gestures.whole_loop import follow_hands
from rig.studies.study import Cell, line, run
from rig.system.arrays import F64

SEED = 8
NOISE, FORCE_NOISE, LOST = 0.3, 0.05, 0.02  # mm, of the force, and frames that miss a finger
TABLE = "Scripted hands: tracker and gestures alone, on touches with noise"
WHOLE = "Scripted hands: the whole loop, from images of the twin"


def seen(made: list[Made], now: float, rng: np.random.Generator) -> Estimate:
    """Return what a frame shows."""
    rows: list[F64] = []
    for one in made:
        for x, y, force in one.at(now):
            if rng.random() > LOST:
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


def drawn(seconds: float, seed: int) -> list[Made]:
    """Draw the script of a seed."""
    return script(np.random.default_rng((SEED, seed)), seconds)


def hands(runs: int, seconds: float = 60.0) -> Iterator[Figure]:
    """Let scripted hands work for some minutes."""
    score, began = Score(), time.process_time()
    for seed in range(runs):
        made = drawn(seconds, seed)
        score.add(made, reported(made, seconds, seed))
    rate = runs * (seconds + 4) * RATE / (time.process_time() - began)
    for kind, made in score.made.items():
        part = 100 * score.right[kind] / made
        yield from line(TABLE, kind, right=(part, "%", at_least(98), made))
    yield from line(TABLE, "all, ten fingers", **_cells(score, rate))


def loop(seconds: float) -> Iterator[Figure]:
    """Let them work on the plate of a twin, whose images the live loop reads."""
    made, score = drawn(seconds, 0), Score()
    followed = follow_hands(made, seconds)
    score.add(made, followed.gestures)
    cells = _cells(score, followed.frames / followed.seconds)
    yield from line(WHOLE, f"ten fingers, {seconds:g} s", **cells)


def _cells(score: Score, rate: float) -> dict[str, Cell]:
    total = score.made.total()
    return {
        "right": (100 * score.right.total() / total, "%", at_least(98), total),
        "invented": (score.invented, "", at_most(0), total),
        "rate": (rate, "frames/s", at_least(30)),
    }


PARTS = {
    "some": partial(hands, 2),
    "all": partial(hands, 20),
    "loop": partial(loop, 60.0),
    "glimpse": partial(loop, 10.0),
}

if __name__ == "__main__":
    run(PARTS, __doc__)
