"""Touches of a plate at equilibrium, where it may still show some that ended."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np

from models import NO_TRACES, Estimate, Estimator, Traces
from rig.live.baseline import is_consistent
from rig.live.memory import Memory
from rig.system.arrays import F64

_AGAIN = 2  # looks at a frame: with what ended in it, and with what was left unseen


def fitted(
    estimator: Estimator, measured: F64, start: F64, before: Memory
) -> tuple[Estimate, Memory]:
    """Find touches; again where one has ended, since the plate may still show a part of it.

    The memory is that of the frame before, however often this one is looked at.

    Parameters
    ----------
    estimator : Estimator
    measured : (m,) float64
        In units of its noise.
    start : (n, 3) float64, mm, mm, N
        Touches of the last frame.
    before : Memory
    """
    if estimator.bench is None:
        return estimator.fit_whitened(measured, start), before
    look = partial(_look, estimator, estimator.bench.memory, measured, before)
    left = before.after(start).left
    estimate, memory, strays = look(start, left, NO_TRACES)
    for _ in range(_AGAIN):
        if memory.left.same(left):
            break
        left = memory.left
        estimate, memory, strays = look(memory.held, left, strays)
    if memory.left.same(before.left) or not is_consistent(estimate):
        return estimate, memory
    return estimate, replace(
        memory, left=estimator.traces_after(measured, touches_of(estimate), memory.left)
    )


def _look(
    estimator: Estimator,
    kept: float,
    measured: F64,
    before: Memory,
    start: F64,
    left: Traces,
    strays: Traces,
) -> tuple[Estimate, Memory, Traces]:
    """Find touches beside traces; memory after them, and strays with those that they show."""
    estimate = estimator.fit_whitened(measured, start, left=left)
    stray, found = before.strays(estimate, kept, strays)
    strays = found.and_older(strays)
    return estimate, before.after(touches_of(estimate)[~stray], strays), strays


def touches_of(estimate: Estimate) -> F64:
    """x, y, F of each touch, (n, 3)."""
    return np.column_stack([estimate.xy, estimate.force])
