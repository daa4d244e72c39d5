"""Touches of a run as a table: one row a frame and touch, and one for a frame without.

A tap on a plate that is followed in time has a row of its own once it has ended, with the result
`TAP`: its largest force, empty where too few frames saw it, and what that has surely exceeded.
"""

from __future__ import annotations

import csv
from collections.abc import Generator, Iterator
from contextlib import contextmanager
from math import isnan
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rig.recording.fit import COLUMNS as FIT, fit_cells
from rig.recording.paths import require_absent

if TYPE_CHECKING:
    from models import Tap
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
    *FIT,
    "force_low_n",
    "force_high_n",
)
TABLE = "table of touches"
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
        fit = fit_cells(snapshot.estimate, snapshot.status)
        for row, bounds in zip(_rows(snapshot), _bounds(snapshot), strict=True):
            self._writer.writerow([snapshot.sequence, time, *row, *fit, *bounds])
        for tap in snapshot.taps:
            row = _tap(tap, tap.time - self._first)
            self._writer.writerow([snapshot.sequence, *row])


@contextmanager
def open_touches(path: Path) -> Generator[TouchesCsv]:
    """Open a new file for the touches of a run.

    Raises
    ------
    OSError
        If there is such a file already, or it cannot be written.
    """
    require_absent(path, TABLE)
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("w", newline="", encoding="utf-8") as file:
        yield TouchesCsv(csv.writer(file))


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


def _bounds(snapshot: Snapshot) -> Iterator[list[str]]:
    """Yield bounds of 95 % of each force where they are not even; empty cells elsewhere."""
    if not snapshot.estimate or not snapshot.estimate.count:
        yield [""] * 2
        return
    for one in snapshot.estimate.force_intervals or (None,) * snapshot.estimate.count:
        yield [""] * 2 if one is None else [f"{bound:.6g}" for bound in one.level_95]


def _tap(tap: Tap, time: float) -> list[str]:
    """Write a tap that ended, from its time on, s since the first frame."""
    place = f"{tap.x:.6f}", f"{tap.y:.6f}", "" if isnan(tap.force) else f"{tap.force:.6f}"
    xx, yy, ff = (f"{sigma**2:.6g}" for sigma in tap.sigma)
    said = "TAP", "", "", "a tap has ended", f"{tap.at_least:.6g}", ""
    return [f"{time:.6f}", "", *place, xx, "", "", yy, "", ff, *said]
