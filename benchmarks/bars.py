"""Rows of figures beside their bars: printed, and kept in docs/solver-figures.md."""

import re
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

PAGE = Path(__file__).parents[1] / "docs" / "solver-figures.md"

Row = tuple[str, str, str]  # what, figure, bar


@dataclass(frozen=True)
class Part:
    """Rows under a heading; `rows` takes the share of the scenes that are drawn."""

    heading: str
    rows: Callable[[float], Iterator[Row]]


def show(parts: dict[str, Part], command: str, arguments: Sequence[str]) -> None:
    """Print the parts named, all if none is, and write them to the page after ``--write``."""
    wanted = [name for name in arguments if not name.startswith("--")] or list(parts)
    for name in wanted:
        rows = []
        for row in parts[name].rows(0.05 if "--quick" in arguments else 1.0):
            print("{:56s} {:>44s}   bar {}".format(*row), flush=True)
            rows.append(row)
        if "--write" in arguments:
            options = " ".join(option for option in arguments if option.startswith("--"))
            write(parts[name].heading, f"python benchmarks/{command} {options} {name}", rows)


def write(heading: str, command: str, rows: Sequence[Row]) -> None:
    """Put a table in place of the one that stands under its heading."""
    head, *sections = re.split(r"^(?=## )", PAGE.read_text(encoding="utf-8"), flags=re.MULTILINE)
    lines = [f"## {heading}", "", f"`{command}`", "", "| | measured | bar |", "| --- | --- | --- |"]
    lines += ["| " + " | ".join(row) + " |" for row in rows]
    kept = {section.splitlines()[0]: section.strip() for section in sections}
    kept[lines[0]] = "\n".join(lines)
    PAGE.write_text("\n\n".join([head.strip(), *kept.values()]) + "\n", encoding="utf-8")


def beside(errors: Sequence, bounds: Sequence) -> str:
    """Root mean square of errors, and of each over its own bound: (scenes, n) mm each.

    The second weighs all scenes alike; in the first the few decide that hardly tell touches apart.
    """
    errors, bounds = np.asarray(errors), np.asarray(bounds)
    pooled = np.sqrt(np.mean(errors**2) / np.mean(bounds**2))
    each = np.sqrt(np.mean((errors / bounds) ** 2))
    return f"{np.sqrt(np.mean(errors**2)):.4f} mm, {each:.2f} bounds (pooled {pooled:.2f})"


def timed(work: Callable[..., Any], *given: Any, **named: Any) -> tuple[Any, float]:
    """Do some work; its time on the processor, ms, in which others on the machine do not count."""
    begun = time.thread_time()
    result = work(*given, **named)
    return result, 1e3 * (time.thread_time() - begun)


def times(found: Sequence[float]) -> str:
    """Median and spread of times, ms."""
    low, middle, high = np.percentile(found, (5, 50, 95))
    return f"{middle:.3g} ms ({low:.3g} to {high:.3g})"
