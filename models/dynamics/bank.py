"""Several filters side by side, each with forces that change as fast; what is seen weighs them.

Multiple model adaptive estimation (Magill 1965): how restless a finger is cannot be known before,
and one frame says too little of it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from models.arrays import F64, Mask
from models.dynamics.follow import About, Followed, View, follow
from models.dynamics.landing import Landing
from models.dynamics.seeing import Seeing
from models.dynamics.vibration import FORCE, Vibration

RESTLESS = (20.0, 100.0, 500.0, 2500.0, 12500.0)
"""N/s per √s, by which the rate of a force changes: of a slow press up to a hard tap."""
_HOPELESS = 12.0  # by which a logarithm of likelihood may stay behind the best
# A force that changes suddenly, as at a landing and a release: by how many times more than usual, how
# rare that is (logarithm of the odds), and standard deviations of χ² from which on it is thought of.
_SUDDEN, _RARE, _SURPRISING = 25.0, 3.0, 3.0
_WORTH = 8.0  # by which a logarithm of likelihood must grow for one more touch
_ROUNDS, _SETTLED = 3, 0.3  # passes over the frames since a landing at most, and mm by which a place moves
LANDING_FRAMES = 6
"""Frames since a landing that are passed again as its place becomes known."""


@dataclass(frozen=True, eq=False)
class Member:
    """One filter: how restless its forces are, how likely all it has seen, and what it knows."""

    restless: float
    likelihood: float
    vibration: Vibration


@dataclass(frozen=True, eq=False)
class Bank:
    """Filters of one plate, the likeliest first, and the frames since the last landing.

    Attributes
    ----------
    members : tuple of Member
    since : tuple of View
        Frames that are passed again when places turn out to be others; empty once they are known.
    begun : tuple of Member
        The members before these.
    before : tuple of Member
        The members before the last frame.
    last : View, optional
        That frame.
    """

    members: tuple[Member, ...]
    since: tuple[View, ...] = ()
    begun: tuple[Member, ...] = ()
    before: tuple[Member, ...] = ()
    last: View | None = None

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
    return Bank(tuple(Member(restless, 0.0, vibration) for restless in RESTLESS))


def advance(bank: Bank, view: View, seeing: Seeing) -> tuple[Bank, Followed]:
    """Pass a frame, and those since a landing again where that has become clearer."""
    if bank.since:
        since = (*bank.since, view)
        _, once = _passed(bank.members, view, seeing)
        rounds = _rounds(bank.begun, since, seeing, _abouts(once, since))
        members = _level(rounds.members)
        if len(since) < LANDING_FRAMES:
            return Bank(members, since, bank.begun, rounds.before, view), rounds.followed
        return Bank(members, (), (), rounds.before, view), rounds.followed
    members, followed = _passed(bank.members, view, seeing)
    return Bank(_level(members), (), (), bank.members, view), followed


def land(
    bank: Bank, views: tuple[View, ...], seeing: Seeing, landing: Landing
) -> tuple[Bank, Followed] | None:
    """Let a touch land within the last of some frames; `bank` is that before all of them.

    None if that is hardly likelier than that none did.
    """
    begun = tuple(
        Member(one.restless, one.likelihood, one.vibration.with_touch(landing.place))
        for one in bank.members
    )
    start = begun[0].vibration
    abouts: list[About] = []
    for view in views:
        forces = np.repeat(start.touches[:, FORCE, None], len(view.span.weights), axis=1)
        abouts.append(About(start.touches[:, :2], forces))
    abouts[-1].forces[-1] = landing.forces
    rounds = _rounds(begun, views, seeing, abouts)
    without = bank.members
    for view in views:
        without, _ = _passed(without, view, seeing)
    gain = max(one.likelihood for one in rounds.members) - max(one.likelihood for one in without)
    if gain < _WORTH:
        return None
    known = Bank(_level(rounds.members), views, begun, rounds.before, views[-1])
    return known, rounds.followed


class _Rounds(NamedTuple):
    """Filters after some frames and before the last of them, and how that was followed."""

    members: tuple[Member, ...]
    before: tuple[Member, ...]
    followed: Followed


def _level(members: tuple[Member, ...]) -> tuple[Member, ...]:
    """Let the likeliest have a likelihood of one."""
    best = members[0].likelihood
    return tuple(replace(one, likelihood=one.likelihood - best) for one in members)


def _rounds(
    begun: tuple[Member, ...], since: tuple[View, ...], seeing: Seeing, abouts: list[About]
) -> _Rounds:
    """Pass frames about what was found of places and forces until places rest."""
    members = before = begun
    followed: Followed | None = None
    for _ in range(_ROUNDS):
        members = begun
        for view, about in zip(since, abouts, strict=True):
            before = members
            members, followed = _passed(members, view, seeing, about)
        if followed is None:
            break
        places, abouts = abouts[-1].places, _abouts(followed, since)
        if np.abs(abouts[-1].places - places).max(initial=0.0) < _SETTLED:
            break
    if followed is None:
        raise ValueError("there must be a frame to pass")
    return _Rounds(members, before, followed)


def _abouts(followed: Followed, since: tuple[View, ...]) -> list[About]:
    """Places and forces in frames so far, as they are known after the last."""
    vibration, ends = followed.vibration, 0
    counts = [len(view.span.steps) for view in since]
    forces = vibration.forces[:, -sum(counts) :]
    first = followed.knots[:, :1] if len(since) == 1 else forces[:, :1]
    knots = np.concatenate([first, forces], axis=1)
    abouts: list[About] = []
    for count in counts:
        abouts.append(About(vibration.touches[:, :2], knots[:, ends : ends + count + 1]))
        ends += count
    return abouts


def _passed(
    members: tuple[Member, ...], view: View, seeing: Seeing, about: About | None = None
) -> tuple[tuple[Member, ...], Followed]:
    """Pass a frame through each filter; the likeliest first, without those left behind."""
    passed: list[tuple[Member, Followed]] = []
    for one in members:
        followed = follow(one.vibration, view, seeing, one.restless, about)
        likelihood = one.likelihood + followed.likelihood
        if followed.surprise > _SURPRISING:
            sudden = follow(one.vibration, view, seeing, _SUDDEN * one.restless, about)
            if sudden.likelihood - _RARE > followed.likelihood:
                followed = sudden
                likelihood = one.likelihood + sudden.likelihood - _RARE
        passed.append((Member(one.restless, likelihood, followed.vibration), followed))
    passed.sort(key=lambda pair: -pair[0].likelihood)
    best = passed[0][0].likelihood
    kept = [
        replace(one, vibration=one.vibration.compressed(seeing.size))
        for one, _ in passed
        if one.likelihood > best - _HOPELESS
    ]
    return tuple(kept), passed[0][1]


def left(seeing: Seeing, followed: Followed, measured: F64) -> F64:
    """What modes and touches leave of a measurement, (m,)."""
    still = followed.vibration.pressing
    response = seeing.modes.response(seeing.within(followed.vibration.touches[still, :2]))
    stiff = followed.forces[still] @ response[:, seeing.low :] if still.any() else 0.0
    low = followed.amplitudes @ seeing.factor[: seeing.low]
    return measured - low - np.asarray(stiff @ seeing.factor[seeing.low :] if still.any() else 0.0)
