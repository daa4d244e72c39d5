"""The fixed layers of the touch net: steps of Gauss and Newton, as many for every measurement.

They are no search: each number of touches has its own proposal, takes `STEPS` damped steps from
there on the exact derivatives, and keeps the best place that it came by. Nothing is begun anew.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from models.arrays import F64, Mask
from models.compiled import njit
from models.forward.linear import LinearForward
from models.forward.table import ForwardTable, read_touches
from models.inverse.descent_kernel import weak_or_close
from models.inverse.normal_equations import (
    active_bounds,
    assemble,
    clipped_step,
    damped_step,
    factorise,
    inverse,
)
from models.touch_net.prior import MAX_TOUCHES, TouchRange

STEPS = 16
_FIRST, _LAST = 0.01, 1e-5  # damping of the first step and of the last, in parts of the diagonal
_FADING = 0.2  # of the damping from one step to the next
_CONVERGED = 1e-2  # change of χ² after which further steps change nothing
_REACH = 0.2  # of the plate's sides, the longest step of a touch


class Fits(NamedTuple):
    """Where each number of touches has come to; row n - 1 is for n touches.

    Attributes
    ----------
    touches : (4, 4, 3) float64, mm, mm, N
        The first n of row n - 1.
    spread : (4, 12, 12) float64, mm and N
        Inverse of the Fisher matrix, with a prior as wide as what is expected.
    chi2 : (5,) float64
        Sum of squares left by none, one, … touches.
    evidence : (5,) float64
        Logarithm of the density of the measurement by Laplace's method, less a constant.
    fall : (4,) float64
        By how much the last step lowered `chi2`.
    weakest, apart : (4,) float64
        See `weak_or_close`.
    residual : (4, m) float64
    fitted : (4,) bool
        Numbers of touches that took steps; the others are not likely enough.
    """

    touches: F64
    spread: F64
    chi2: F64
    evidence: F64
    fall: F64
    weakest: F64
    apart: F64
    residual: F64
    fitted: Mask


def folded(forward: LinearForward) -> LinearForward:
    """Put the whitening of a forward model into its table, so that reading it takes a tenth.

    Raises
    ------
    ValueError
        It has several groups, or patterns set aside.
    """
    table = forward.table
    if len(table.whitening) != 1 or len(table.aside):
        raise ValueError(
            f"a touch net reads the amplitudes of one pattern, got a forward model of"
            f" {len(table.whitening)} groups; use that of a TilePattern"
        )
    # Single precision is right to 1e-4 of the noise, and halves what is read from memory.
    values = (table.values @ table.whitening[0].T).astype(np.float32)
    count = values.shape[2]
    whole, none = np.ones((count, 1, 1)), np.empty((0, count))
    return LinearForward(
        forward.plate, table._replace(values=values, whitening=whole, aside=none), (count,)
    )


def fit_all(
    table: ForwardTable, measured: F64, proposed: F64, likely: Mask, touches: TouchRange
) -> Fits:
    """Take the steps from proposals (10, 3): of one touch, then of two, three and four.

    Only numbers of touches that are `likely` (4,) take them.
    """
    bounds, volume = touches.bounds, touches.log_volume
    return Fits(*_fit_all(table, measured, proposed, likely, bounds, volume, STEPS))


def fit_number(
    table: ForwardTable, measured: F64, proposed: F64, touches: TouchRange, steps: int
) -> F64:
    """Take so many steps from proposed touches (n, 3)."""
    return _unroll(table, measured, proposed, touches.bounds, steps)[0]


@njit(cache=True, nogil=True)
def _fit_all(
    table: ForwardTable,
    measured: F64,
    proposed: F64,
    likely: Mask,
    bounds: F64,
    log_volume: float,
    steps: int,
) -> tuple[F64, F64, F64, F64, F64, F64, F64, F64, Mask]:
    touches, spread = (
        np.zeros((MAX_TOUCHES, MAX_TOUCHES, 3)),
        np.zeros((MAX_TOUCHES, 3 * MAX_TOUCHES, 3 * MAX_TOUCHES)),
    )
    chi2, evidence = np.full(MAX_TOUCHES + 1, 1e9), np.full(MAX_TOUCHES + 1, -1e9)
    fall, weakest, apart = np.zeros(MAX_TOUCHES), np.ones(MAX_TOUCHES), np.ones(MAX_TOUCHES)
    left = np.zeros((MAX_TOUCHES, len(measured)))
    chi2[0] = measured @ measured
    evidence[0] = -0.5 * chi2[0]
    orders = 0.0
    for n in range(1, MAX_TOUCHES + 1):
        orders += np.log(n)
        if not likely[n - 1]:
            continue
        first = n * (n - 1) // 2
        begun = proposed[first : first + n].copy()
        found, jacobian, left[n - 1], chi2[n], fall[n - 1] = _unroll(
            table, measured, begun, bounds, steps
        )
        touches[n - 1, :n] = found
        each, half = _spread(jacobian, bounds)
        spread[n - 1, : 3 * n, : 3 * n] = each
        evidence[n] = -0.5 * chi2[n] - half - n * (log_volume - 1.5 * np.log(2 * np.pi)) + orders
        _, weakest[n - 1], _, _, apart[n - 1] = weak_or_close(found, each)
    return touches, spread, chi2, evidence, fall, weakest, apart, left, likely


@njit(cache=True, nogil=True)
def _unroll(
    table: ForwardTable, measured: F64, touches: F64, bounds: F64, steps: int
) -> tuple[F64, F64, F64, float, float]:
    """Take the steps: the best touches, jacobian, residual, χ², and by how much it fell last."""
    mean, precision = _wide(bounds)
    touches = clipped_step(touches, np.zeros(touches.size), bounds)
    best, best_jacobian, left = touches, np.empty((0, 0)), measured
    lowest, before, last = np.inf, np.inf, np.inf
    for step in range(steps + 1):
        predicted, jacobian = read_touches(table, touches)
        residual = measured - predicted
        cost = float(residual @ residual)
        if cost < lowest or step == 0:
            before = lowest
            best, best_jacobian, left, lowest = touches, jacobian, residual, cost
        if step == steps or abs(last - cost) < _CONVERGED:
            break
        last = cost
        normal, slope = assemble(jacobian, residual, touches, mean, precision)
        held = active_bounds(touches, slope, bounds)
        damping = max(_FIRST * _FADING**step, _LAST)
        move = damped_step(normal, slope, held, damping)
        touches = clipped_step(touches, _limited(move, bounds), bounds)
    return best, best_jacobian, left, lowest, min(before - lowest, 1e6)


@njit(cache=True, nogil=True)
def _limited(move: F64, bounds: F64) -> F64:
    """Hold a step (3n,) back that leads too far across the plate, or beyond all forces."""
    limited = move.copy()
    for k in range(len(move)):
        side = bounds[1, k % 3] - bounds[0, k % 3]
        reach = _REACH * side if k % 3 < 2 else side
        limited[k] = min(max(move[k], -reach), reach)
    return limited


@njit(cache=True, nogil=True)
def _wide(bounds: F64) -> tuple[F64, F64]:
    """Mean and precision of x, y, F that lie anywhere within bounds."""
    return 0.5 * (bounds[0] + bounds[1]), 12.0 / (bounds[1] - bounds[0]) ** 2


@njit(cache=True, nogil=True)
def _spread(jacobian: F64, bounds: F64) -> tuple[F64, float]:
    """Covariance (3n, 3n) with a wide prior, and half the log determinant of its inverse."""
    _, precision = _wide(bounds)
    fisher = jacobian @ jacobian.T
    size = len(fisher)
    scale = np.empty(size)
    for k in range(size):
        fisher[k, k] += precision[k % 3]
        scale[k] = 1.0 / np.sqrt(fisher[k, k])
    half = -np.log(scale).sum()
    for k in range(size):
        fisher[k] *= scale[k] * scale
    lower = fisher.copy()
    factorise(lower)
    for k in range(size):
        half += np.log(lower[k, k])
    spread = inverse(fisher, 1e-14)
    for k in range(size):
        spread[k] *= scale[k] * scale
    return spread, half
