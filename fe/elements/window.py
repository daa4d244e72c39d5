"""Means over a window of a line: what a gauge of some length reads."""

from __future__ import annotations

import numpy as np

from fe.arrays import F64
from fe.elements.hermite import HERMITE_DERIVATIVES, Stencil, hermite
from fe.elements.line import Line


def mean(x: F64, length: float, line: Line, order: int) -> Stencil:
    """Mean of a derivative over windows of a line.

    The mean of a derivative is the difference of the next lower one across the window, which the
    elements hold better than the derivative itself; the function is integrated exactly.

    Parameters
    ----------
    x : (K,) float64, mm
        Middles of the windows.
    length : float, mm
        Of the windows.
    line : Line
        Windows must lie on it.
    order : int
        0 to 3.

    Returns
    -------
    Stencil
        One window wide enough for all, weights in mm^-order.
    """
    low, high = x - length / 2, x + length / 2
    if order == 0:
        rows = (_integral(high, line) - _integral(low, line)) / length
    else:
        ends = [_rows(hermite(end, line, order - 1), line) for end in (low, high)]
        rows = (ends[1] - ends[0]) / length
    return _windows(rows)


def _integral(x: F64, line: Line) -> F64:
    """Rows (K, unknowns) of the integral from the start of the line to each place."""
    h = np.diff(line.nodes)
    element = np.clip(np.searchsorted(line.nodes, x, side="right") - 1, 0, line.count - 1)
    t = (x - line.nodes[element]) / h[element]
    powers = np.arange(4)
    scale = (h[:, None] / line.unit) ** (powers % 2) * h[:, None]
    whole = np.zeros((line.count + 1, line.unknowns))
    for e in range(line.count):
        whole[e + 1] = whole[e]
        whole[e + 1, 2 * e : 2 * e + 4] += scale[e] * (HERMITE_DERIVATIVES[0] @ (1 / (powers + 1)))
    part = t[:, None] ** (powers + 1) / (powers + 1) @ HERMITE_DERIVATIVES[0].T * scale[element]
    rows = whole[element]
    np.add.at(rows, (np.arange(len(x))[:, None], 2 * element[:, None] + powers), part)
    return rows


def _rows(stencil: Stencil, line: Line) -> F64:
    rows = np.zeros((len(stencil.start), line.unknowns))
    np.put_along_axis(rows, stencil.columns, stencil.weights, axis=1)
    return rows


def _windows(rows: F64) -> Stencil:
    """Narrowest stencil of one width that holds all rows (K, unknowns)."""
    used = rows != 0
    first = used.argmax(axis=1)
    last = rows.shape[1] - used[:, ::-1].argmax(axis=1)
    width = int((last - first).max(initial=1))
    start = np.minimum(first, rows.shape[1] - width)
    return Stencil(start, np.take_along_axis(rows, start[:, None] + np.arange(width), axis=1))
