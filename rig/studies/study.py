"""The command line that every study of the report has, and what their figures share.

A study is a program: ``python benchmarks/study_plates.py [PART ...] [--figures FILE]`` runs the
parts named, all of them if none is, prints each figure as it comes, and keeps them as CSV.
"""

import argparse
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

import numpy as np

from rig.report.figure import Figure, write

Part = Callable[[], Iterator[Figure]]


def run(parts: Mapping[str, Part], description: str | None) -> None:
    """Run the parts that the command line names."""
    parser = argparse.ArgumentParser(description=(description or "").partition("\n")[0])
    parser.add_argument("parts", nargs="*", metavar="PART", help=f"of {', '.join(parts)}")
    parser.add_argument("--figures", type=Path, metavar="FILE", help="keep the figures as CSV")
    told = parser.parse_args()
    for name in told.parts:
        if name not in parts:
            parser.error(f"there is no part '{name}'; there are {', '.join(parts)}")
    found = _printed(parts[name] for name in told.parts or parts)
    if told.figures:
        write(told.figures, found)
    else:
        for _ in found:
            pass


def _printed(parts: Iterator[Part]) -> Iterator[Figure]:
    for part in parts:
        for figure in part():
            bar = f"   bar {figure.bar}: {figure.verdict}" if figure.bar else ""
            value = f"{figure.value} {figure.unit}".strip()
            print(f"{figure.case:<44s} {figure.quantity:<28s} {value}{bar}", file=sys.stdout)
            sys.stdout.flush()
            yield figure


def line(table: str, case: str, **cells: str | tuple[str, str]) -> Iterator[Figure]:
    """Make the figures of one line; a cell is a value, or a value and its unit.

    An underscore in the name of a column stands for a blank.
    """
    for name, cell in cells.items():
        value, unit = (cell, "") if isinstance(cell, str) else cell
        yield Figure(table, case, name.replace("_", " "), value, unit)


def cpu_seconds(run: Callable[[], object], times: int = 1) -> float:
    """Median CPU time of some runs, s."""
    taken = []
    for _ in range(times):
        began = time.process_time()
        run()
        taken.append(time.process_time() - began)
    return float(np.median(taken))
