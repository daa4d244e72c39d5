"""One side of the plate cut into elements."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fe.arrays import F64, I64


@dataclass(frozen=True, eq=False)
class Line:
    """Elements along one axis, equally long between breaks.

    Attributes
    ----------
    nodes : (n + 1,) float64, mm
        Ascending from 0.
    breaks : (s + 1,) int64
        Nodes at which the s runs of equal elements begin and end: 0, ..., n. A thickness may
        jump there, and then curvature jumps too.
    """

    nodes: F64
    breaks: I64

    @property
    def count(self) -> int:
        """Number of elements."""
        return len(self.nodes) - 1

    @property
    def unknowns(self) -> int:
        """Number of unknowns: a value and a slope at each node."""
        return 2 * len(self.nodes)

    @property
    def unit(self) -> float:
        """Mean length of an element, mm; unknowns of slope are slopes times this length."""
        return float(self.nodes[-1]) / self.count

    @property
    def runs(self) -> list[tuple[int, int]]:
        """First and last node of each run of equal elements."""
        return list(zip(self.breaks[:-1].tolist(), self.breaks[1:].tolist(), strict=True))

    def run_of(self, x: F64) -> I64:
        """Run (K,) in which each place lies; a break belongs to the run after it."""
        inner = self.nodes[self.breaks[1:-1]]
        return np.searchsorted(inner, x, side="right")


def divide(side: float, count: int, borders: tuple[float, ...], fewest: int) -> Line:
    """Divide a side so that borders fall on nodes.

    Parameters
    ----------
    side : float, mm
    count : int
        Elements in all, at least `fewest` for each run between borders.
    borders : tuple of float, mm
        Ascending, inside the side.
    fewest : int
        Elements that each run has at least.

    Returns
    -------
    Line
        Elements as equal as whole numbers allow.
    """
    lengths = np.diff([0.0, *borders, side])
    counts = np.full(len(lengths), fewest)
    for _ in range(count - counts.sum()):
        counts[np.argmax(lengths / counts)] += 1
    return cut(side, borders, counts.tolist())


def cut(side: float, borders: Sequence[float], counts: Sequence[int]) -> Line:
    """Cut a side into so many equal elements between one border and the next."""
    ends = [0.0, *borders, side]
    runs: list[F64] = [
        np.linspace(low, high, n, endpoint=False)
        for low, high, n in zip(ends[:-1], ends[1:], counts, strict=True)
    ]
    return Line(np.concatenate([*runs, [side]]), np.concatenate([[0], np.cumsum(counts)]))
