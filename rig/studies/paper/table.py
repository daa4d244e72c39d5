"""Figures of the paper's systems, kept as CSV; the losses of a training on its way."""

import csv
from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

import numpy as np

RAW = Path("results/paper/paper.csv")
CURVES = Path("results/paper/curves.csv")


class Figure(NamedTuple):
    """One figure of one training.

    Attributes
    ----------
    system, what
        Which of the paper's systems, and which quantity with its unit.
    paper
        The paper's own figure, as it prints it; empty where it has none.
    epochs
        Steps of Adam; 0 where nothing was trained.
    seed, value
        Of this training.
    """

    system: str
    what: str
    paper: str
    epochs: int
    seed: int
    value: float


def store(figures: list[Figure]) -> None:
    """Add figures to those kept; of one system, quantity, effort and seed the last one stays."""
    known = {(kept.system, kept.what, kept.epochs, kept.seed): kept for kept in read()}
    known |= {(new.system, new.what, new.epochs, new.seed): new for new in figures}
    RAW.parent.mkdir(parents=True, exist_ok=True)
    with RAW.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(Figure._fields)
        writer.writerows(kept._replace(value=f"{kept.value:.6g}") for kept in known.values())


def read() -> list[Figure]:
    """Return the figures kept."""
    if not RAW.exists():
        return []
    with RAW.open(newline="", encoding="utf-8") as file:
        return [
            Figure(
                row["system"],
                row["what"],
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


def grouped(figures: Iterable[Figure]) -> dict[tuple[str, str], list[Figure]]:
    """Put the figures of all seeds of a system and quantity together."""
    groups: dict[tuple[str, str], list[Figure]] = {}
    for figure in figures:
        groups.setdefault((figure.system, figure.what), []).append(figure)
    return groups


def final() -> dict[tuple[str, str], list[Figure]]:
    """Return the figures kept by system and quantity, those of the most epochs of each."""
    groups = grouped(read())
    most = {group: max(figure.epochs for figure in groups[group]) for group in groups}
    return {
        group: [figure for figure in figures if figure.epochs == most[group]]
        for group, figures in groups.items()
    }


def spread(values: list[float]) -> str:
    """Median, and least and largest of several."""
    middle = f"{np.median(values):.3g}"
    if len(values) == 1:
        return middle
    return f"{middle} ({min(values):.3g} to {max(values):.3g})"
