"""A tap: what is stated of a touch once it has ended and rung."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from models.arrays import F64
from models.dynamics.bank import Bank

SURE = 3.0  # standard deviations within which a force may be none
# Frames that must have shown a tap to know what its force was between them: fewer are enough where
# they come faster than the lowest mode swings, which carries the force from one to the next.
ENOUGH, ENOUGH_FAST = 3, 2
# Draws of the largest force of a tap, and what is stated of them.
_SEED, _DRAWS, _QUANTILES = 0, 400, (0.159, 0.5, 0.841)


@dataclass(frozen=True)
class Tap:
    """A touch that has ended, at its strongest.

    Attributes
    ----------
    x, y : float, mm
    force : float, N
        Largest force, between frames or in one; not a number where too few frames have seen it.
    at_least : float, N
        Force that it has surely reached.
    time : float, s
        When that was.
    sigma : (float, float, float), mm, mm, N
        Standard deviations of x, y and force.
    """

    x: float
    y: float
    force: float
    at_least: float
    time: float
    sigma: tuple[float, float, float]


def state_tap(bank: Bank, index: int, shown: list[float], enough: int) -> Tap:
    """State the strongest moment of a touch, by draws from the posterior of its force.

    Parameters
    ----------
    bank : Bank
    index : int
        Of the touch.
    shown : list of two floats
        Frames that have shown it, and the force, N, that one of them surely showed.
    enough : int
        Frames below which no force is stated.
    """
    rng = np.random.default_rng(_SEED)
    counts = rng.multinomial(_DRAWS, bank.weights)
    largest: list[F64] = []
    when: list[F64] = []
    for one, count in zip(bank.members, counts.tolist(), strict=True):
        vibration = one.vibration
        drawn = rng.standard_normal((count, vibration.rank)) @ vibration.force_factor[index].T
        drawn = drawn + vibration.forces[index]
        largest.append(drawn.max(axis=1))
        when.append(vibration.times[drawn.argmax(axis=1)])
    low, middle, high = np.quantile(np.concatenate(largest), _QUANTILES).tolist()
    best = bank.best
    x, y = best.touches[index, :2].tolist()
    sigma_x, sigma_y = np.linalg.norm(best.touch_factor[index, :2], axis=1).tolist()
    time = float(np.median(np.concatenate(when)))
    frames, surely = shown
    if frames < enough or middle < SURE * (high - low) / 2:
        middle = np.nan
    return Tap(x, y, middle, surely, time, (sigma_x, sigma_y, (high - low) / 2))
