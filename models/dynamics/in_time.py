"""Touches of a plate that does not wait for its equilibrium: frame after frame.

A plate at rest or under a steady press is what the estimator of one frame takes it for, and stays
with it. From a landing to the end of the ringing the modes are followed; what they are off from
equilibrium is taken from the measurement before that estimator counts the touches.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from math import pi, sqrt
from typing import NamedTuple

import numpy as np

import fe
from models.arrays import F64, Mask
from models.dynamics.bank import AGILITIES, Bank, advance, land, new_bank, unexplained
from models.dynamics.follow import ExposedFrame, Followed
from models.dynamics.landing import find_landing
from models.dynamics.oscillators import PlateDynamics, span
from models.dynamics.seeing import Seeing
from models.dynamics.tap import ENOUGH, ENOUGH_FAST, SURE, Tap, state_tap
from models.dynamics.vibration import Vibration, at_equilibrium
from models.estimate import Estimate, Result
from models.inverse.estimator import Estimator

SAME = 20.0  # mm, within which two touches are one
FAST = 200.0  # mm/s: a finger that slides faster is looked at frame by frame
STEADY = (
    0.05  # change of a force from one frame to the next, of the force, up to which it is a rest
)
# Standard deviations of χ² by which it may grow from one equilibrium to the next: a bench that is
# not quite as described has a large one all the time.
MISFIT = 4.5
SILENT = 1.0  # standard deviations of a measurement: modes that are off by less are at equilibrium
PAUSE = 1.0  # s without a frame after which what moved is at rest
SETTLED = 0.06  # s after which the ringing has said what it can of the force that began it
CHANGED = 5.0  # standard deviations of one frame by which two may differ
CALM, LOUD = 0.15, 3.0  # s for which modes must be off equilibrium by less, in their noise
TOUCH = 6.0  # standard deviations of a force that is a touch, as for one frame alone


@dataclass(frozen=True, eq=False)
class RingingPlate:
    """What is known of a plate in time.

    Attributes
    ----------
    modes : fe.Modes
    dynamics : PlateDynamics
    exposure : float, s
    """

    modes: fe.Modes
    dynamics: PlateDynamics
    exposure: float


class Shot(NamedTuple):
    """A frame that nothing was followed in yet: `interval` s after the one before."""

    seeing: Seeing
    measured: F64
    interval: float
    time: float

    def view(self, ringing: RingingPlate) -> ExposedFrame:
        """Follow the modes over it."""
        spanned = span(ringing.dynamics, self.interval, ringing.exposure)
        return ExposedFrame(spanned, self.seeing, self.measured, self.time)


@dataclass(frozen=True, eq=False)
class InTime:
    """What goes from one frame to the next.

    Attributes
    ----------
    time : float or None, s
        End of the last exposure.
    touches : (n, 3) float64, mm, mm, N
        Those of the last frame.
    covariance : (3n, 3n) float64
    bank : Bank or None
        None while all is at equilibrium.
    taps : tuple of Tap
        Touches that ended, of which this frame has said the last.
    shown : (n, 2) float64
        Frames that have shown each touch of the filters, and the force, N, that one surely showed.
    shot : Shot or None
        The last frame, while all is at equilibrium.
    earlier : InTime or None
        What went into that frame, while all is at equilibrium.
    swing : (k,) float64
        By how much the low modes are off equilibrium in this frame; empty where they are not.
    calm : float, s
        For how long followed touches have rested.
    chi2 : float
        What touches at equilibrium left of the last frame, where that was looked at.
    """

    time: float | None = None
    touches: F64 = field(default_factory=lambda: np.empty((0, 3)))
    covariance: F64 = field(default_factory=lambda: np.empty((0, 0)))
    bank: Bank | None = None
    taps: tuple[Tap, ...] = ()
    shown: F64 = field(default_factory=lambda: np.empty((0, 2)))
    shot: Shot | None = None
    earlier: InTime | None = None
    swing: F64 = field(default_factory=lambda: np.zeros(0))
    calm: float = 0.0
    chi2: float = 0.0


def estimate_in_time(
    ringing: RingingPlate,
    estimator: Estimator,
    seeing: Seeing,
    measured: F64,
    before: InTime,
    time: float,
) -> tuple[Estimate, InTime]:
    """Find the touches of a frame.

    A frame that is not later than the last, or comes after a pause, is taken as an equilibrium.

    Parameters
    ----------
    ringing : RingingPlate
    estimator : Estimator
        Of a frame at equilibrium.
    seeing : Seeing
    measured : (m,) float64
        In units of its noise.
    before : InTime
    time : float, s
        At the end of the exposure.
    """
    interval = PAUSE if before.time is None else time - before.time
    bank, shot = before.bank, Shot(seeing, measured, interval, time)
    if bank is None or not 0 < interval < PAUSE:
        estimate = estimator.fit_whitened(measured, before.touches)
        state = InTime(time, _touches(estimate), estimate.covariance, chi2=estimate.chi2)
        if not 0 < interval < PAUSE:
            return estimate, state
        if _at_rest(before, estimate, interval):
            return estimate, replace(state, shot=shot, earlier=replace(before, earlier=None))
        bank = _begun(ringing, seeing, before)
        before = replace(before, shown=np.tile([ENOUGH, 0.0], (bank.best.count, 1)))
    view = shot.view(ringing)
    after, followed = advance(bank, view)
    estimate = _counted(estimator, followed, view)
    while after.best.pressing.sum() < estimator.max_touches and _new(followed, estimate):
        landing = find_landing(view.span, seeing, unexplained(followed, view), AGILITIES)
        # It may have landed too late in the frame before to be seen there.
        start, views = Bank(bank.before), (bank.last, view)
        if bank.last is None or not bank.before:
            start, views = bank, (view,)
        landed = land(start, tuple(one for one in views if one), landing)
        if landed is None:
            break
        after, followed = landed
        bank = replace(bank, before=after.begun) if len(views) > 1 else Bank(after.begun)
        estimate = _counted(estimator, followed, view)
    stated, state = _stated(view, estimate, after, followed, before.shown)
    return _calmed(estimator, view, before, stated, state)


def _calmed(
    estimator: Estimator, view: ExposedFrame, before: InTime, stated: Estimate, state: InTime
) -> tuple[Estimate, InTime]:
    """Go back to frames by themselves where touches have rested for some."""
    loud = float(np.linalg.norm(state.swing * view.seeing.size))
    if state.bank is None or not len(state.touches) or loud > LOUD:
        return stated, state
    if not state.bank.best.pressing.all():
        return stated, state
    alone = estimator.fit_whitened(view.measured, state.touches)
    interval = float(view.span.steps.sum())
    if not _at_rest(before, alone, interval):
        return stated, state
    if before.calm + interval < CALM:
        return stated, replace(state, calm=before.calm + interval)
    return alone, InTime(state.time, _touches(alone), alone.covariance, chi2=alone.chi2)


def _begun(ringing: RingingPlate, seeing: Seeing, before: InTime) -> Bank:
    """Begin with all at equilibrium a frame earlier: a touch may have changed since then."""
    if before.earlier is None or before.shot is None:
        return new_bank(at_equilibrium(seeing, before.touches, before.covariance))
    earlier = before.earlier
    bank = new_bank(at_equilibrium(seeing, earlier.touches, earlier.covariance))
    return advance(bank, before.shot.view(ringing))[0]


def _counted(estimator: Estimator, followed: Followed, view: ExposedFrame) -> Estimate:
    """Count the touches in what is left of a measurement when all is at equilibrium."""
    seeing, pressing = view.seeing, followed.vibration.pressing
    places, forces = seeing.within(followed.vibration.touches[pressing, :2]), followed.forces
    away = followed.amplitudes - seeing.equilibrium(places, forces[pressing])
    start = np.column_stack([places, forces[pressing]])
    swinging = away @ seeing.factor[: seeing.low]
    return estimator.fit_whitened(view.measured - swinging, start[start[:, 2] > 0])


def _new(followed: Followed, estimate: Estimate) -> bool:
    """Whether an estimate has a touch that is none of those followed."""
    known = followed.vibration.touches[followed.vibration.pressing]
    return any(not _near(known, touch).any() for touch in _touches(estimate))


def _stated(
    view: ExposedFrame, estimate: Estimate, bank: Bank, followed: Followed, shown: F64
) -> tuple[Estimate, InTime]:
    """State the touches of a frame whose modes were followed."""
    vibration, seeing, time = followed.vibration, view.seeing, view.time
    if not vibration.count:
        return _ringing_alone(view, estimate, bank, followed)
    sigma = np.linalg.norm(followed.touch_factor[:, 2], axis=1)
    there = vibration.pressing & (followed.forces > TOUCH * sigma)
    surely = vibration.forces - SURE * np.linalg.norm(vibration.force_factor, axis=2)
    begun = surely.max(axis=1, initial=0.0) > followed.forces
    ending = vibration.pressing & ~there & begun
    if ending.any():
        bank = bank.ending(ending, time)
    past = vibration.ended <= time - SETTLED
    shown = np.concatenate([shown, np.zeros((vibration.count - len(shown), 2))])
    shown[:, 0] += there
    shown[:, 1] = np.maximum(shown[:, 1], followed.forces - SURE * sigma)
    enough = ENOUGH_FAST if view.span.turn[0] < 2 * pi else ENOUGH
    taps = tuple(
        state_tap(bank, index, shown[index].tolist(), enough)
        for index in np.flatnonzero(past).tolist()
    )
    found = np.column_stack([seeing.within(vibration.touches[there, :2]), followed.forces[there]])
    order = np.lexsort((found[:, 1], found[:, 0]))
    rows = followed.touch_factor[there][order]
    rows = rows.reshape(3 * len(order), followed.touch_factor.shape[2])
    stated = replace(
        estimate,
        xy=found[order, :2],
        force=found[order, 2],
        covariance=rows @ rows.T,
        result=Result.FOUND if len(found) else Result.NO_TOUCH,
    )
    bank = bank.keeping(~past)
    kept = None if _silent(seeing, bank.best) else bank
    swing = followed.amplitudes - seeing.equilibrium(found[:, :2], found[:, 2])
    state = InTime(
        time,
        found[order],
        stated.covariance,
        kept,
        taps,
        shown[~past],
        swing=swing,
        chi2=estimate.chi2,
    )
    return stated, state


def _ringing_alone(
    view: ExposedFrame, estimate: Estimate, bank: Bank, followed: Followed
) -> tuple[Estimate, InTime]:
    """State that nothing touches a plate that may ring."""
    none = replace(
        estimate,
        xy=np.empty((0, 2)),
        force=np.empty(0),
        covariance=np.empty((0, 0)),
        result=Result.NO_TOUCH,
    )
    kept = None if _silent(view.seeing, bank.best) else bank
    return none, InTime(view.time, bank=kept, swing=followed.amplitudes, chi2=estimate.chi2)


def _at_rest(before: InTime, estimate: Estimate, interval: float) -> bool:
    """Whether nothing began since the last frame, at which all was at equilibrium."""
    found, spread = _touches(estimate), MISFIT * sqrt(2.0 * estimate.dof)
    misfit = max(float(estimate.dof), before.chi2) + spread
    if len(found) != len(before.touches) or estimate.chi2 > misfit:
        return False
    moved = np.abs(found - before.touches)
    sigma = np.sqrt(np.diag(estimate.covariance)).reshape(-1, 3)
    far = np.linalg.norm(sigma[:, :2], axis=1)
    close = np.hypot(moved[:, 0], moved[:, 1]) <= FAST * interval + CHANGED * far
    steady = moved[:, 2] <= STEADY * before.touches[:, 2] + CHANGED * sigma[:, 2]
    return bool(close.all() and steady.all())


def _near(touches: F64, touch: F64) -> Mask:
    return np.hypot(touches[:, 0] - touch[0], touches[:, 1] - touch[1]) <= SAME


def _silent(seeing: Seeing, vibration: Vibration) -> bool:
    """Whether modes are at equilibrium as far as a measurement could show, and known to be."""
    if vibration.count:
        return False
    shown = np.square(vibration.amplitudes * seeing.size).sum()
    shown += np.square(vibration.amplitude_factor * seeing.size[:, None]).sum()
    return bool(shown <= SILENT**2)


def _touches(estimate: Estimate) -> F64:
    return np.column_stack([estimate.xy, estimate.force])
