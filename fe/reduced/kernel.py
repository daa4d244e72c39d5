"""The inner loops of the balance: each form passes through the cache once.

A form of n fixed shapes and of the A functions that move with each of T touches is held as its
values on the fixed shapes (n, n), and for each touch as a row (L,): A n values on a moving function
and a fixed shape, then A (A + 1) / 2 on two that move with that touch; see `Forms.rows`. Functions
of two touches meet through their projections P on the fixed shapes:

    B(v, w) ≈ B(v, P w) + B(P v, w) - B(P v, P w)

which is off by B of what the projections leave: little, and about each touch.

Arguments that all have in common are

fixed : (F, n, n) float32 or float64, symmetric
rows : (T, 3, F, L) float64
    Value, d/dx and d/dy by the place of the touch; derivatives may be left out where none is asked.
projected : (T, 3, A, n) float64
    Moving functions on the fixed shapes, the same way.
weights : (n + T A,) float64
    z.
"""

from __future__ import annotations

import numpy as np

from fe.arrays import F32, F64, AnyArray
from fe.compiled import njit


@njit(cache=True, nogil=True, fastmath=True)
def slopes(fixed: F32, rows: F64, projected: F64, weights: F64, first: int) -> tuple[F64, F64]:
    """Multiply the forms from the first by the weights.

    Returns
    -------
    slope : (F - first, n + T A) float64
        B_m z.
    left : (F - first, T, n) float64
        What the projection of each touch leaves of it; nothing of use under a single one.
    """
    slope = np.empty((len(fixed) - first, weights.size))
    pulls = _pulls(projected, weights)
    left = np.empty((len(slope), len(rows), fixed.shape[1]))
    for m in range(len(slope)):
        _slope(fixed, rows, first + m, projected, weights, pulls, left[m], slope[m])
    return slope, left


@njit(cache=True, nogil=True, fastmath=True)
def stretch(
    fixed: F32, rows: F64, projected: F64, weights: F64, stresses: int
) -> tuple[F64, F64, F64, F64, F64]:
    """Stretch the plate by its weights, and sum the forms 1 … M with the stresses that follow.

    Returns
    -------
    slope : (M, n + T A) float64
        B_m z.
    stress : (M,) float64
        s_m = ½ zᵀ B_m z.
    tense : (1, n, n) float64
    tense_rows : (T, 1, 1, L) float64
        Σ s_m B_m.
    left : (M, T, n) float64
        As for `slopes`.
    """
    n = fixed.shape[1]
    slope, stress = np.empty((stresses, weights.size)), np.empty(stresses)
    pulls, left = _pulls(projected, weights), np.empty((stresses, len(rows), n))
    flat, tense_rows = np.zeros(n * n), np.zeros((len(rows), 1, 1, rows.shape[3]))
    for m in range(stresses):
        _slope(fixed, rows, 1 + m, projected, weights, pulls, left[m], slope[m])
        stress[m] = 0.5 * _dot(slope[m], weights)
        for t in range(len(rows)):
            _add(stress[m], rows[t, 0, 1 + m], tense_rows[t, 0, 0])
    _mix(stress, fixed.reshape(len(fixed), n * n)[1:], flat)
    return slope, stress, flat.reshape(1, n, n), tense_rows, left


@njit(cache=True, nogil=True, fastmath=True)
def summed(rows: F64, stress: F64) -> F64:
    """Sum the rows of forms 1 … M, and their derivatives, with stresses (M,): (T, 3, 1, L)."""
    total = np.zeros((len(rows), 3, 1, rows.shape[3]))
    for t in range(len(rows)):
        for d in range(3):
            for m in range(stress.size):
                _add(stress[m], rows[t, d, 1 + m], total[t, d, 0])
    return total


