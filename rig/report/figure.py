"""A figure that a study found, and the CSV file that carries figures to the report."""

from __future__ import annotations

import csv
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import NamedTuple


class Figure(NamedTuple):
    """One figure of one case of a table.

    Attributes
    ----------
    table : str
        Title of the table that it stands in.
    case : str
        The line: a setting, a scene, a kind of load.
    quantity : str
        The column. A table with the columns "time" and "error" is drawn as well.
    value : str
        As it is to be read: a number with the digits that hold, or a sentence.
    unit : str
        Of the number; empty for a sentence and where there is none.
    bar : str
        What it should reach, "≤ 0.5"; empty where nothing is asked.
    verdict : str
        "met" or "missed"; empty without a bar.
    """

    table: str
    case: str
    quantity: str
    value: str
    unit: str = ""
    bar: str = ""
    verdict: str = ""


def judged(figure: Figure, number: float, most: float, text: str = "") -> Figure:
    """Return the figure with the bar "≤ most" and its verdict; `text` is the bar in words."""
    verdict = "met" if number <= most else "missed"
    return figure._replace(bar=text or f"≤ {most:g}", verdict=verdict)


def write(path: Path, figures: Iterable[Figure]) -> None:
    """Write figures as they come, each line at once, so that a study cut short leaves its own."""
    with path.open("w", newline="", encoding="utf-8", buffering=1) as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(Figure._fields)
        for figure in figures:
            table.writerow(figure)


def read(path: Path) -> Iterator[Figure]:
    """Read the figures of a file; none where there is no file.

    Raises
    ------
    ValueError
        If it is not such a table.
    """
    if not path.exists():
        return
    with path.open(newline="", encoding="utf-8") as file:
        lines = csv.reader(file)
        if next(lines, None) != list(Figure._fields):
            raise ValueError(f"{path} must begin with the columns {', '.join(Figure._fields)}")
        for line in lines:
            if len(line) != len(Figure._fields):
                continue  # the last line of a study that was killed
            yield Figure(*line)
