"""Energy, forces and tangent of the shell, element by element; see `fe.shell.point`."""

# pyright: basic
# Kernels alone, which Numba types.

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fe.arrays import F64, I64
from fe.compiled import njit
from fe.shell.point import (
    basis,
    dot,
    geometric,
    law,
    material,
    placed,
    scaled,
    strains,
    total,
    variations,
)


class Rule(NamedTuple):
    """Elements with their quadrature, a plain tuple for the kernels.

    Attributes
    ----------
    x, y : (n, G, 3, 4) float64
        Derivatives of order 0, 1, 2 of the four functions of each element of a line at G points.
    weight_x, weight_y : (n, G) float64, mm
    membrane : (nx, ny) float64, N/mm
        E h / (1 - ν²).
    bending : (nx, ny) float64, N mm
        E h³ / 12 (1 - ν²).
    poisson : float
    tension : three of float, N/mm
        At rest: Nxx, Nyy, Nxy.
    rest : (nx, ny, G, G, 5) float64
        Derivatives x, y, xx, yy, xy of the height at rest at the points.
    """

    x: F64
    y: F64
    weight_x: F64
    weight_y: F64
    membrane: F64
    bending: F64
    poisson: float
    tension: tuple[float, float, float]
    rest: F64


# Orders by x and y of the five derivatives.
_ORDER_X = np.array([1, 0, 2, 0, 1])
_ORDER_Y = np.array([0, 1, 0, 2, 1])
# Number of a pair of components among the six.
_PAIR = np.array([[0, 1, 2], [1, 3, 4], [2, 4, 5]])