@njit(cache=True, nogil=True, fastmath=True)
def whole(fixed: AnyArray, rows: F64, projected: F64) -> F64:
    """Write the first form as a matrix (n + T A, n + T A)."""
    touches, _, functions, n = projected.shape
    matrix = np.empty((n + touches * functions, n + touches * functions))
    matrix[:n, :n] = fixed[0]
    reach = np.empty(n)
    for t in range(touches):
        row, own = rows[t, 0, 0], n + t * functions
        for a in range(functions):
            for i in range(n):
                matrix[i, own + a] = matrix[own + a, i] = row[a * n + i]
            for b in range(functions):
                matrix[own + a, own + b] = row[_local(n, functions, a, b)]
        for u in range(t):
            other = n + u * functions
            for b in range(functions):
                _reached(fixed, 0, projected[u, 0, b], reach)
                for i in range(n):
                    reach[i] = rows[u, 0, 0, b * n + i] - reach[i]
                for a in range(functions):
                    total = _dot(row[a * n : (a + 1) * n], projected[u, 0, b])
                    total += _dot(projected[t, 0, a], reach)
                    matrix[own + a, other + b] = matrix[other + b, own + a] = total
    return matrix


@njit(cache=True, nogil=True, fastmath=True)
def values_by(rows: F64, projected: F64, weights: F64, left: F64, first: int) -> F64:
    """Change ½ zᵀ B_m z of forms from the first with the places of touches, (m, T, 2).

    `left` (m, T, n) is that of `slopes`.
    """
    touches, _, functions, n = projected.shape
    change = np.empty((len(left), touches, 2))
    weighed, pulled = _weighed(projected, weights), np.zeros((touches, 2, n))
    for t in range(touches):
        for d in range(2):
            own = weights[n + t * functions : n + (t + 1) * functions]
            _mix(own, projected[t, 1 + d], pulled[t, d])
    for m in range(len(left)):
        for t in range(touches):
            for d in range(2):
                total = _dot(rows[t, 1 + d, first + m], weighed[t])
                for u in range(touches):
                    if u != t:
                        total += _dot(pulled[t, d], left[m, u])
                change[m, t, d] = total
    return change


@njit(cache=True, nogil=True, fastmath=True)
def slopes_by(fixed: AnyArray, rows: F64, projected: F64, weights: F64) -> F64:
    """Change B z of the first form with the places of touches, (n + T A, T, 2)."""
    touches, _, functions, n = projected.shape
    change = np.zeros((weights.size, touches, 2))
    pulls, left = _pulls(projected, weights), np.empty((touches, n))
    _slope(fixed, rows, 0, projected, weights, pulls, left, np.empty(weights.size))
    others, along, pulled, reach = _others(pulls), np.empty(n), np.empty(n), np.empty(n)
    for t in range(touches):
        own, beside = weights[n + t * functions : n + (t + 1) * functions], np.zeros(n)
        for u in range(touches):
            if u != t:
                beside += left[u]
        for d in range(2):
            row, by = rows[t, 1 + d, 0], projected[t, 1 + d]
            along[:], pulled[:] = 0.0, 0.0
            _mix(own, row[: functions * n].reshape(functions, n), along)
            _mix(own, by, pulled)
            for a in range(functions):
                total = _dot(row[a * n : (a + 1) * n], others[t]) + _dot(by[a], beside)
                for b in range(functions):
                    total += row[_local(n, functions, a, b)] * own[b]
                change[n + t * functions + a, t, d] = total
            change[:n, t, d] = along
            if touches > 1:
                _reached(fixed, 0, pulled, reach)
                along -= reach
            for u in range(touches):
                if u != t:
                    own_rows = change[n + u * functions : n + (u + 1) * functions, t, d]
                    _met(rows[u, 0, 0], projected[u, 0], pulled, along, own_rows)
    return change


@njit(cache=True, nogil=True, fastmath=True)
def _met(row: F64, projected: F64, pulled: F64, left: F64, out: F64) -> None:
    """Multiply the moving functions of one touch by those of another, as they are projected."""
    n = pulled.size
    for a in range(out.size):
        out[a] = _dot(row[a * n : (a + 1) * n], pulled) + _dot(projected[a], left)


@njit(cache=True, nogil=True, fastmath=True)
def _pulls(projected: F64, weights: F64) -> F64:
    """Weights of the fixed shapes, then what each touch adds to them, (1 + T, n)."""
    touches, _, functions, n = projected.shape
    pulls = np.zeros((1 + touches, n))
    pulls[0] = weights[:n]
    for t in range(touches):
        own = weights[n + t * functions : n + (t + 1) * functions]
        _mix(own, projected[t, 0], pulls[1 + t])
    return pulls


