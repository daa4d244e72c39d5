"""Modes of a plate as damped oscillators under forces that are piecewise linear in time.

A mode of stiffness λ on a plate of density ρ and thickness h obeys q̈ + 2 ζ ω q̇ + ω² q = ω² u with
ω² = λ / (ρ h), where u is its amplitude at equilibrium under the forces of that moment. Between two
knots at which u is known, and linear between, its motion is exact (Nigam & Jennings 1969).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

import fe
from models.arrays import F64, I64
from models.compiled import njit
from models.dynamics.forces import force_knots
from models.dynamics.seeing import RINGING

LONGEST = 0.0025  # s between two knots of a force: the mean of a tap of 20 ms is right to 1 %
MAX_STEPS = 16  # segments of the time between two frames, however long


@dataclass(frozen=True, eq=False)
class PlateDynamics:
    """Frequencies and damping of the modes of a plate.

    Attributes
    ----------
    omega : (K,) float64, rad/s
        Angular frequencies without damping.
    damping : (K,) float64
        Ratios to critical damping, above 0 and below 1.
    """

    omega: F64
    damping: F64

    def scaled(self, frequency: float, damping: float) -> PlateDynamics:
        """Frequencies times a factor, and one ratio of damping for all modes."""
        return PlateDynamics(self.omega * frequency, np.full_like(self.omega, damping))


@dataclass(frozen=True, eq=False)
class Span:
    """What modes do from one frame to the next, by their state before and the forces meanwhile.

    States are amplitude q and velocity over frequency q̇ / ω, (2, K).

    Attributes
    ----------
    steps : (p,) float64, s
        Times from knot to knot.
    carry : (2, 2, K) float64
        State at the end by the state before.
    carried : (2, p + 1, K) float64
        State at the end by the amplitudes at equilibrium at each knot.
    seen : (2, K) float64
        Mean amplitude over the exposure by the state before.
    pressed : (p + 1, K) float64
        The same by the amplitudes at equilibrium at each knot.
    weights : (p + 1,) float64
        Mean over the exposure of what is linear between knots.
    turn : (K,) float64, rad
        By which each mode turns in its phase.
    damping : (K,) float64
        Ratios of damping.
    forces, rates : (p + 1, 2 + p) float64
        Forces and their rates at the knots; see `force_knots`.
    """

    steps: F64
    carry: F64
    carried: F64
    seen: F64
    pressed: F64
    weights: F64
    turn: F64
    damping: F64
    forces: F64
    rates: F64


def plate_dynamics(modes: fe.Modes, density: float, damping: float) -> PlateDynamics:
    """Frequencies of the lowest modes of a plate in vacuo, all damped alike.

    Parameters
    ----------
    modes : fe.Modes
    density : float, kg/m³
    damping : float
        Ratio to critical damping; half the loss factor of the material.

    Raises
    ------
    ValueError
        The density is not positive, or the damping not between 0 and 1.
    """
    if not density > 0:
        raise ValueError(f"density must be positive, got {density:g} kg/m³; PVC has 1400")
    if not 0 < damping < 1:
        raise ValueError(f"damping must lie between 0 and 1, got {damping:g}; PVC has about 0.02")
    heavy = 1e-12 * density * modes.plate.thickness  # t/mm²
    omega = np.sqrt(modes.stiffness[:RINGING] / heavy)
    return PlateDynamics(omega, np.full(len(omega), float(damping)))


def span(dynamics: PlateDynamics, interval: float, exposure: float) -> Span:
    """Lay knots between two frames and follow the modes over them.

    Parameters
    ----------
    dynamics : PlateDynamics
    interval : float, s
        From the end of one exposure to the end of the next.
    exposure : float, s
        Of the second; no more of it than the interval counts.

    Raises
    ------
    ValueError
        The interval or the exposure is not positive.
    """
    if not (interval > 0 and exposure > 0):
        raise ValueError(
            f"interval and exposure of a frame must be positive, got {interval:g} s and"
            f" {exposure:g} s; leave frames out that are not later than the last"
        )
    exposure = min(exposure, interval)
    lengths, counts = _divided(interval, exposure)
    steps, kinds = lengths.repeat(counts), np.arange(len(counts)).repeat(counts)
    inside = kinds == len(counts) - 1
    opens = len(steps) - int(counts[-1])
    free, first, second = _segments(dynamics.omega, dynamics.damping, lengths)
    carry, carried, opened = _carried(free, first, second, kinds, opens)
    weights = _trapezoids(np.where(inside, steps, 0.0)) / exposure
    seen = _mean(dynamics, carry - opened[:, :2], exposure)
    pressed = _mean(dynamics, carried - opened[:, 2:], exposure) + weights[:, None]
    turn, damping = dynamics.omega * interval, dynamics.damping
    knots = force_knots(steps)
    return Span(steps, carry, carried, seen, pressed, weights, turn, damping, *knots)


def _divided(interval: float, exposure: float) -> tuple[F64, I64]:
    """Divide what comes before the exposure, and the exposure: lengths of steps, and how many."""
    before = interval - exposure
    parts = np.array([before, exposure] if before > 1e-9 else [exposure])
    longest = max(LONGEST, interval / (MAX_STEPS - 1))
    counts = np.maximum(np.ceil(parts / longest - 1e-9), 1).astype(np.int64)
    return parts / counts, counts


def _trapezoids(steps: F64) -> F64:
    """Weights of knots in the integral of what is linear between them."""
    weights = np.zeros(len(steps) + 1)
    weights[:-1] += steps / 2
    weights[1:] += steps / 2
    return weights


def _mean(dynamics: PlateDynamics, change: F64, exposure: float) -> F64:
    """Mean amplitude beyond that at equilibrium, by the change of state over an exposure.

    The equation of motion integrated: ω² ∫(q - u) dt = -Δq̇ - 2 ζ ω Δq.
    """
    return -(change[1] + 2 * dynamics.damping * change[0]) / (dynamics.omega * exposure)


@njit(cache=True, nogil=True)
def _carried(free: F64, first: F64, second: F64, kinds: I64, opens: int) -> tuple[F64, F64, F64]:
    """Follow the modes over steps, each of one of S kinds (p,), of which `opens` lie before light.

    Parameters
    ----------
    free, first, second : (S, 2, 2, K), (S, 2, K), (S, 2, K) float64
        See `_segments`.

    Returns
    -------
    carry, carried : (2, 2, K), (2, p + 1, K) float64
        See `Span`.
    opened : (2, 2 + p + 1, K) float64
        Both as they are where the exposure begins.
    """
    count, modes = len(kinds), free.shape[3]
    whole, opened = np.zeros((2, 3 + count, modes)), np.zeros((2, 3 + count, modes))
    whole[0, 0], whole[1, 1] = 1.0, 1.0
    for k in range(count + 1):
        if k == opens:
            opened[:] = whole
        if k == count:
            break
        by, kind = free[kinds[k]], kinds[k]
        for j in range(2 + k + 1):
            for m in range(modes):
                place, speed = whole[0, j, m], whole[1, j, m]
                whole[0, j, m] = by[0, 0, m] * place + by[0, 1, m] * speed
                whole[1, j, m] = by[1, 0, m] * place + by[1, 1, m] * speed
        for part in range(2):
            for m in range(modes):
                whole[part, 2 + k, m] += first[kind, part, m]
                whole[part, 3 + k, m] += second[kind, part, m]
    return whole[:, :2].copy(), whole[:, 2:].copy(), opened


@njit(cache=True, nogil=True)
def _segments(omega: F64, damping: F64, steps: F64) -> tuple[F64, F64, F64]:
    """State after each of S steps by that before, (S, 2, 2, K), and by u at its ends, (S, 2, K).

    With u linear, q - u + 2 ζ u̇ / ω swings freely.
    """
    size, modes = len(steps), len(omega)
    free = np.empty((size, 2, 2, modes))
    first, second = np.empty((size, 2, modes)), np.empty((size, 2, modes))
    for s in range(size):
        for m in range(modes):
            zeta, phase = damping[m], omega[m] * steps[s]
            root, fade = np.sqrt(1.0 - zeta**2), np.exp(-zeta * phase)
            sine, cosine = fade * np.sin(root * phase) / root, fade * np.cos(root * phase)
            by = free[s, :, :, m]
            by[0, 0], by[0, 1] = cosine + zeta * sine, sine
            by[1, 0], by[1, 1] = -sine, cosine - zeta * sine
            # By the slope r = u̇ / ω: away = (q - u + 2 ζ r, q̇ / ω - r). A unit of u at the end is
            # a slope of 1 / (ω step) and an end 1 higher than its beginning.
            second[s, 0, m] = (2.0 * zeta * (by[0, 0] - 1.0) - by[0, 1]) / phase + 1.0
            second[s, 1, m] = (2.0 * zeta * by[1, 0] - by[1, 1] + 1.0) / phase
            first[s, 0, m] = 1.0 - by[0, 0] - second[s, 0, m]
            first[s, 1, m] = -by[1, 0] - second[s, 1, m]
    return free, first, second
