"""What a frame is expected to show, and what each direction that is not known does to that."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from models.arrays import F64, I64
from models.dynamics.oscillators import Span
from models.dynamics.seeing import Seeing, TouchTangent
from models.dynamics.vibration import FORCE, RATE, Vibration

# Parts of a frequency that a mode may be off, and for how many modes that is followed.
_DETUNED, _LOUDEST = 0.005, 6
# What is not known of the ringing of each mode within a frame: parts of a radian by its frequency,
# and by its damping, which Rayleigh's, a loss factor and air all make differ from mode to mode.
_OFF, _DAMPED = 0.003, 0.3


class Expected(NamedTuple):
    """A frame before it was looked at.

    Attributes
    ----------
    vibration : Vibration
        At its end.
    knots : (n, p + 1) float64, N
        Forces at the knots since the last frame.
    knot_factor : (n, p + 1, r) float64
    amplitudes : (k,) float64
        Mean of the low modes over the exposure.
    amplitude_factor : (k, r) float64
    shown : (d,) float64
        Reduced measurement.
    shown_factor : (d, r) float64
    scatter : (d, d) float64
        Covariance of the measurement: of noise, and of how modes ring within the frame.
    places : (2 n,) int64
        Directions that move touches by 1 mm.
    """

    vibration: Vibration
    knots: F64
    knot_factor: F64
    amplitudes: F64
    amplitude_factor: F64
    shown: F64
    shown_factor: F64
    scatter: F64
    places: I64


def expect(
    before: Vibration,
    span: Span,
    seeing: Seeing,
    tangent: TouchTangent,
    forces: F64,
    agility: float,
) -> Expected:
    """Carry a plate on to the end of a frame.

    Parameters
    ----------
    before : Vibration
    span : Span
    seeing : Seeing
    tangent : TouchTangent
        About places of all touches.
    forces : (n, p + 1) float64, N
        Forces at the knots for which the effect of a place is taken.
    agility : float, N/s per √s
    """
    swing = _swing(before, tangent)
    grown, places, drawn = _grown(before, span, seeing, swing)
    count, pressing = len(span.steps), np.flatnonzero(grown.pressing)
    start, start_factor = grown.touches[:, FORCE:], grown.touch_factor[:, FORCE:]
    knots = start @ span.forces[:, :2].T
    knot_factor = np.matmul(span.forces[:, :2], start_factor)
    rate_factor = np.matmul(span.rates[-1, :2], start_factor)
    for number, touch in enumerate(pressing):
        own = drawn[count * number : count * (number + 1)]
        knot_factor[touch][:, own] += agility * span.forces[:, 2:]
        rate_factor[touch, own] += agility * span.rates[-1, 2:]
    low, shown, factor, shown_factor = _driven(
        grown, span, seeing, tangent, forces, knots, knot_factor
    )
    touches, touch_factor = grown.touches.copy(), grown.touch_factor.copy()
    touches[:, FORCE], touch_factor[:, FORCE] = knots[:, -1], knot_factor[:, -1]
    touches[:, RATE], touch_factor[:, RATE] = start @ span.rates[-1, :2], rate_factor
    end = replace(
        grown,
        amplitudes=low[:2],
        amplitude_factor=factor[:2],
        touches=touches,
        touch_factor=touch_factor,
        forces=np.concatenate([grown.forces, knots[:, 1:]], axis=1),
        force_factor=np.concatenate([grown.force_factor, knot_factor[:, 1:]], axis=1),
    )
    scatter = _scatter(before, span, seeing, tangent, swing, agility, len(shown))
    return Expected(
        end, knots, knot_factor, low[2], factor[2], shown, shown_factor, scatter, places
    )


def _swing(before: Vibration, tangent: TouchTangent) -> F64:
    """How far each low mode is off its equilibrium, with its velocity, (k,)."""
    rest = before.touches[:, FORCE] @ tangent.low[:, 0]
    return np.hypot(before.amplitudes[0] - rest, before.amplitudes[1])


def _grown(before: Vibration, span: Span, seeing: Seeing, swing: F64) -> tuple[Vibration, I64, I64]:
    """Add directions of frequencies that are off, of places by 1 mm and of forces."""
    pressing = np.flatnonzero(before.pressing)
    turned = _DETUNED * swing * span.turn
    loud = np.argsort(turned * seeing.size)[-_LOUDEST:]
    loud = loud[turned[loud] * seeing.size[loud] > 0.1]
    first = before.rank + 2 * len(loud)
    places = first + np.arange(2 * len(pressing))
    drawn = first + 2 * len(pressing) + np.arange(len(span.steps) * len(pressing))
    grown = before.widened(first + len(places) + len(drawn))
    for part in (0, 1):
        where = before.rank + 2 * np.arange(len(loud)) + part
        grown.amplitude_factor[part, loud, where] = turned[loud]
    grown.touch_factor[pressing, 0, places[::2]] = 1.0
    grown.touch_factor[pressing, 1, places[1::2]] = 1.0
    return grown, places, drawn


def _driven(
    grown: Vibration,
    span: Span,
    seeing: Seeing,
    tangent: TouchTangent,
    forces: F64,
    knots: F64,
    knot_factor: F64,
) -> tuple[F64, F64, F64, F64]:
    """Low modes (3, k) and the measurement (d,), each also by each direction.

    The three are amplitude and velocity at the end, and the mean amplitude over the exposure.
    """
    free = np.concatenate([span.carry, span.seen[None]])  # (3, 2, k)
    forced = np.concatenate([span.carried, span.pressed[None]])  # (3, p + 1, k)
    low = np.einsum("sbk,bk->sk", free, grown.amplitudes)
    factor = free[:, 0, :, None] * grown.amplitude_factor[0]
    factor += free[:, 1, :, None] * grown.amplitude_factor[1]
    shown = np.zeros(tangent.stiff.shape[2])
    shown_factor = np.zeros((len(shown), grown.rank))
    off = grown.touches[:, :2] - tangent.places
    for touch in np.flatnonzero(grown.pressing):
        response, slope = tangent.low[touch, 0], tangent.low[touch, 1:]
        by_place = np.einsum("j,sjk->sk", forces[touch], forced)[:, None] * slope
        basis = np.concatenate([forced * response, by_place], axis=1)  # (3, p + 3, k)
        values = np.concatenate([knots[touch], off[touch]])
        rows = np.concatenate([knot_factor[touch], grown.touch_factor[touch, :2]])
        low += values @ basis
        factor += np.matmul(basis.transpose(0, 2, 1), rows)
        stiff, held = tangent.stiff[touch], float(forces[touch] @ span.weights)
        quick = np.column_stack([np.outer(stiff[0], span.weights), held * stiff[1:].T])
        shown += quick @ values
        shown_factor += quick @ rows
    shown[: seeing.low] += seeing.of_low @ low[2]
    shown_factor[: seeing.low] += seeing.of_low @ factor[2]
    return low, shown, factor, shown_factor


def _scatter(
    before: Vibration,
    span: Span,
    seeing: Seeing,
    tangent: TouchTangent,
    swing: F64,
    agility: float,
    size: int,
) -> F64:
    """Covariance of the reduced measurement, (d, d): noise, and ringing that is not known."""
    square = np.square(swing)
    ringing = (span.pressed - span.weights[:, None]).T @ span.forces  # (k, 2 + p)
    drawn = agility**2 * np.square(ringing[:, 2:]).sum(axis=1)
    for touch in np.flatnonzero(before.pressing):
        steady = ringing[:, :2] @ before.touches[touch, FORCE:]
        square = square + (drawn + np.square(steady)) * np.square(tangent.low[touch, 0])
    part = np.minimum((_OFF + _DAMPED * span.damping) * span.turn, 1.0)
    wide = seeing.of_low * (part * np.sqrt(square))
    scatter = np.eye(size)
    scatter[: seeing.low, : seeing.low] += wide @ wide.T
    return scatter
