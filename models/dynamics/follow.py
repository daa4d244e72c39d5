"""One frame of a plate that vibrates: predicted from the last, corrected by what it shows.

An extended Kalman filter whose covariance is kept as a factor of few columns (Verlaan & Heemink
1997): all that is not known of the modes came from few numbers of the forces.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import sqrt
from typing import NamedTuple

import numpy as np
from scipy.linalg.lapack import dtrtrs

from models.arrays import F64
from models.dynamics.expected import Expected, expect
from models.dynamics.oscillators import Span
from models.dynamics.seeing import Seeing, TouchTangent
from models.dynamics.vibration import Vibration

# How fast a finger moves that stays and that slides, mm/s, and how much likelier what is seen must
# be by a slide: odds of 1 in 50.
_STAYS, _SLIDES, _RARE = 5.0, 200.0, 4.0


class ExposedFrame(NamedTuple):
    """One frame.

    Attributes
    ----------
    span : Span
        Since the frame before.
    seeing : Seeing
    measured : (m,) float64
        In units of its noise.
    time : float, s
        End of its exposure.
    """

    span: Span
    seeing: Seeing
    measured: F64
    time: float


class About(NamedTuple):
    """Where the effect of places and forces is taken to first order.

    Attributes
    ----------
    tangent : TouchTangent
        At the places of all touches.
    forces : (n, p + 1) float64, N
        At the knots of a span.
    """

    tangent: TouchTangent
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


def follow(before: Vibration, view: ExposedFrame, agility: float, about: About) -> Followed:
    """Follow modes and touches into a frame.

    Parameters
    ----------
    before : Vibration
        At the end of the exposure of the last frame.
    view : ExposedFrame
    agility : float, N/s per √s
        By which the rates of forces change.
    about : About
    """
    expected = expect(before, view.span, view.seeing, about.tangent, about.forces, agility)
    reduced = about.tangent.reduced(view.seeing, view.measured)
    lower = np.asarray(np.linalg.cholesky(expected.scatter), dtype=np.float64)
    both = np.column_stack([reduced - expected.shown, expected.shown_factor])
    white = _solved(lower, both)
    posterior = _posterior(expected, white[:, 1:], white[:, 0], view.span)
    missed = float(white[:, 0] @ white[:, 0])
    beside = float(view.measured @ view.measured - reduced @ reduced)
    spread = float(np.log(np.diag(lower)).sum())
    return _corrected(
        before,
        view,
        expected,
        posterior,
        posterior.likelihood - 0.5 * (beside + missed) - spread,
        (missed - posterior.explained - len(white)) / sqrt(2.0 * len(white)),
    )


def averaged(followed: Sequence[Followed], weights: F64) -> Followed:
    """Average what several filters (f,) make of a frame, by how likely each is.

    Forces, and what is known of them and the places: filters that differ know less than the
    likeliest alone (Hoeting et al. 1999, equations 5 and 6). All else is that of the first.
    """
    first = followed[0]
    if len(followed) == 1:
        return first
    forces = weights @ [one.forces for one in followed]
    factors: list[F64] = []
    for one, weight in zip(followed, weights.tolist(), strict=True):
        away = one.vibration.touches[:, :2] - first.vibration.touches[:, :2]
        apart = np.column_stack([away, one.forces - forces])[:, :, None]
        factors.append(sqrt(weight) * np.concatenate([one.touch_factor, apart], axis=2))
    return replace(first, forces=forces, touch_factor=np.concatenate(factors, axis=2))


class _Posterior(NamedTuple):
    """Size of each direction (r,), what becomes of them (r, r), and the step along them (r,)."""

    scale: F64
    turn: F64
    step: F64
    likelihood: float
    explained: float


def _posterior(expected: Expected, seen: F64, away: F64, span: Span) -> _Posterior:
    """Weigh all directions by what they explain; places stay or slide, as is likelier."""
    gram, towards = seen.T @ seen, seen.T @ away
    choices: list[tuple[float, F64, F64, F64, float]] = []
    for slide, odds in ((_STAYS, 0.0), (_SLIDES, _RARE)):
        scale = np.ones(len(gram))
        scale[expected.places] = slide * float(span.steps.sum())
        inner = np.eye(len(gram)) + scale[:, None] * gram * scale
        lower = np.asarray(np.linalg.cholesky(inner), dtype=np.float64)
        white = _solved(lower, scale * towards)
        fit = 0.5 * float(white @ white) - float(np.log(np.diag(lower)).sum())
        choices.append((fit - odds, scale, lower, white, fit))
        if not len(expected.places):
            break
    _, scale, lower, white, fit = max(choices, key=lambda one: one[0])
    turn = _solved(lower, np.eye(len(gram))).T
    return _Posterior(scale, turn, scale * (turn @ white), fit, float(white @ white))


def _solved(lower: F64, right: F64) -> F64:
    """Solve L x = b by LAPACK itself: SciPy's checks take longer than systems as small as these."""
    if not len(lower):
        return right
    return np.asarray(dtrtrs(lower.T, right, lower=0, trans=1)[0], dtype=np.float64)


def _corrected(
    before: Vibration,
    view: ExposedFrame,
    expected: Expected,
    posterior: _Posterior,
    likelihood: float,
    surprise: float,
) -> Followed:
    """Correct what was expected by what was found of each direction."""
    turn, step = posterior.scale[:, None] * posterior.turn, posterior.step
    end = expected.vibration.moved(step).turned(turn)
    knots = expected.knots + expected.knot_factor @ step
    weights = view.span.weights
    by_force = np.einsum("j,njr->nr", weights, expected.knot_factor) @ turn
    times = view.time - view.span.steps.sum() + np.cumsum(view.span.steps)
    known = replace(end, times=np.concatenate([before.times, times]))
    return Followed(
        known,
        expected.amplitudes + expected.amplitude_factor @ step,
        knots @ weights,
        np.concatenate([end.touch_factor[:, :2], by_force[:, None]], axis=1),
        knots,
        likelihood,
        surprise,
    )
