"""One frame of a plate that vibrates: predicted from the last, corrected by what it shows.

An iterated extended Kalman filter (Bell & Cathey 1993) whose covariance is kept as a factor of few
columns (Verlaan & Heemink 1997): all that is not known of the modes came from few numbers of the
forces. The force of a touch is an integrated Ornstein-Uhlenbeck process between knots; how fast it
and the place may change is chosen in each frame, by the likelihood of what is seen.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

import fe
from models.arrays import F64
from models.dynamics.oscillators import Span
from models.dynamics.scales import Columns, choose_scales
from models.dynamics.vibration import FORCE, RATE, REMEMBERED, Vibration

KEPT = 0.1  # s for which a force keeps the speed with which it changes
# Parts of a frequency that a mode may be off, and for how many modes that is followed.
_DETUNED, _LOUDEST = 0.005, 6


@dataclass(frozen=True, eq=False)
class Seeing:
    """What turns modes into a measurement.

    Attributes
    ----------
    modes : fe.Modes
    factor : (K, m) float64
        Whitened measurement of a unit of each mode.
    """

    modes: fe.Modes
    factor: F64


@dataclass(frozen=True, eq=False)
class Followed:
    """A frame after it was followed.

    Attributes
    ----------
    vibration : Vibration
        At its end.
    amplitudes : (K,) float64
        Mean of the modes over its exposure.
    amplitude_factor : (K, r) float64
        What a standard deviation along each direction does to these.
    forces : (n,) float64, N
        Mean force of each touch over the exposure.
    touch_factor : (n, 3, r) float64
        What a standard deviation along each direction does to x, y and that force.
    likelihood : float
        Logarithm of the likelihood of what was seen, but for what no forces change.
    """

    vibration: Vibration
    amplitudes: F64
    amplitude_factor: F64
    forces: F64
    touch_factor: F64
    likelihood: float


@dataclass(frozen=True, eq=False)
class _Knots:
    """Forces (n, p + 1) at the knots of a span, by each direction (n, p + 1, r), and at the end."""

    forces: F64
    factor: F64
    rates: F64
    rate_factor: F64


def follow(
    before: Vibration,
    span: Span,
    seeing: Seeing,
    measured: F64,
    time: float,
    landing: F64 | None = None,
    rounds: int = 1,
) -> Followed:
    """Follow modes and touches into a frame.

    Parameters
    ----------
    before : Vibration
        At the end of the exposure of the last frame.
    span : Span
    seeing : Seeing
    measured : (m,) float64
        In units of its noise.
    time : float, s
        At the end of the exposure.
    landing : (p + 1,) float64, N, optional
        Force of the last touch at the knots, where it has just landed.
    rounds : int
        How often the effect of the places is taken anew about what was found.
    """
    grown, columns = _grown(before, span, seeing)
    knots = _knots(grown, span, columns)
    places, history = grown.touches[:, :2], knots.forces
    if landing is not None:
        history = np.vstack([history[:-1], landing])
    after, history, mean, mean_factor, likelihood = _round(
        grown, columns, knots, span, seeing, measured, places, history
    )
    for _ in range(rounds - 1):
        after, history, mean, mean_factor, likelihood = _round(
            grown, columns, knots, span, seeing, measured, after.touches[:, :2], history
        )
    times = time - span.steps.sum() + np.cumsum(span.steps)
    count = len(times)
    remembered = replace(
        after, times=np.concatenate([before.times, times])
    ).recent(time - REMEMBERED)
    weighed = span.weights[-count:]
    forces = after.forces[:, -count:] @ weighed
    first = span.weights[0]
    touch_factor = np.concatenate(
        [
            after.touch_factor[:, :2],
            np.einsum("j,njr->nr", weighed, after.force_factor[:, -count:])[:, None],
        ],
        axis=1,
    )
    if first:
        forces = forces + first * history[:, 0]
    size = np.linalg.norm(seeing.factor, axis=1)
    return Followed(remembered.compressed(size), mean, mean_factor, forces, touch_factor, likelihood)


def _round(
    grown: Vibration,
    columns: Columns,
    knots: _Knots,
    span: Span,
    seeing: Seeing,
    measured: F64,
    places: F64,
    history: F64,
) -> tuple[Vibration, F64, F64, F64, float]:
    """Correct a frame with the effect of places and forces taken about some of them."""
    predicted = _predicted(grown, knots, span, seeing.modes, places, history)
    mean, mean_factor, at_end = predicted
    seen = seeing.factor.T @ mean_factor
    away = measured - mean @ seeing.factor
    scale, likelihood = choose_scales(columns, seen, away)
    count = knots.forces.shape[1] - 1
    joined = replace(
        at_end,
        forces=np.concatenate([grown.forces, knots.forces[:, 1:]], axis=1),
        force_factor=np.concatenate([grown.force_factor, knots.factor[:, 1:]], axis=1),
    )
    inner = np.eye(len(scale)) + (seen * scale).T @ (seen * scale)
    turn = np.linalg.inv(np.linalg.cholesky(inner)).T
    step = turn @ (turn.T @ (scale * (seen.T @ away)))
    after = joined.moved(scale * step).turned(scale[:, None] * turn)
    begun = knots.forces[:, :1] + knots.factor[:, 0] @ (scale * step)[:, None]
    history = np.concatenate([begun, after.forces[:, -count:]], axis=1)
    return after, history, mean + mean_factor @ (scale * step), mean_factor * scale @ turn, likelihood


def _grown(before: Vibration, span: Span, seeing: Seeing) -> tuple[Vibration, Columns]:
    """Add directions of unit noise: of frequencies, of places and of forces between knots."""
    pressing = np.flatnonzero(before.pressing)
    rest = equilibrium(seeing.modes, before.touches[pressing][:, :2], before.touches[pressing, FORCE])
    swing = np.hypot(before.amplitudes[0] - rest, before.amplitudes[1])
    shown = swing * np.linalg.norm(seeing.factor, axis=1) * span.turn * _DETUNED
    loud = np.argsort(shown)[-_LOUDEST:]
    loud = loud[shown[loud] > 0.1]
    columns = Columns(before.rank, 2 * len(loud), len(pressing), len(span.steps), span.steps.sum())
    grown = before.turned(np.eye(before.rank, columns.total))
    for part in (0, 1):
        where = before.rank + 2 * np.arange(len(loud)) + part
        grown.amplitude_factor[part, loud, where] = (swing * span.turn * _DETUNED)[loud]
    for number, touch in enumerate(pressing):
        for axis in (0, 1):
            grown.touch_factor[touch, axis, columns.place(number) + axis] = 1.0
    return grown, columns


def _knots(grown: Vibration, span: Span, columns: Columns) -> _Knots:
    """Carry the forces on from knot to knot."""
    force, rate = grown.touches[:, FORCE], grown.touches[:, RATE]
    by_force, by_rate = grown.touch_factor[:, FORCE], grown.touch_factor[:, RATE]
    forces, factors = [force], [by_force]
    pressing = np.flatnonzero(grown.pressing)
    own = columns.force(np.arange(len(pressing)))
    for k, step in enumerate(span.steps.tolist()):
        held = np.exp(-step / KEPT)
        after, by_after = held * rate, held * by_rate
        by_after[pressing, own + k] += np.sqrt(step)
        forces.append(forces[-1] + 0.5 * step * (rate + after))
        factors.append(factors[-1] + 0.5 * step * (by_rate + by_after))
        rate, by_rate = after, by_after
    return _Knots(np.stack(forces, axis=1), np.stack(factors, axis=1), rate, by_rate)


def within(modes: fe.Modes, places: F64) -> F64:
    """Places (n, 2) mm, those beside the plate on its edge."""
    return np.clip(places, 0.0, np.array(modes.plate.size))


def equilibrium(modes: fe.Modes, places: F64, forces: F64) -> F64:
    """Amplitudes (K,) of a plate that rests under touches (n, 2) mm and (n,) N."""
    if not len(forces):
        return np.zeros(modes.count)
    return forces @ modes.response(within(modes, places))


def _predicted(
    grown: Vibration, knots: _Knots, span: Span, modes: fe.Modes, places: F64, history: F64
) -> tuple[F64, F64, Vibration]:
    """Mean of the modes over the exposure (K,) and (K, r), and the plate at its end.

    The amplitudes at equilibrium F r(x, y) are taken to first order about `places` (n, 2) and
    `history` (n, p + 1) of the forces.
    """
    places = within(modes, places)
    response, slope = modes.response(places), modes.gradient(places)
    total = knots.factor.shape[2]
    off = grown.touches[:, :2] - places
    amplitudes = np.einsum("abk,bk->ak", span.carry, grown.amplitudes)
    factor = np.einsum("abk,bkr->akr", span.carry, grown.amplitude_factor)
    mean = np.einsum("bk,bk->k", span.seen, grown.amplitudes)
    mean_factor = np.einsum("bk,bkr->kr", span.seen, grown.amplitude_factor)
    kernels = np.concatenate([span.carried, span.pressed[None]])  # (3, p + 1, K)
    for touch in np.flatnonzero(grown.pressing):
        by_force = kernels * response[touch]
        by_place = np.einsum("j,sjk,ka->sak", history[touch], kernels, slope[touch])
        change = np.einsum("sjk,j->sk", by_force, knots.forces[touch])
        change += np.einsum("sak,a->sk", by_place, off[touch])
        basis = np.concatenate([by_force, by_place], axis=1)
        rows = np.concatenate([knots.factor[touch], grown.touch_factor[touch, :2]])
        spread = basis.transpose(0, 2, 1).reshape(-1, len(rows)) @ rows
        spread = spread.reshape(3, -1, total)
        amplitudes, mean = amplitudes + change[:2], mean + change[2]
        factor, mean_factor = factor + spread[:2], mean_factor + spread[2]
    touches, touch_factor = grown.touches.copy(), grown.touch_factor.copy()
    touches[:, FORCE], touches[:, RATE] = knots.forces[:, -1], knots.rates
    touch_factor[:, FORCE], touch_factor[:, RATE] = knots.factor[:, -1], knots.rate_factor
    ended = replace(
        grown,
        amplitudes=amplitudes,
        touches=touches,
        amplitude_factor=factor,
        touch_factor=touch_factor,
    )
    return mean, mean_factor, ended
