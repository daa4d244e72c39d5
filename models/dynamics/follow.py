"""One frame of a plate that vibrates: predicted from the last, corrected by what it shows.

An extended Kalman filter whose covariance is kept as a factor of few columns (Verlaan & Heemink
1997): all that is not known of the modes came from few numbers of the forces.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import sqrt
from typing import NamedTuple

import numpy as np
from scipy.linalg import solve_triangular

from models.arrays import F64, I64
from models.dynamics.forces import force_knots
from models.dynamics.oscillators import Span
from models.dynamics.seeing import Seeing, Tangent
from models.dynamics.vibration import FORCE, RATE, REMEMBERED, Vibration

# Parts of a frequency that a mode may be off, and for how many modes that is followed.
_DETUNED, _LOUDEST = 0.005, 6
_OFF, _DAMPED = 0.003, 0.3
# How fast a finger moves that stays and that slides, mm/s, and how much likelier what is seen must
# be by a slide: an odd chance of 1 in 50.
_STAYS, _SLIDES, _RARE = 5.0, 200.0, 4.0


class View(NamedTuple):
    """One frame.

    Attributes
    ----------
    span : Span
        Since the frame before.
    measured : (m,) float64
        In units of its noise.
    time : float, s
        End of its exposure.
    """

    span: Span
    measured: F64
    time: float


class About(NamedTuple):
    """Where the effect of places and forces is taken to first order.

    Attributes
    ----------
    places : (n, 2) float64, mm
    forces : (n, p + 1) float64, N
        At the knots of a span.
    """

    places: F64
    forces: F64


@dataclass(frozen=True, eq=False)
class Followed:
    """A frame after it was followed.

    Attributes
    ----------
    vibration : Vibration
        At its end.
    amplitudes : (k,) float64
        Mean of the low modes over its exposure.
    forces : (n,) float64, N
        Mean force of each touch over the exposure.
    touch_factor : (n, 3, r) float64
        What a standard deviation along each direction does to x, y and that force.
    knots : (n, p + 1) float64, N
        Forces at the knots since the last frame.
    likelihood : float
        Its logarithm for what was seen, but for a constant.
    surprise : float
        χ² of what was not expected, less its mean, in its standard deviations.
    """

    vibration: Vibration
    amplitudes: F64
    forces: F64
    touch_factor: F64
    knots: F64
    likelihood: float
    surprise: float


class _Predicted(NamedTuple):
    """What is expected at the end of a frame, and what it would show."""

    vibration: Vibration
    knots: F64
    knot_factor: F64
    amplitudes: F64
    amplitude_factor: F64
    shown: F64
    shown_factor: F64


def follow(
    before: Vibration, view: View, seeing: Seeing, restless: float, about: About | None = None
) -> Followed:
    """Follow modes and touches into a frame.

    Parameters
    ----------
    before : Vibration
        At the end of the exposure of the last frame.
    view : View
    seeing : Seeing
    restless : float, N/s per √s
        By which the rates of forces change.
    about : About, optional
        Of all touches, where something better is known than what is expected.
    """
    grown = _grown(before, view.span, seeing)
    if about is None:
        about = About(before.touches[:, :2], _expected(before, view.span))
    tangent = seeing.about(about.places)
    predicted = _predicted(grown, view.span, seeing, tangent, about, restless)
    reduced = tangent.reduced(seeing, view.measured)
    beside = float(view.measured @ view.measured - reduced @ reduced)
    away = reduced - predicted.shown
    scatter = _model_scatter(before, view.span, seeing, tangent, restless)
    lower = np.linalg.cholesky(np.eye(len(away)) + scatter(len(away)))
    both = np.column_stack([away, predicted.shown_factor])
    white = solve_triangular(lower, both, lower=True, check_finite=False)
    away = white[:, 0]
    beside += 2.0 * float(np.log(np.diag(lower)).sum())
    return _corrected(before, view, grown, predicted._replace(shown_factor=white[:, 1:]), away, beside)


def _expected(before: Vibration, span: Span) -> F64:
    """Forces (n, p + 1) at the knots as they would go on."""
    by_start = force_knots(span.steps)[0][:, :2]
    return before.touches[:, FORCE:] @ by_start.T


def _model_scatter(before, span, seeing, tangent, restless):
    pressing = np.flatnonzero(before.pressing)
    rest = seeing.equilibrium(before.touches[pressing, :2], before.touches[pressing, FORCE])
    square = np.square(before.amplitudes[0] - rest) + np.square(before.amplitudes[1])
    noise = force_knots(span.steps)[0]
    swinging = np.einsum("jk,jp->kp", span.pressed - span.weights[:, None], noise)
    for touch in pressing:
        mean = swinging[:, :2] @ before.touches[touch, FORCE:]
        own = restless**2 * np.square(swinging[:, 2:]).sum(axis=1) + np.square(mean)
        square = square + own * np.square(tangent.low[touch, 0])
    size = np.minimum((_OFF + _DAMPED * span.damping) * span.turn, 1.0)
    wide = seeing.of_low * (size * np.sqrt(square))
    def full(d):
        out = np.zeros((d, d)); k = len(wide); out[:k, :k] = wide @ wide.T; return out
    return full


class _Grown(NamedTuple):
    """A plate with directions for what a frame may bring, and which of them move places."""

    vibration: Vibration
    places: I64
    forces: I64


def _grown(before: Vibration, span: Span, seeing: Seeing) -> _Grown:
    """Add directions of frequencies that are off, of places by 1 mm and of forces."""
    pressing = np.flatnonzero(before.pressing)
    rest = seeing.equilibrium(before.touches[pressing, :2], before.touches[pressing, FORCE])
    swing = np.hypot(before.amplitudes[0] - rest, before.amplitudes[1]) * span.turn * _DETUNED
    loud = np.argsort(swing * seeing.size)[-_LOUDEST:]
    loud = loud[swing[loud] * seeing.size[loud] > 0.1]
    first = before.rank + 2 * len(loud)
    places = first + np.arange(2 * len(pressing))
    forces = first + 2 * len(pressing) + np.arange(len(span.steps) * len(pressing))
    grown = before.turned(np.eye(before.rank, first + len(places) + len(forces)))
    for part in (0, 1):
        where = before.rank + 2 * np.arange(len(loud)) + part
        grown.amplitude_factor[part, loud, where] = swing[loud]
    grown.touch_factor[pressing, 0, places[::2]] = 1.0
    grown.touch_factor[pressing, 1, places[1::2]] = 1.0
    return _Grown(grown, places, forces)


def _predicted(
    grown: _Grown, span: Span, seeing: Seeing, tangent: Tangent, about: About, restless: float
) -> _Predicted:
    """Predict modes, touches and what is seen, with what each direction does to them."""
    vibration = grown.vibration
    by_force, by_rate = force_knots(span.steps)
    pressing = np.flatnonzero(vibration.pressing)
    start, start_factor = vibration.touches[:, FORCE:], vibration.touch_factor[:, FORCE:]
    count = len(span.steps)
    knots = start @ by_force[:, :2].T
    knot_factor = np.einsum("jb,nbr->njr", by_force[:, :2], start_factor)
    rate_factor = np.einsum("b,nbr->nr", by_rate[-1, :2], start_factor)
    for number, touch in enumerate(pressing):
        own = grown.forces[count * number : count * (number + 1)]
        knot_factor[touch][:, own] += restless * by_force[:, 2:]
        rate_factor[touch, own] += restless * by_rate[-1, 2:]
    off = vibration.touches[:, :2] - about.places
    # Amplitude and velocity at the end of the span, and mean amplitude over the exposure.
    free = np.concatenate([span.carry, span.seen[None]])  # (3, 2, k)
    forced = np.concatenate([span.carried, span.pressed[None]])  # (3, p + 1, k)
    amplitudes = np.einsum("sbk,bk->sk", free, vibration.amplitudes)
    factor = np.einsum("sbk,bkr->skr", free, vibration.amplitude_factor)
    shown = np.zeros(tangent.stiff.shape[2])
    shown_factor = np.zeros((len(shown), vibration.rank))
    for touch in pressing:
        low, stiff = tangent.low[touch], tangent.stiff[touch]
        by_place = np.einsum("j,sjk,ak->sak", about.forces[touch], forced, low[1:])
        basis = np.concatenate([forced * low[0], by_place], axis=1)  # (3, p + 3, k)
        values = np.concatenate([knots[touch], off[touch]])
        rows = np.concatenate([knot_factor[touch], vibration.touch_factor[touch, :2]])
        amplitudes = amplitudes + np.einsum("sjk,j->sk", basis, values)
        factor = factor + (basis.transpose(0, 2, 1) @ rows)
        held = float(about.forces[touch] @ span.weights)
        quick = np.column_stack([np.outer(stiff[0], span.weights), held * stiff[1:].T])
        shown += quick @ values
        shown_factor += quick @ rows
    low = len(seeing.of_low)
    shown[:low] += seeing.of_low @ amplitudes[2]
    shown_factor[:low] += seeing.of_low @ factor[2]
    touches, touch_factor = vibration.touches.copy(), vibration.touch_factor.copy()
    touches[:, FORCE], touch_factor[:, FORCE] = knots[:, -1], knot_factor[:, -1]
    touches[:, RATE], touch_factor[:, RATE] = start @ by_rate[-1, :2], rate_factor
    end = replace(
        vibration,
        amplitudes=amplitudes[:2],
        amplitude_factor=factor[:2],
        touches=touches,
        touch_factor=touch_factor,
        forces=np.concatenate([vibration.forces, knots[:, 1:]], axis=1),
        force_factor=np.concatenate([vibration.force_factor, knot_factor[:, 1:]], axis=1),
    )
    return _Predicted(end, knots, knot_factor, amplitudes[2], factor[2], shown, shown_factor)


def _corrected(
    before: Vibration,
    view: View,
    grown: _Grown,
    predicted: _Predicted,
    away: F64,
    beside: float,
) -> Followed:
    """Correct what was predicted by how far (d,) the measurement is away from it.

    `beside` is the sum of squares of what no direction could explain.
    """
    scale, turn, step, likelihood, explained = _posterior(grown, predicted.shown_factor, away, view.span)
    end = predicted.vibration.moved(scale * step).turned(scale[:, None] * turn)
    knots = predicted.knots + predicted.knot_factor @ (scale * step)
    amplitudes = predicted.amplitudes + predicted.amplitude_factor @ (scale * step)
    weights = view.span.weights
    by_force = np.einsum("j,njr->nr", weights, predicted.knot_factor * scale) @ turn
    touch_factor = np.concatenate([end.touch_factor[:, :2], by_force[:, None]], axis=1)
    times = view.time - view.span.steps.sum() + np.cumsum(view.span.steps)
    known = replace(end, times=np.concatenate([before.times, times]))
    return Followed(
        known.recent(view.time - REMEMBERED),
        amplitudes,
        knots @ weights,
        touch_factor,
        knots,
        likelihood - 0.5 * (beside + float(away @ away)),
        (float(away @ away) - explained - len(away)) / sqrt(2.0 * len(away)),
    )


def _posterior(
    grown: _Grown, seen: F64, away: F64, span: Span
) -> tuple[F64, F64, F64, float, float]:
    """Size (r,) of each direction, what becomes of it (r, r), step (r,), log-likelihood and χ²."""
    gram, towards = seen.T @ seen, seen.T @ away
    slides = (_STAYS, _SLIDES) if len(grown.places) else (_STAYS,)
    found: list[tuple[float, F64, F64, F64, float]] = []
    for slide in slides:
        scale = np.ones(len(gram))
        scale[grown.places] = slide * float(span.steps.sum())
        lower = np.linalg.cholesky(np.eye(len(gram)) + scale[:, None] * gram * scale)
        white = solve_triangular(lower, scale * towards, lower=True, check_finite=False)
        fit = 0.5 * float(white @ white) - float(np.log(np.diag(lower)).sum())
        found.append((fit - (_RARE if slide == _SLIDES else 0.0), scale, lower, white, fit))
    _, scale, lower, white, fit = max(found, key=lambda one: one[0])
    turn = solve_triangular(lower, np.eye(len(gram)), lower=True, check_finite=False).T
    return scale, turn, turn @ white, fit, float(white @ white)
