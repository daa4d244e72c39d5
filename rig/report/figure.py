"""A figure that a study found, its bar, and the CSV file that carries figures to the report."""

from __future__ import annotations

import csv
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from math import inf
from pathlib import Path
from typing import Literal, NamedTuple

Verdict = Literal["met", "missed", "not measured", ""]
DRAWING = "drawing"
"""Quantity of a figure that is no number: the name of an image in the folder of plots."""

COLUMNS = (
    "table", "case", "quantity", "value", "unit", "at_least", "at_most", "verdict", "samples",
)  # fmt: skip


class Bar(NamedTuple):
    """What a figure should reach, in its unit.

    Attributes
    ----------
    at_least, at_most : float
        Limits that still meet it; infinite where nothing is asked.
    """

    at_least: float = -inf
    at_most: float = inf

    def met_by(self, value: float) -> bool:
        """Whether a value reaches it; NaN reaches none."""
        return self.at_least <= value <= self.at_most

    def eases(self, other: Bar) -> bool:
        """Whether it lets a value pass that the other one does not."""
        return self.at_least < other.at_least or self.at_most > other.at_most

    def __str__(self) -> str:
        if self.at_least == -inf:
            return f"≤ {digits(self.at_most)}"
        if self.at_most == inf:
            return f"≥ {digits(self.at_least)}"
        return f"{digits(self.at_least)} to {digits(self.at_most)}"


def at_most(limit: float) -> Bar:
    """Return the bar that asks for no more."""
    return Bar(at_most=limit)


def at_least(limit: float) -> Bar:
    """Return the bar that asks for no less."""
    return Bar(at_least=limit)


@dataclass(frozen=True)
class Figure:
    """One figure of one case of a table.

    Attributes
    ----------
    table : str
        Title of the table that it stands in.
    case : str
        The line: a setting, a scene, a kind of load.
    quantity : str
        The column. A table with the columns "time" and "error" is drawn as well.
    value : float, str or None
        A number in `unit`; words where there is no number; None where it was not measured.
    unit : str
        Of value and bar; empty for words and where there is none.
    bar : Bar or None
        What it should reach, if anything.
    samples : int or None
        How many scenes, points or frames it sums up.

    Raises
    ------
    ValueError
        If there is a bar and the value is words.
    """

    table: str
    case: str
    quantity: str
    value: float | str | None
    unit: str = ""
    bar: Bar | None = None
    samples: int | None = None

    def __post_init__(self) -> None:
        if self.bar is not None and isinstance(self.value, str):
            raise ValueError(
                f"{self.case}: {self.quantity} has the bar {self.bar}, so its value must be a"
                f" number, got '{self.value}'"
            )

    @property
    def place(self) -> tuple[str, str, str]:
        """Where it stands: table, case and quantity."""
        return self.table, self.case, self.quantity

    @property
    def verdict(self) -> Verdict:
        """Outcome of its bar; empty without one."""
        if self.bar is None:
            return ""
        if self.value is None:
            return "not measured"
        return "met" if self.bar.met_by(float(self.value)) else "missed"

    @property
    def number(self) -> str:
        """The value as it is to be read, with as many digits as tell it from its bar."""
        if self.value is None:
            return "" if self.bar is None else "not measured"
        return self.value if isinstance(self.value, str) else digits(self.value, self.bar)

    @property
    def text(self) -> str:
        """The value as it is to be read, with its unit."""
        return f"{self.number} {self.unit}".strip() if self.value is not None else self.number

    @property
    def asked(self) -> str:
        """The bar with its unit; empty without one."""
        return f"{self.bar} {self.unit}".strip() if self.bar else ""


def drawing(table: str, case: str, file: str) -> Figure:
    """Return the line by which a study shows what it has drawn: a PNG in the folder of plots."""
    return Figure(table, case, DRAWING, file)


def digits(value: float, bar: Bar | None = None) -> str:
    """Write a number with three digits, more where they tell it from a limit of its bar."""
    limits = [limit for limit in bar or () if limit != value]
    for count in range(3, 17):
        text = _written(value, count)
        if float(text) not in limits:
            return text
    return repr(float(value))


def _written(value: float, count: int) -> str:
    if value == round(value, 0) and abs(value) < 1e7:
        return f"{value:.0f}"
    size = f"{value:.{count}g}"
    return f"{value:.0f}" if "e+" in size and abs(value) < 1e7 else size


def write(path: Path, figures: Iterable[Figure]) -> None:
    """Write figures as they come, each line at once, so that a study cut short leaves its own."""
    with path.open("w", newline="", encoding="utf-8", buffering=1) as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(COLUMNS)
        for figure in figures:
            table.writerow(_line(figure))


def _line(figure: Figure) -> list[str]:
    bar = figure.bar or Bar()
    limits = (None if abs(limit) == inf else limit for limit in bar)
    cells = [*figure.place, figure.value, figure.unit, *limits, figure.verdict, figure.samples]
    return [_cell(cell) for cell in cells]


def _cell(value: float | str | None) -> str:
    """Write every digit of a number, so that its verdict is the same when it is read."""
    if value is None:
        return ""
    if isinstance(value, str):
        return value
    whole = abs(value) < 1e15 and value == int(value)
    return str(int(value)) if whole else repr(float(value))


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
        if next(lines, None) != list(COLUMNS):
            raise ValueError(
                f"{path} must begin with the columns {', '.join(COLUMNS)}; a report of an older"
                " version has others, build it anew"
            )
        for line in lines:
            if len(line) != len(COLUMNS):
                continue  # the last line of a study that was killed
            yield _figure(line)


def _figure(line: list[str]) -> Figure:
    table, case, quantity, value, unit, low, high, _, samples = line
    bar = Bar(float(low or -inf), float(high or inf)) if low or high else None
    return Figure(
        table, case, quantity, _value(value), unit, bar, int(samples) if samples else None
    )


def _value(text: str) -> float | str | None:
    try:
        return float(text) if text else None
    except ValueError:
        return text
