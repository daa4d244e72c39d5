"""What trainings of the paper's systems came to, kept as CSV; their losses on the way."""

import csv
from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

import numpy as np

from rig.report.figure import Bar

RAW = Path("results/paper/paper.csv")
CURVES = Path("results/paper/curves.csv")


class Sample(NamedTuple):
    """One quantity of one training.

    Attributes
    ----------
    system, what, unit
        Which of the paper's systems, and which quantity.
    paper
        The paper's own figure, as it prints it; empty where it has none.
    epochs
        Steps of Adam; 0 where nothing was trained.
    seed, value
        Of this training.
    bar
        What the median of the seeds should reach, if anything.
    """

    system: str
    what: str
    unit: str
    paper: str
    epochs: int
    seed: int
    value: float
    bar: Bar | None = None


KEPT = Sample._fields[:-1]


def store(samples: list[Sample]) -> None:
    """Add samples to those kept; of one system, quantity, effort and seed the last one stays."""
    known = {(kept.system, kept.what, kept.epochs, kept.seed): kept for kept in read()}
    known |= {(new.system, new.what, new.epochs, new.seed): new for new in samples}
    RAW.parent.mkdir(parents=True, exist_ok=True)
    with RAW.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(KEPT)
        writer.writerows(kept[: len(KEPT)] for kept in known.values())


def read() -> list[Sample]:
    """Return the samples kept."""
    if not RAW.exists():
        return []
    with RAW.open(newline="", encoding="utf-8") as file:
        return [
            Sample(
                row["system"],
                row["what"],
                row["unit"],
                row["paper"],
                int(row["epochs"]),
                int(row["seed"]),
                float(row["value"]),
            )
            for row in csv.DictReader(file)
        ]


class Point(NamedTuple):
    """Losses of a net of three touches on its way, mm (figure 4A)."""

    line: str
    epoch: int
    training: float
    validation: float


def store_curve(line: str, check: int, history: np.ndarray) -> None:
    """Keep the losses (checks, 2) of a training, one each `check` epochs, in the place of older."""
    points = [point for point in read_curves() if point.line != line]
    points += [
        Point(line, 1 + check * number, *losses) for number, losses in enumerate(history.tolist())
    ]
    CURVES.parent.mkdir(parents=True, exist_ok=True)
    with CURVES.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(Point._fields)
        for line, epoch, *losses in points:
            writer.writerow((line, epoch, *(f"{loss:.4g}" for loss in losses)))


def read_curves() -> list[Point]:
    """Return the losses kept."""
    if not CURVES.exists():
        return []
    with CURVES.open(newline="", encoding="utf-8") as file:
        rows = list(csv.reader(file))[1:]
    return [Point(line, int(epoch), *map(float, losses)) for line, epoch, *losses in rows]


def grouped(samples: Iterable[Sample]) -> dict[tuple[str, str], list[Sample]]:
    """Put the samples of all seeds of a system and quantity together."""
    groups: dict[tuple[str, str], list[Sample]] = {}
    for sample in samples:
        groups.setdefault((sample.system, sample.what), []).append(sample)
    return groups


def final() -> dict[tuple[str, str], list[Sample]]:
    """Return the samples kept by system and quantity, those of the most epochs of each."""
    groups = grouped(read())
    longest = {group: max(sample.epochs for sample in groups[group]) for group in groups}
    return {
        group: [sample for sample in samples if sample.epochs == longest[group]]
        for group, samples in groups.items()
    }
