"""Touches of a plate at equilibrium, where it may still show some that ended."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from models import NO_TRACES, Estimate, Estimator
from rig.live.baseline import is_consistent
from rig.live.memory import Memory
from rig.system.arrays import F64

_LOOKS = 3  # at a frame: by itself, with what ended in it, and with what was left unseen


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
    left, strays, looks = before.after(start).left, NO_TRACES, 1
    while True:
        estimate = estimator.fit_whitened(measured, start, left=left)
        stray, found = before.strays(estimate, estimator.bench.memory, strays)
        strays = found.and_older(strays)
        memory = before.after(touches_of(estimate)[~stray], strays)
        if memory.left.same(left) or looks == _LOOKS:
            break
        start, left, looks = memory.held, memory.left, looks + 1
    if memory.left.same(before.left) or not is_consistent(estimate):
        return estimate, memory
    return estimate, replace(
        memory, left=estimator.traces_after(measured, touches_of(estimate), memory.left)
    )


def touches_of(estimate: Estimate) -> F64:
    """x, y, F of each touch, (n, 3)."""
    return np.column_stack([estimate.xy, estimate.force])
