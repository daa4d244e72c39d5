"""The command line that every study of the report has, and what their figures share.

A study is a program: ``python -m rig.studies.plates.run_time [PART ...] [--figures FILE]`` runs the
parts named, all of them if none is, prints each figure as it comes, and keeps them as CSV. One that
needs images of others takes ``--data FOLDER`` as well.
"""

import argparse
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from rig.report.figure import Bar, Figure, write
from rig.report.page import PLOTS

Part = Callable[[], Iterator[Figure]]
Number = float | str | None
Cell = (
    Number
    | tuple[Number, str]
    | tuple[Number, str, Bar | None]
    | tuple[Number, str, Bar | None, int]
)
"""A value; or with its unit; or with its bar as well, and how many samples it sums up."""
Result = TypeVar("Result")


def run(parts: Mapping[str, Part], description: str | None) -> None:
    """Run the parts that the command line names."""
    _run(parts, _parser(parts, description).parse_args())


def run_drawn(parts: Mapping[str, Callable[[Path], Iterator[Figure]]], text: str | None) -> None:
    """Run the parts that the command line names, each with the folder that it draws into.

    That is the folder of plots of the report, or results/plots where no figures are kept.
    """
    given = _parser(parts, text).parse_args()
    folder = given.figures.absolute().parents[1] / PLOTS if given.figures else Path("results/plots")
    folder.mkdir(parents=True, exist_ok=True)
    _run({name: partial(part, folder) for name, part in parts.items()}, given)


def run_on_data(
    parts: Mapping[str, Callable[[Path], Iterator[Figure]]], description: str | None
) -> None:
    """Run the parts that the command line names on the folder of data that it names."""
    parser = _parser(parts, description)
    parser.add_argument("--data", type=Path, metavar="FOLDER", required=True)
    given = parser.parse_args()
    _run({name: partial(part, given.data) for name, part in parts.items()}, given)


def _parser(parts: Iterable[str], description: str | None) -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description=(description or "").partition("\n")[0])
    parser.add_argument("parts", nargs="*", metavar="PART", help=f"of {', '.join(parts)}")
    parser.add_argument("--figures", type=Path, metavar="FILE", help="keep the figures as CSV")
    return parser


def _run(parts: Mapping[str, Part], given: argparse.Namespace) -> None:
    for name in given.parts:
        if name not in parts:
            sys.exit(f"there is no part '{name}'; there are {', '.join(parts)}")
    found = _printed(parts[name] for name in given.parts or parts)
    if given.figures:
        write(given.figures, found)
    else:
        for _ in found:
            pass


def _printed(parts: Iterable[Part]) -> Iterator[Figure]:
    for part in parts:
        for figure in part():
            bar = f"   {figure.bar}: {figure.verdict}" if figure.bar else ""
            print(f"{figure.case:<50s} {figure.quantity:<22s} {figure.text}{bar}", flush=True)
            yield figure


def line(table: str, case: str, **cells: Cell) -> Iterator[Figure]:
    """Make the figures of one line, a column a cell.

    An underscore in the name of a column stands for a blank.
    """
    for name, cell in cells.items():
        parts: tuple[Any, ...] = cell if isinstance(cell, tuple) else (cell,)
        yield Figure(table, case, name.replace("_", " "), *parts)


def cpu_seconds(work: Callable[[], object], times: int = 1) -> float:
    """Median CPU time of some runs, s."""
    return float(np.median(cpu_times(work, times)))


def cpu_times(work: Callable[[], object], times: int) -> list[float]:
    """CPU time of each of some runs, s."""
    taken: list[float] = []
    for _ in range(times):
        began = time.process_time()
        work()
        taken.append(time.process_time() - began)
    return taken


def timed(work: Callable[[], Result]) -> tuple[Result, float]:
    """Do some work; its time on the processor, ms, in which others on the machine do not count."""
    began = time.thread_time()
    result = work()
    return result, 1e3 * (time.thread_time() - began)


def times(found: Iterable[float], bar: Bar | None = None) -> dict[str, Cell]:
    """Make cells of some times, ms: the median, which may have a bar, and the range of 9 in 10."""
    early, middle, late = np.percentile(list(found), (5, 50, 95))
    return {"median": (float(middle), "ms", bar), "5_%": (early, "ms"), "95_%": (late, "ms")}


def rms(values: ArrayLike) -> float:
    """Root mean square of all values."""
    return float(np.sqrt(np.mean(np.square(values))))


def part(named: Result | None) -> Result:
    """Return a part that a shipped scene names."""
    if named is None:
        raise ValueError("the scene does not name a part that this study needs")
    return named
