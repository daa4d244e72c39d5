"""Several filters side by side, each with forces that change as fast; what is seen weighs them.

Multiple model adaptive estimation (Magill 1965): how fast the force of a finger changes cannot be
known before, and one frame says too little of it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from models.arrays import F64, Mask
from models.dynamics.follow import About, ExposedFrame, Followed, averaged, follow
from models.dynamics.landing import Landing
from models.dynamics.vibration import FORCE, REMEMBERED, Vibration

AGILITIES = (20.0, 100.0, 500.0, 2500.0, 12500.0)
"""N/s per √s, by which the rate of a force changes: of a slow press up to a hard tap."""
_HOPELESS = 8.0  # by which a logarithm of likelihood may stay behind the best
# A force that changes suddenly, as at a landing and a release: by how many times more than usual,
# how rare that is (logarithm of the odds), and standard deviations of χ² from which it is tried.
_SUDDEN, _RARE, _SURPRISING = 25.0, 3.0, 3.0
# By how much a logarithm of likelihood must grow for one more touch, and the fraction of a
# measurement that forces between knots may leave of themselves.
_WORTH, _MODEL_ERROR = 8.0, 0.02
# Passes over the frames since a landing, and mm by which places move in the last.
_ROUNDS, _SETTLED = 3, 0.3
LANDING_FRAMES = 6
"""Frames since a landing that are passed again as its place becomes known."""


@dataclass(frozen=True, eq=False)
class Member:
    """One filter: how fast its forces change, how likely all it has seen, and what it knows."""

    agility: float
    likelihood: float
    vibration: Vibration


@dataclass(frozen=True, eq=False)
class Bank:
    """Filters of one plate, the likeliest first, and the frames since the last landing.

    Attributes
    ----------
    members : tuple of Member
    since : tuple of ExposedFrame
        Frames that are passed again when places turn out to be others; empty once they are known.
    begun : tuple of Member
        The members before these.
    before : tuple of Member
        The members before the last frame.
    last : ExposedFrame, optional
        That frame.
    """

    members: tuple[Member, ...]
    since: tuple[ExposedFrame, ...] = ()
    begun: tuple[Member, ...] = ()
    before: tuple[Member, ...] = ()
    last: ExposedFrame | None = None

    @property
    def weights(self) -> F64:
        """How likely each filter is by all it has seen, (f,)."""
        return _weights(self.members)

    @property
    def best(self) -> Vibration:
        """What the likeliest filter knows."""
        return self.members[0].vibration

    def ending(self, ended: Mask, time: float) -> Bank:
        """Let touches (n,) end, for all filters."""
        return replace(
            self,
            members=self._each(lambda vibration: vibration.ending(ended, time)),
            since=(),
            begun=(),
        )

    def keeping(self, kept: Mask) -> Bank:
        """Forget touches other than those kept (n,)."""
        if kept.all():
            return self
        members = self._each(lambda vibration: vibration.keeping(kept))
        return Bank(members)

    def _each(self, change: Callable[[Vibration], Vibration]) -> tuple[Member, ...]:
        return tuple(replace(one, vibration=change(one.vibration)) for one in self.members)


def new_bank(vibration: Vibration) -> Bank:
    """Begin with one state for all."""
    return Bank(tuple(Member(agility, 0.0, vibration) for agility in AGILITIES))


def advance(bank: Bank, view: ExposedFrame) -> tuple[Bank, Followed]:
    """Pass a frame, and those since a landing again as its place becomes known."""
    members, followed = _passed(bank.members, view)
    if not bank.since:
        return Bank(_kept(members, (view,)), (), (), bank.members, view), followed
    since = (*bank.since, view)
    alive = {one.agility for one in bank.members}
    begun = tuple(one for one in bank.begun if one.agility in alive)
    rounds = _rounds(begun, since, _abouts(followed, since))
    members = _kept(rounds.members, since)
    if len(since) < LANDING_FRAMES:
        return Bank(members, since, begun, rounds.before, view), rounds.followed
    return Bank(members, (), (), rounds.before, view), rounds.followed


def land(
    bank: Bank, views: tuple[ExposedFrame, ...], landing: Landing
) -> tuple[Bank, Followed] | None:
    """Let a touch land within the last of some frames; `bank` is that before all of them.

    None if that is hardly likelier than that none did.
    """
    begun = tuple(
        Member(one.agility, one.likelihood, one.vibration.with_touch(landing.place))
        for one in bank.members
    )
    abouts = [_expected(begun[0].vibration, view) for view in views]
    abouts[-1].forces[-1] = landing.forces
    rounds = _rounds(begun, views, abouts)
    without = bank.members
    for view in views:
        without, _ = _passed(without, view)
    energy = float(views[-1].measured @ views[-1].measured)
    worth = _WORTH + 0.5 * _MODEL_ERROR**2 * energy
    if rounds.members[0].likelihood - without[0].likelihood < worth:
        return None
    known = Bank(_kept(rounds.members, views), views, begun, rounds.before, views[-1])
    return known, rounds.followed


class _Rounds(NamedTuple):
    """Filters after some frames and before the last of them, and how that was followed."""

    members: tuple[Member, ...]
    before: tuple[Member, ...]
    followed: Followed


def _kept(members: tuple[Member, ...], since: tuple[ExposedFrame, ...]) -> tuple[Member, ...]:
    """Let the likeliest have a likelihood of one, and forget forces of long ago.

    Those of frames that may be passed again are kept, however far apart the frames are.
    """
    best, first = members[0].likelihood, since[0]
    begins = first.time - float(first.span.steps.sum())
    earliest = min(begins, since[-1].time - REMEMBERED)
    return tuple(
        replace(one, likelihood=one.likelihood - best, vibration=one.vibration.recent(earliest))
        for one in members
    )


def _rounds(
    begun: tuple[Member, ...], since: tuple[ExposedFrame, ...], abouts: list[About]
) -> _Rounds:
    """Pass frames about what was found of places and forces until places rest."""
    for _ in range(_ROUNDS - 1):
        rounds = _once(begun, since, abouts)
        places, abouts = abouts[-1].tangent.places, _abouts(rounds.followed, since)
        if np.abs(abouts[-1].tangent.places - places).max(initial=0.0) < _SETTLED:
            return rounds
    return _once(begun, since, abouts)


def _once(
    begun: tuple[Member, ...], since: tuple[ExposedFrame, ...], abouts: list[About]
) -> _Rounds:
    """Pass frames once."""
    before = begun
    for view, about in zip(since[:-1], abouts[:-1], strict=True):
        before, _ = _passed(before, view, about)
    members, followed = _passed(before, since[-1], abouts[-1])
    return _Rounds(members, before, followed)


def _expected(vibration: Vibration, view: ExposedFrame) -> About:
    """Places and forces as they would go on."""
    forces = vibration.touches[:, FORCE:] @ view.span.forces[:, :2].T
    return About(view.seeing.about(vibration.touches[:, :2]), forces)


def _abouts(followed: Followed, since: tuple[ExposedFrame, ...]) -> list[About]:
    """Places and forces in frames so far, as they are known after the last."""
    vibration, begins = followed.vibration, 0
    seeing = since[-1].seeing
    tangent = seeing.about(vibration.touches[:, :2])
    counts = [len(view.span.steps) for view in since]
    forces = vibration.forces[:, -sum(counts) :]
    first = followed.knots[:, :1] if len(since) == 1 else forces[:, :1]
    knots = np.concatenate([first, forces], axis=1)
    abouts: list[About] = []
    for view, count in zip(since, counts, strict=True):
        if view.seeing is not seeing:
            seeing = view.seeing
            tangent = seeing.about(vibration.touches[:, :2])
        abouts.append(About(tangent, knots[:, begins : begins + count + 1]))
        begins += count
    return abouts


def _passed(
    members: tuple[Member, ...], view: ExposedFrame, about: About | None = None
) -> tuple[tuple[Member, ...], Followed]:
    """Pass a frame through each filter; the likeliest first, without those left behind."""
    about = about or _expected(members[0].vibration, view)
    passed = [_after(one, view, about) for one in members]
    passed.sort(key=lambda pair: -pair[0].likelihood)
    best = passed[0][0]
    passed = [pair for pair in passed if pair[0].likelihood > best.likelihood - _HOPELESS]
    if not best.vibration.count:
        passed = passed[:1]
    kept = tuple(
        replace(one, vibration=one.vibration.compressed(view.seeing.size)) for one, _ in passed
    )
    return kept, averaged([each for _, each in passed], _weights(kept))


def _weights(members: tuple[Member, ...]) -> F64:
    """How likely each filter is, (f,), of all of them together."""
    likelihood = np.array([one.likelihood for one in members])
    weights = np.exp(likelihood - likelihood.max())
    return weights / weights.sum()


def _after(one: Member, view: ExposedFrame, about: About) -> tuple[Member, Followed]:
    """Pass a frame through one filter; where it surprises, with forces that change suddenly."""
    followed = follow(one.vibration, view, one.agility, about)
    likelihood = one.likelihood + followed.likelihood
    if followed.surprise > _SURPRISING and one.vibration.pressing.any():
        sudden = follow(one.vibration, view, _SUDDEN * one.agility, about)
        if sudden.likelihood - _RARE > followed.likelihood:
            followed, likelihood = sudden, one.likelihood + sudden.likelihood - _RARE
    return Member(one.agility, likelihood, followed.vibration), followed


def unexplained(followed: Followed, view: ExposedFrame) -> F64:
    """Subtract what modes and touches explain from a measurement, (m,)."""
    seeing, pressing = view.seeing, followed.vibration.pressing
    low = followed.amplitudes @ seeing.factor[: seeing.low]
    response = seeing.modes.response(seeing.within(followed.vibration.touches[pressing, :2]))
    stiff = followed.forces[pressing] @ response[:, seeing.low :]
    return view.measured - low - stiff @ seeing.factor[seeing.low :]
