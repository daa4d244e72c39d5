"""Fingers that rub along the plate, on a bench that is just as its scene says.

Parts: few (8 touches on each of three seeds), many (67). Beside its force into the plate every
touch pulls along x and along y by a normal deviate of a quarter of it. The scene says nothing of
that, or says `touches.friction = 0.25`. Truth is the shell with forces along its touched face,
photographed at 1024² with a noise of 2 grey levels.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property, partial
from pathlib import Path

import numpy as np

import fe
import rig
from rig.calibration.store import Calibration
from rig.live.bench import build_bench
from rig.live.loop import Loop
from rig.report.figure import Figure
from rig.scene import Scene
from rig.studies.real_bench.as_it_is import NONE, SEEDS, cells
from rig.studies.real_bench.departure import SAID, RealBench
from rig.studies.real_bench.frame_source import FrameSource
from rig.studies.real_bench.score import Score, compared, pooled
from rig.studies.real_bench.session import MARGIN, REFERENCES, Touched, write_scene
from rig.studies.real_bench.truth import Truth
from rig.studies.study import Cell, line, run
from rig.system.arrays import F64, Grey
from rig.system.frame import Frame

TABLE = "Fingers that rub"
FRICTION = 0.25
_ELEMENTS = 32
_INTERVAL = 1.0 / 30.0  # s


@dataclass(frozen=True, eq=False)
class Rubbed:
    """Images of a plate under fingers that rub.

    Attributes
    ----------
    seed : int
    count : int
        Touches, one an image.
    """

    seed: int
    count: int

    @cached_property
    def touches(self) -> F64:
        """What touches the plate, (n, 3) mm, mm, N."""
        rng, sides = np.random.default_rng((self.seed, 9)), np.array(SAID.size)
        places = rng.uniform(MARGIN, sides - MARGIN, (self.count, 2))
        return np.column_stack([places, rng.uniform(0.5, 4.0, self.count)])

    @property
    def made(self) -> list[Touched]:
        """In which image it does."""
        return [Touched(number, touch) for number, touch in enumerate(self.touches, REFERENCES)]

    @cached_property
    def images(self) -> list[Grey]:
        """The plate at rest, and then under each touch."""
        truth, flat = Truth(RealBench(), self.seed), fe.Shell(SAID, fe.grid(SAID, _ELEMENTS))
        at_rest, rng = flat.at(fe.Base()), np.random.default_rng((self.seed, 10))
        images = [truth.reference(number) for number in range(REFERENCES)]
        for number, touch in enumerate(self.touches, REFERENCES):
            along = FRICTION * touch[2] * rng.normal(size=2)
            moved = _moved(at_rest, touch, along).displacement(truth.later.points, "top")
            images.append(truth.image(moved, number))
        return images

    def frames(self) -> Iterator[Frame]:
        """Give the images with their times."""
        for number, image in enumerate(self.images):
            yield Frame(number, number * _INTERVAL, image)


def _moved(at_rest: fe.ShellState, touch: F64, along: F64) -> fe.ShellState:
    x, y, force = touch.tolist()
    return at_rest.touch([fe.Touch(x, y, force)]).apply([fe.FaceForce(x, y, *along.tolist())])


def rubbing(count: int) -> Iterator[Figure]:
    """Score touches that rub, with and without a word of it in the scene."""
    silent, said = list[Score](), list[Score]()
    with tempfile.TemporaryDirectory() as place:
        path = write_scene(Path(place), Path(place) / "touches")
        for seed in SEEDS:
            rubbed = Rubbed(seed, count)
            for friction, scores in ((0.0, silent), (FRICTION, said)):
                settings = {"estimator.bench": "exact", "touches.friction": friction}
                scores.append(_score(rig.load(path, settings), rubbed))
    silent_cells, said_cells = _cells(silent), _cells(said)
    yield from line(TABLE, "friction 0.25, the scene says nothing", **_unjudged(silent_cells))
    yield from line(TABLE, "friction 0.25, as the scene says", **said_cells)


def _score(scene: Scene, rubbed: Rubbed) -> Score:
    source = FrameSource(rubbed.frames(), "fingers that rub")
    bench = build_bench(scene, lambda done, total: None, Calibration())
    loop = Loop(bench, source, lambda: source.now)
    found = {one.sequence: one.estimate for one in loop if one.estimate is not None}
    return compared(found, rubbed.made, float("nan"))


def _cells(scores: list[Score]) -> dict[str, Cell]:
    seen = cells(pooled(scores), NONE)
    return {name: cell for name, cell in seen.items() if name not in ("frame", "false touches")}


def _unjudged(seen: dict[str, Cell]) -> dict[str, Cell]:
    """Take the bars of coverage out: σ knows nothing of what it does not hold."""
    return {name: _without_bar(cell) if "σ" in name else cell for name, cell in seen.items()}


def _without_bar(cell: Cell) -> Cell:
    return (*cell[:2], None, cell[3]) if isinstance(cell, tuple) and len(cell) == 4 else cell


PARTS = {"few": partial(rubbing, 8), "many": partial(rubbing, 67)}

if __name__ == "__main__":
    run(PARTS, __doc__)