@njit(cache=True, nogil=True)
def forces(values: F64, rule: Rule) -> tuple[float, F64, F64]:
    """Energy of strain and of tension on all strain, and its gradient.

    Parameters
    ----------
    values : (2 nx + 2, 2 ny + 2, 3) float64, mm
        Unknowns of u, v, w.
    rule : Rule

    Returns
    -------
    energy : float, N mm
    gradient : like values, N
    size : like values, N
        Sum of the magnitudes of what each element adds: a measure for what is left over.
    """
    gradient, size = np.zeros(values.shape), np.zeros(values.shape)
    shapes, element = np.empty((5, 16)), np.empty((16, 3))
    stretch_rows, bend_rows = np.zeros((3, 15)), np.zeros((3, 15))
    energy = 0.0
    points = rule.weight_x.shape[1]
    for ex in range(rule.x.shape[0]):
        for ey in range(rule.y.shape[0]):
            element[:] = 0.0
            for gx in range(points):
                for gy in range(points):
                    weight = _shapes(rule, ex, ey, gx, gy, shapes)
                    change = _derivatives(values, ex, ey, shapes)
                    rest = rule.rest[ex, ey, gx, gy]
                    g = placed(change, rest)
                    at = basis(g)
                    strain, curvature = strains(change, rest, at.n)
                    stress = law(rule.membrane[ex, ey], rule.poisson, strain)
                    moment = law(rule.bending[ex, ey], rule.poisson, curvature)
                    energy += 0.5 * weight * dot(stress, strain)
                    energy += 0.5 * weight * dot(moment, curvature)
                    energy += weight * dot(rule.tension, strain)
                    stress = total(stress, rule.tension)
                    variations(g, at, stretch_rows, bend_rows)
                    _push(scaled(stress, weight), stretch_rows, shapes, element)
                    _push(scaled(moment, weight), bend_rows, shapes, element)
            for j in range(16):
                for c in range(3):
                    gradient[2 * ex + j // 4, 2 * ey + j % 4, c] += element[j, c]
                    size[2 * ex + j // 4, 2 * ey + j % 4, c] += abs(element[j, c])
    return energy, gradient, size


@njit(cache=True, nogil=True)
def stresses(values: F64, step: F64, rule: Rule) -> F64:
    """Membrane forces at the points, linear in the step: tension and those of E(U) + E'(U) step.

    Returns
    -------
    (nx, ny, G, G, 3) float64, N/mm
    """
    points = rule.weight_x.shape[1]
    out = np.empty((rule.x.shape[0], rule.y.shape[0], points, points, 3))
    shapes = np.empty((5, 16))
    for ex in range(out.shape[0]):
        for ey in range(out.shape[1]):
            for gx in range(points):
                for gy in range(points):
                    _shapes(rule, ex, ey, gx, gy, shapes)
                    change = _derivatives(values, ex, ey, shapes)
                    d = _derivatives(step, ex, ey, shapes)
                    rest = rule.rest[ex, ey, gx, gy]
                    at = basis(placed(change, rest))
                    strain, _ = strains(change, rest, at.n)
                    ahead = (
                        strain[0] + dot(at.a1, d[0]),
                        strain[1] + dot(at.a2, d[1]),
                        strain[2] + dot(at.a1, d[1]) + dot(at.a2, d[0]),
                    )
                    stress = law(rule.membrane[ex, ey], rule.poisson, ahead)
                    stress = total(stress, rule.tension)
                    for i in range(3):
                        out[ex, ey, gx, gy, i] = stress[i]
    return out


@njit(cache=True, nogil=True, fastmath=True)
def tangent(values: F64, stress: F64, rule: Rule, starts: I64, data: F64) -> None:
    """Add the second derivative of the energy to the data of a sparse matrix.

    Parameters
    ----------
    values : (2 nx + 2, 2 ny + 2, 3) float64, mm
    stress : (nx, ny, G, G, 3) float64, N/mm
        Membrane forces for the part that comes from the change of E'(U): see `stresses`.
    rule : Rule
    starts : (N + 1,) int64
        Row starts of the pattern of `fe.shell.elements`.
    data : (nonzeros,) float64, N/mm
        Changed in place.
    """
    points = rule.weight_x.shape[1]
    # Of all points of an element, so that one product of matrices gathers them.
    shapes, half = np.empty((points, points, 5, 16)), np.empty((points, points, 5, 6, 16))
    left, right = shapes.reshape(-1, 16), half.reshape(-1, 96)
    point, block = np.empty((15, 15)), np.empty((16, 96))
    stretch_rows, bend_rows = np.zeros((3, 15)), np.zeros((3, 15))
    for ex in range(rule.x.shape[0]):
        for ey in range(rule.y.shape[0]):
            for gx in range(points):
                for gy in range(points):
                    weight = _shapes(rule, ex, ey, gx, gy, shapes[gx, gy])
                    change = _derivatives(values, ex, ey, shapes[gx, gy])
                    rest = rule.rest[ex, ey, gx, gy]
                    g = placed(change, rest)
                    at = basis(g)
                    _, curvature = strains(change, rest, at.n)
                    moment = law(rule.bending[ex, ey], rule.poisson, curvature)
                    variations(g, at, stretch_rows, bend_rows)
                    point[:] = 0.0
                    material(rule.membrane[ex, ey] * weight, rule.poisson, stretch_rows, point)
                    material(rule.bending[ex, ey] * weight, rule.poisson, bend_rows, point)
                    geometric(weight, g, at, stress[ex, ey, gx, gy], moment, point)
                    _expand(point, shapes[gx, gy], half[gx, gy])
            np.dot(left.T, right, block)
            _scatter(block.reshape(16, 6, 16), ex, ey, starts, values.shape, data)


@njit(cache=True, nogil=True)
def _shapes(rule, ex, ey, gx, gy, shapes):
    """Fill the five derivatives of the 16 functions at a point; return its weight, mm²."""
    for d in range(5):
        x, y = rule.x[ex, gx, _ORDER_X[d]], rule.y[ey, gy, _ORDER_Y[d]]
        for i in range(4):
            for j in range(4):
                shapes[d, 4 * i + j] = x[i] * y[j]
    return rule.weight_x[ex, gx] * rule.weight_y[ey, gy]


@njit(cache=True, nogil=True, fastmath=True)
def _derivative(values, ex, ey, row):
    u, v, w = 0.0, 0.0, 0.0
    for i in range(4):
        for j in range(4):
            s = row[4 * i + j]
            u += s * values[2 * ex + i, 2 * ey + j, 0]
            v += s * values[2 * ex + i, 2 * ey + j, 1]
            w += s * values[2 * ex + i, 2 * ey + j, 2]
    return (u, v, w)


@njit(cache=True, nogil=True)
def _derivatives(values, ex, ey, shapes):
    return (
        _derivative(values, ex, ey, shapes[0]),
        _derivative(values, ex, ey, shapes[1]),
        _derivative(values, ex, ey, shapes[2]),
        _derivative(values, ex, ey, shapes[3]),
        _derivative(values, ex, ey, shapes[4]),
    )


@njit(cache=True, nogil=True, fastmath=True)
def _push(stress, rows, shapes, element):
    """Add the forces of stress on the 16 functions of each component."""
    for d in range(5):
        for c in range(3):
            k = 3 * d + c
            force = stress[0] * rows[0, k] + stress[1] * rows[1, k] + stress[2] * rows[2, k]
            for j in range(16):
                element[j, c] += force * shapes[d, j]


@njit(cache=True, nogil=True, fastmath=True)
def _expand(point, shapes, half):
    """Set half (5, 6, 16) to point times shapes, for the upper pairs of components."""
    pair = 0
    for c in range(3):
        for e in range(c, 3):
            for d in range(5):
                row = half[d, pair]
                row[:] = 0.0
                for f in range(5):
                    p = point[3 * d + c, 3 * f + e]
                    for j in range(16):
                        row[j] += p * shapes[f, j]
            pair += 1


@njit(cache=True, nogil=True)
def _scatter(block, ex, ey, starts, shape, data):
    """Add an element to the sparse matrix: each row holds a rectangle of the table, see pattern."""
    for i in range(16):
        row, column = 2 * ex + i // 4, 2 * ey + i % 4
        low_x, low_y = _low(row), _low(column)
        width = _low_end(column, shape[1]) - low_y
        for c in range(3):
            start = starts[3 * (row * shape[1] + column) + c]
            for j in range(16):
                place = (2 * ex + j // 4 - low_x) * width + 2 * ey + j % 4 - low_y
                for e in range(3):
                    pair = _PAIR[c, e]
                    value = block[i, pair, j] if c <= e else block[j, pair, i]
                    data[start + 3 * place + e] += value


@njit(cache=True, nogil=True, inline="always")
def _low(unknown):
    """First unknown of a line that shares an element with another."""
    return max(2 * (unknown // 2) - 2, 0)


@njit(cache=True, nogil=True, inline="always")
def _low_end(unknown, count):
    return min(2 * (unknown // 2) + 4, count)
