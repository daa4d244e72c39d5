"""The score of a net of displacement: drawn pairs, read by it and by the adaptive field."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from rig.commands.output import emit

if TYPE_CHECKING:
    from rich.table import Table

    from models import PairScore

PAIRS, SEED = 24, 104729
"""Pairs that are drawn, and a seed that no training has."""


def score_displacement_net(path: Path, report: Callable[[int, int], None], as_json: bool) -> None:
    """Score a net of displacement and print it.

    Raises
    ------
    ValueError
        Its file is damaged, or torch is not installed.
    """
    from models import load_displacement_net, score_pairs

    net = load_displacement_net(path)
    scores = score_pairs(net, PAIRS, SEED, time.thread_time, report)
    figures = _figures(scores)
    title = f"{path}: {len(scores)} drawn pairs, {figures['points']} points"
    said: dict[str, object] = {"model": str(path), "pairs": len(scores), **figures}
    emit(_table(title, figures), said, as_json)


def _figures(scores: list[PairScore]) -> dict[str, float]:
    """Rms error of u and v, px, and median time of a pair, s, of net and adaptive field."""
    points = max(sum(score.points for score in scores), 1)
    error, adaptive = (
        float(np.sqrt(sum(squares) / (2 * points)))
        for squares in zip(*((s.squares, s.adaptive_squares) for s in scores), strict=True)
    )
    return {
        "points": points,
        "error": error,
        "adaptive_error": adaptive,
        "ratio": error / adaptive,
        "by_net_fraction": sum(score.by_net for score in scores) / points,
        "seconds": float(np.median([score.seconds for score in scores])),
        "adaptive_seconds": float(np.median([score.adaptive_seconds for score in scores])),
    }


def _table(title: str, figures: Mapping[str, float]) -> Table:
    from rich.table import Table

    shown = Table(
        "field", "rms error, mpx", "÷ adaptive", "points of the net", "CPU ms a pair", title=title
    )
    for name, error, seconds, ratio, own in (
        ("net", "error", "seconds", f"{figures['ratio']:.3f}", f"{figures['by_net_fraction']:.1%}"),
        ("adaptive", "adaptive_error", "adaptive_seconds", "1", "–"),
    ):
        shown.add_row(
            name, f"{1e3 * figures[error]:.3g}", ratio, own, f"{1e3 * figures[seconds]:.0f}"
        )
    return shown
