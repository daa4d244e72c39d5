"""The score of a touch net: drawn measurements of its bench, read by the net and by the solver."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

from rig.commands.output import emit
from rig.training.touch_net_score import (
    NumberScore,
    TouchReading,
    bench_of,
    draw_readings,
    flat,
    forward_of,
    number_ranks,
    number_score,
    ranks,
)
from rig.training.touch_nets import MAX_TOUCHES

if TYPE_CHECKING:
    from rich.table import Table

SAMPLES = 300
"""Measurements of each number of touches."""

SEED = 1


def score_touch_net(path: Path, report: Callable[[int, int], None], as_json: bool) -> None:
    """Score a touch net and print it.

    Raises
    ------
    OSError
        There is no such file.
    ValueError
        It is damaged, or names no bench.
    """
    from models import load_touch_net

    net = load_touch_net(path)
    scene = bench_of(net, path)
    forward, readings, rows = forward_of(scene), list[TouchReading](), list[NumberScore]()
    for number in range(MAX_TOUCHES + 1):
        report(number, MAX_TOUCHES + 1)
        found = draw_readings(net, forward, number, SAMPLES, SEED)
        rows.append(number_score(found))
        readings += found
    report(MAX_TOUCHES + 1, MAX_TOUCHES + 1)
    ranked = ranks(readings, SEED)
    p_values = {name: flat(column) for name, column in zip("xyF", ranked.T, strict=True)}
    p_values["number"] = flat(number_ranks(readings, SEED))
    said = {
        "model": str(path),
        "numbers": [asdict(row) for row in rows],
        "p_of_ranks": p_values,
        "ranked": len(ranked),
    }
    emit(_table(scene.title, rows, p_values), said, as_json)


def _table(title: str, rows: list[NumberScore], p_values: dict[str, float]) -> Table:
    from rich.table import Table

    flatness = ", ".join(f"{name} {value:.2g}" for name, value in p_values.items())
    caption = f"p of χ² that the truth lies evenly in what is stated: {flatness}"
    columns = ["touches", "drawn", "count right", "of the solver", "unknown", "RMS mm", "÷ bound"]
    shown = Table(*columns, "÷ bound, solver", title=title, caption=caption)
    for row in rows:
        figures = (row.rms, row.over_bound, row.solver_over_bound)
        shown.add_row(
            str(row.touches),
            str(row.samples),
            *(f"{part:.1%}" for part in (row.right, row.solver_right, row.unknown)),
            *("–" if figure is None else f"{figure:.3g}" for figure in figures),
        )
    return shown
