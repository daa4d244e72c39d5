"""Touches of a run as a table: one row a frame and touch, and one for a frame without."""

from __future__ import annotations

import csv
from collections.abc import Generator, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from models import Estimate
    from rig.live.snapshot import Snapshot

COLUMNS = (
    "frame",
    "time_s",
    "touch",
    "x_mm",
    "y_mm",
    "force_n",
    "cov_xx",
    "cov_xy",
    "cov_xf",
    "cov_yy",
    "cov_yf",
    "cov_ff",
    "result",
    "p_value",
    "chi2_per_dof",
    "sentence",
)
_UPPER = np.triu_indices(3)


class TouchesCsv:
    """Writes what was estimated of every frame.

    Parameters
    ----------
    writer : csv.writer
        That of an open file.
    """

    def __init__(self, writer: Any):
        self._writer = writer
        self._first: float | None = None
        writer.writerow(COLUMNS)

    def __call__(self, snapshot: Snapshot) -> None:
        """Write the rows of a frame; one that stands for the last one has none."""
        if not snapshot.fresh or snapshot.estimate is None:
            return
        self._first = snapshot.captured if self._first is None else self._first
        time = f"{snapshot.captured - self._first:.6f}"
        said = _said(snapshot.estimate, snapshot.status)
        for row in _rows(snapshot):
            self._writer.writerow([snapshot.sequence, time, *row, *said])


@contextmanager
def open_touches(path: Path) -> Generator[TouchesCsv]:
    """Open a new file for the touches of a run.

    Raises
    ------
    OSError
        If it cannot be written.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("w", newline="", encoding="utf-8") as file:
        yield TouchesCsv(csv.writer(file))


def _said(estimate: Estimate, sentence: str) -> list[str]:
    fit = f"{estimate.p_value:.6g}", f"{estimate.chi2 / estimate.dof:.6g}"
    return [estimate.result.name, *fit, sentence]


def _rows(snapshot: Snapshot) -> Iterator[list[str]]:
    """Yield number, place, force and covariance of each touch; empty cells where there is none."""
    estimate = snapshot.estimate
    if estimate is None or not estimate.count:
        yield [""] * 10
        return
    for index, mark in enumerate(snapshot.touches):
        name = index if mark.identity is None else mark.identity
        x, y = estimate.xy[index].tolist()
        place = f"{x:.6f}", f"{y:.6f}", f"{estimate.force[index]:.6f}"
        spread = estimate.touch_covariance(index)[_UPPER]
        yield [str(name), *place, *(f"{value:.6g}" for value in spread)]
