"""Rows of figures beside their bars, printed; `study_bars` puts them into the report."""

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

Row = tuple[str, str, str]  # what, figure, bar


@dataclass(frozen=True)
class Part:
    """Rows under a heading; `rows` takes the share of the scenes that are drawn."""

    heading: str
    rows: Callable[[float], Iterator[Row]]


def show(parts: dict[str, Part], arguments: Sequence[str]) -> None:
    """Print the parts named, all if none is; ``--quick`` draws a twentieth of the scenes."""
    wanted = [name for name in arguments if not name.startswith("--")] or list(parts)
    for name in wanted:
        for row in parts[name].rows(0.05 if "--quick" in arguments else 1.0):
            print("{:56s} {:>44s}   bar {}".format(*row), flush=True)


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
