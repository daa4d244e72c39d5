"""Measurements that are linear in force, as tables over the plate, read by compiled code.

A channel is a bicubic Hermite function of the place of a touch (see `fe.Adjoint`); channels come in
groups, each with a matrix that makes its noise white, and a few known patterns are set aside.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fe import HERMITE_DERIVATIVES
from models.arrays import F64
from models.compiled import njit


class ForwardTable(NamedTuple):
    """Everything that is needed to read m whitened measurements; all arrays are contiguous.

    Attributes
    ----------
    values : (2 nx + 2, 2 ny + 2, M c) float64
        Unknowns of M groups of c channels, per N.
    x, y : (nx + 1,), (ny + 1,) float64, mm
        Nodes.
    units : (2,) float64, mm
        Lengths by which the unknowns of slope are scaled.
    whitening : (M, d, c) float64
        From the channels of each group to d numbers of white noise, m = M d; rows of zeros for
        what is missing.
    aside : (k, m) float64
        Orthonormal rows: patterns of unknown size that may lie over the measurement.
    """

    values: F64
    x: F64
    y: F64
    units: F64
    whitening: F64
    aside: F64


@njit(cache=True, nogil=True)
def responses(table: ForwardTable, places: F64) -> F64:
    """Whitened response to 1 N at each place (n, 2), and its derivatives in x and y: (n, 3, m)."""
    groups, numbers, channels = table.whitening.shape
    raw = np.empty((3 * len(places), groups * channels))
    for n in range(len(places)):
        value, along_x, along_y = raw[3 * n], raw[3 * n + 1], raw[3 * n + 2]
        _read_channels(table, places[n, 0], places[n, 1], 1.0, value, along_x, along_y)
    return _whiten(table, raw).reshape(len(places), 3, groups * numbers)


@njit(cache=True, nogil=True)
def plain_responses(table: ForwardTable, places: F64) -> F64:
    """Whitened response to 1 N at each place (n, 2), without derivatives: (n, m)."""
    groups, _, channels = table.whitening.shape
    raw, read = np.empty((len(places), groups * channels)), np.empty((2, groups * channels))
    for n in range(len(places)):
        _read_channels(table, places[n, 0], places[n, 1], 1.0, raw[n], read[0], read[1])
    return _whiten(table, raw)


@njit(cache=True, nogil=True)
def read_touches(table: ForwardTable, touches: F64) -> tuple[F64, F64]:
    """Measurement (m,) under touches x, y, F, (n, 3), and its derivatives in them, (3 n, m)."""
    groups, _, channels = table.whitening.shape
    raw = np.empty((3 * len(touches), groups * channels))
    for n in range(len(touches)):
        x, y, force = touches[n]
        _read_channels(table, x, y, force, raw[3 * n + 2], raw[3 * n], raw[3 * n + 1])
    jacobian = _whiten(table, raw)
    return _total(touches, jacobian), jacobian


@njit(cache=True, nogil=True, fastmath=True)
def _total(touches: F64, jacobian: F64) -> F64:
    """Sum of what each touch (n, 3) shows by itself, of derivatives (3 n, m): (m,)."""
    total = np.zeros(jacobian.shape[1])
    for n in range(len(touches)):
        for k in range(len(total)):
            total[k] += touches[n, 2] * jacobian[3 * n + 2, k]
    return total


@njit(cache=True, nogil=True)
def _weights(place: float, nodes: F64, unit: float, weights: F64) -> int:
    """Fill weights of value and slope (2, 4); return the first unknown that they stand for."""
    element = np.searchsorted(nodes, place, side="right") - 1
    element = int(min(max(element, 0), nodes.size - 2))
    h = nodes[element + 1] - nodes[element]
    t = (place - nodes[element]) / h
    for order in range(2):
        for i in range(4):
            c = HERMITE_DERIVATIVES[order, i]
            scale = 1.0 if i % 2 == 0 else h / unit
            scale = scale / h if order == 1 else scale
            weights[order, i] = scale * (c[0] + t * (c[1] + t * (c[2] + t * c[3])))
    return 2 * element


@njit(cache=True, nogil=True, fastmath=True)
def _read_channels(
    table: ForwardTable,
    x: float,
    y: float,
    force: float,
    value: F64,
    along_x: F64,
    along_y: F64,
) -> None:
    """Fill value, and `force` times the slopes along x and y, of all channels at a place."""
    across, down = np.empty((2, 4)), np.empty((2, 4))
    first = _weights(x, table.x, table.units[0], across)
    start = _weights(y, table.y, table.units[1], down)
    a, b, c, d = down[0, 0], down[0, 1], down[0, 2], down[0, 3]
    slope_a, slope_b, slope_c, slope_d = down[1, 0], down[1, 1], down[1, 2], down[1, 3]
    value[:], along_x[:], along_y[:] = 0.0, 0.0, 0.0
    for i in range(4):
        value_x, slope_x, turn_x = across[0, i], force * across[1, i], force * across[0, i]
        unknown = table.values[first + i, start : start + 4]
        for k in range(len(value)):
            t, u, v, w = unknown[0, k], unknown[1, k], unknown[2, k], unknown[3, k]
            read = a * t + b * u + c * v + d * w
            slope = slope_a * t + slope_b * u + slope_c * v + slope_d * w
            value[k] += value_x * read
            along_x[k] += slope_x * read
            along_y[k] += turn_x * slope


@njit(cache=True, nogil=True)
def _whiten(table: ForwardTable, raw: F64) -> F64:
    """Put readings of all channels (n, M c) into units of their noise, (n, m), perhaps in place."""
    groups, numbers, _ = table.whitening.shape
    if groups == 1:
        found = raw @ table.whitening[0].T
    elif table.whitening.size == groups:
        found = _scale(table.whitening.reshape(groups), raw)
    else:
        found = np.empty((len(raw), groups * numbers))
        _whiten_groups(table.whitening, raw, found)
    if len(table.aside):
        found -= (found @ table.aside.T) @ table.aside
    return found


@njit(cache=True, nogil=True, fastmath=True)
def _scale(factors: F64, raw: F64) -> F64:
    """Multiply each row (n, m) by factors (m,), where it stands."""
    for part in range(len(raw)):
        for g in range(len(factors)):
            raw[part, g] *= factors[g]
    return raw


@njit(cache=True, nogil=True, fastmath=True)
def _whiten_groups(whitening: F64, raw: F64, white: F64) -> None:
    groups, numbers, channels = whitening.shape
    for part in range(len(raw)):
        for g in range(groups):
            for d in range(numbers):
                total = 0.0
                for c in range(channels):
                    total += whitening[g, d, c] * raw[part, g * channels + c]
                white[part, g * numbers + d] = total