@njit(cache=True, nogil=True, fastmath=True)
def _weighed(projected: F64, weights: F64) -> F64:
    """Weigh a row by what is ½ zᵀ B z of it, (T, L)."""
    touches, _, functions, n = projected.shape
    others = _others(_pulls(projected, weights))
    weighed = np.empty((touches, functions * n + functions * (functions + 1) // 2))
    for t in range(touches):
        own = weights[n + t * functions : n + (t + 1) * functions]
        for a in range(functions):
            for i in range(n):
                weighed[t, a * n + i] = own[a] * others[t, i]
            for b in range(a, functions):
                twice = 0.5 if a == b else 1.0
                weighed[t, _local(n, functions, a, b)] = twice * own[a] * own[b]
    return weighed


@njit(cache=True, nogil=True, fastmath=True)
def _others(pulls: F64) -> F64:
    """Add up the fixed shapes and all other touches, for each (T, n)."""
    others = np.empty_like(pulls[1:])
    for t in range(len(others)):
        others[t] = pulls[0]
        for u in range(len(others)):
            if u != t:
                others[t] += pulls[1 + u]
    return others


@njit(cache=True, nogil=True, fastmath=True)
def _slope(
    fixed: AnyArray,
    rows: F64,
    m: int,
    projected: F64,
    weights: F64,
    pulls: F64,
    left: F64,
    out: F64,
) -> None:
    """Multiply form m by the weights, and say what the projection leaves of each touch (T, n)."""
    touches, _, functions, n = projected.shape
    _reached(fixed, m, pulls[0], out[:n])
    for t in range(touches):
        own, moving = weights[n + t * functions : n + (t + 1) * functions], rows[t, 0, m]
        moving = moving[: functions * n].reshape(functions, n)
        _mix(own, moving, out[:n])
        if touches > 1:  # one touch meets no other
            _reached(fixed, m, -pulls[1 + t], left[t])
            _mix(own, moving, left[t])
    for t in range(touches):
        row = rows[t, 0, m]
        for a in range(functions):
            moving = row[a * n : (a + 1) * n]
            total = _dot(moving, pulls[0])
            for b in range(functions):
                total += row[_local(n, functions, a, b)] * weights[n + t * functions + b]
            for u in range(touches):
                if u != t:
                    total += _dot(moving, pulls[1 + u]) + _dot(projected[t, 0, a], left[u])
            out[n + t * functions + a] = total


@njit(cache=True, nogil=True)
def _local(n: int, functions: int, a: int, b: int) -> int:
    """Where a row has the form of two functions that move with the touch."""
    low, high = min(a, b), max(a, b)
    return n * functions + low * functions - low * (low - 1) // 2 + high - low


@njit(cache=True, nogil=True, fastmath=True)
def _reached(fixed: AnyArray, m: int, pull: F64, out: F64) -> None:
    """Multiply form m on the fixed shapes by weights of these."""
    for i in range(pull.size):
        out[i] = 0.0
    _mix(pull, fixed[m], out)


@njit(cache=True, nogil=True, fastmath=True)
def _mix(scale: F64, parts: AnyArray, total: F64) -> None:
    """Add parts (K, N) times their scales to a total (N,), four a pass through memory."""
    count = scale.size
    for k in range(0, count - 3, 4):
        r, s, t, u = parts[k], parts[k + 1], parts[k + 2], parts[k + 3]
        a, b, c, d = scale[k], scale[k + 1], scale[k + 2], scale[k + 3]
        for i in range(total.size):
            total[i] += a * r[i] + b * s[i] + c * t[i] + d * u[i]
    for k in range(count - count % 4, count):
        _add(scale[k], parts[k], total)


@njit(cache=True, nogil=True, fastmath=True)
def _dot(one: F64, other: F64) -> float:
    total = 0.0
    for i in range(one.size):
        total += one[i] * other[i]
    return total


@njit(cache=True, nogil=True, fastmath=True)
def _add(scale: float, part: AnyArray, total: F64) -> None:
    for i in range(total.size):
        total[i] += scale * part[i]
