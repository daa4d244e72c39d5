"""What a lab does on a bench: presses of known force, then touches; as folders of images."""

from __future__ import annotations

import csv
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import numpy as np
from PIL import Image

import fe
from rig.calibration.bench_presses import COLUMNS
from rig.studies.real_bench.departure import READOUT, SAID, SCENE, RealBench
from rig.studies.real_bench.truth import Truth
from rig.system.arrays import F64, Grey

REFERENCES = 16
FRAMES = 12  # of a press
FORCES = (1.0, 2.0, 4.0)
EVERY = 5  # touches, after which the plate is left alone for a frame
LABEL = np.array([0.2, 0.2, 0.003])  # mm, mm, fraction by which a list of presses errs
MARGIN = 25.0  # mm


@dataclass(frozen=True)
class Touched:
    """A frame of the session and what touched the plate in it.

    Attributes
    ----------
    sequence : int
    touch : (3,) float64 or None, mm, mm, N
    """

    sequence: int
    touch: F64 | None


class Photographer(Protocol):
    """A bench that can be photographed; see `rig.studies.real_bench.truth.Truth`."""

    @property
    def seed(self) -> int: ...  # noqa: D102

    def reference(self, number: int) -> Grey: ...  # noqa: D102

    def held(  # noqa: D102
        self, touches: tuple[fe.Touch, ...], before: F64 | None, number: int
    ) -> Grey: ...

    def left(self, touches: tuple[fe.Touch, ...]) -> F64 | None: ...  # noqa: D102


def write_presses(truth: Photographer, folder: Path, count: int) -> Path:
    """Write images of the plate at rest and under `count` known presses, and the list of these."""
    rng, sides = np.random.default_rng((truth.seed, 1)), np.array(SAID.size)
    more = sides * (0.1 + 0.8 * rng.uniform(0.1, 0.9, (max(count - 9, 0), 2)))
    places = np.concatenate([nine_places(), more])[:count]
    return write_listed(truth, folder, np.column_stack([places, np.resize(FORCES, count)]), rng)


def write_listed(truth: Photographer, folder: Path, presses: F64, rng: np.random.Generator) -> Path:
    """Write images of the plate at rest and under presses (x, y, F), and a list that errs."""
    scale = [(1.0, 1.0, force) for force in presses[:, 2]]
    labels = presses + rng.normal(0.0, LABEL, presses.shape) * scale
    return _write_presses(truth, folder, presses, [tuple(label) for label in labels.tolist()])


def nine_places() -> F64:
    """Places of the first nine presses, three by three over the plate, (9, 2) mm."""
    fractions = np.array([(x, y) for y in (1, 3, 5) for x in (1, 3, 5)]) / 6.0
    return np.array(SAID.size) * (0.1 + 0.8 * fractions)


def write_ordinary(truth: Photographer, folder: Path, count: int) -> Path:
    """Write `count` touches of which nothing is known, and a weight of 2 N somewhere."""
    rng, sides = np.random.default_rng((truth.seed, 3)), np.array(SAID.size)
    places = rng.uniform(MARGIN, sides - MARGIN, (count + 1, 2))
    forces = np.append(rng.uniform(0.5, 4.0, count), 2.0)
    labels = [("", "", "")] * count + [("", "", 2.0)]
    return _write_presses(truth, folder, np.column_stack([places, forces]), labels)


def _write_presses(
    truth: Photographer, folder: Path, presses: F64, labels: Sequence[tuple[object, ...]]
) -> Path:
    """Write images at rest and of each press (x, y, F), and the list as the labels have it."""
    images, rows, before = references(truth), list[tuple[object, ...]](), None
    for press, ((x, y, force), label) in enumerate(zip(presses.tolist(), labels, strict=True)):
        touches, first = (fe.Touch(x, y, force),), len(images)
        images += [truth.held(touches, before, first + k) for k in range(FRAMES)]
        rows.append((press, first, first + FRAMES - 1, *label))
        before = truth.left(touches)
    write_images(folder, images)
    path = folder.with_suffix(".csv")
    with path.open("w", newline="", encoding="utf-8") as file:
        csv.writer(file).writerows([COLUMNS, *rows])
    return path


def write_touches(truth: Truth, folder: Path, count: int, alone: int = 1) -> list[Touched]:
    """Write images of the plate under one touch after the other, and `alone` of it in between."""
    rng, sides = np.random.default_rng((truth.seed, 2)), np.array(SAID.size)
    images, made, before = references(truth), list[Touched](), None
    for one in range(count):
        place, force = rng.uniform(MARGIN, sides - MARGIN), float(rng.uniform(0.5, 4.0))
        touches = (fe.Touch(float(place[0]), float(place[1]), force),)
        made.append(Touched(len(images), np.array([*place, force])))
        images.append(truth.photograph(touches, before, 10_000 + len(images)))
        before = truth.left(touches)
        for _ in range(alone if one % EVERY == EVERY - 1 else 0):
            made.append(Touched(len(images), None))
            images.append(truth.photograph((), before, 10_000 + len(images)))
    write_images(folder, images)
    return made


def write_scene(folder: Path, images: Path, bench: RealBench | None = None) -> Path:
    """Write the scene of a bench that reads the images of a folder."""
    said, path = bench or RealBench(), folder / "scene.toml"
    text = SCENE.format(
        folder=images,
        thickness=said.said_thickness,
        edges=said.said_edges,
        side="below" if said.below else "above",
        row_time=1e6 * READOUT / 30.0 / 1024 if said.rolling else 0.0,
    )
    path.write_text(text, encoding="utf-8")
    return path


def references(truth: Photographer) -> list[Grey]:
    """Photograph the plate at rest."""
    return [truth.reference(number) for number in range(REFERENCES)]


def write_images(folder: Path, images: list[Grey]) -> None:
    """Write images in the order of their numbers."""
    folder.mkdir(parents=True)
    for path, image in zip(_paths(folder), images, strict=False):
        Image.fromarray(image).save(path, compress_level=1)


def _paths(folder: Path) -> Iterator[Path]:
    number = 0
    while True:
        yield folder / f"{number:06d}.png"
        number += 1
