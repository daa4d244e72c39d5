"""Touches as notes: on where a finger lands on a key, as loud as its force rose fast, off after.

The velocity is that of MIDI, 1 to 127, and even in the logarithm of the rise, as loudness is:
v = 127 ln(r / SOFT) / ln(HARD / SOFT). The rise r, N/s, is the steepest from frame to frame from
the last frame without the finger until `LISTEN` s after the first one with it.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from math import inf, log
from typing import NamedTuple

from rig.live.snapshot import Mark
from rig.live.tracks import ABSENT
from rig.projector.demos.keyboard import Keyboard

SOFT, HARD = 2.0, 100.0  # N/s of the softest and the loudest note
LISTEN = 0.03  # s: one frame more than the first at 30 a second, and what is felt as at once
STRUCK = 0.08  # s without a finger, after which its key is struck again: two frames of 30 a second
RELEASED = 0.15  # of its largest force, below which a finger has let go of its key
LOUDEST = 127


class Note(NamedTuple):
    """A key that goes down, or up where `velocity` is 0, as MIDI counts both."""

    pitch: int
    velocity: int


@dataclass(frozen=True)
class Held:
    """One finger on a key.

    Attributes
    ----------
    identity, pitch : int
    landed, seen : float, s
        First and last frame with it.
    force, largest : float, N
        Of the last frame, and of all.
    rise : float, N/s
        The steepest so far.
    velocity : int
        0 before its note is on.
    over : bool
        Whether it has let go, and its note is off.
    """

    identity: int
    pitch: int
    landed: float
    seen: float
    force: float
    largest: float
    rise: float
    velocity: int = 0
    over: bool = False


@dataclass(frozen=True)
class Playing:
    """All fingers on the keys.

    Attributes
    ----------
    keyboard : Keyboard
    time : float or None, s
        Of the last frame; None before the first.
    held : tuple of Held
    ignored : tuple of int
        Fingers that landed beside the keys.
    """

    keyboard: Keyboard
    time: float | None = None
    held: tuple[Held, ...] = ()
    ignored: tuple[int, ...] = ()

    def after(self, touches: Iterable[Mark], time: float) -> tuple[Playing, tuple[Note, ...]]:
        """Go on to a frame at `time` s; gives what sounds and what ends with it."""
        marks = {mark.identity or 0: mark for mark in touches}
        known, lifted = self._known(marks, time)
        ignored = [name for name in self.ignored if name in marks]
        fingers: list[Held] = []
        for name, mark in marks.items():
            if name in known:
                fingers.append(_pressed(known[name], mark, time))
            elif name in ignored:
                continue
            elif (pitch := self.keyboard.pitch_at(mark.x, mark.y)) is None:
                ignored.append(name)
            else:
                fingers.append(_landed(name, pitch, mark, time, self.time))
        fingers += [*lifted, *(one for name, one in known.items() if name not in marks)]
        after = [_sounded(one, time) for one in fingers]
        notes = [note for one, now in zip(fingers, after, strict=True) for note in _notes(one, now)]
        kept = tuple(one for one in after if time - one.seen <= ABSENT)
        return Playing(self.keyboard, time, kept, tuple(ignored)), tuple(notes)

    def _known(self, marks: dict[int, Mark], time: float) -> tuple[dict[int, Held], list[Held]]:
        """Tell fingers that go on from those that were lifted, whose name another one has now.

        A touch that has just left may lend its identity to one that lands near by: what was not
        there in the last frame, and is on another key now, has landed there; and what comes again
        to its key after `STRUCK` s has struck it again.
        """
        known: dict[int, Held] = {}
        lifted: list[Held] = []
        for one in self.held:
            mark = marks.get(one.identity)
            away = self.time is not None and one.seen < self.time
            if (
                mark
                and away
                and (
                    time - one.seen > STRUCK or self.keyboard.pitch_at(mark.x, mark.y) != one.pitch
                )
            ):
                lifted.append(replace(one, seen=-inf))
            else:
                known[one.identity] = one
        return known, lifted

    def lit(self) -> dict[int, int]:
        """Velocity of each pitch that sounds."""
        return {one.pitch: one.velocity for one in self.held if one.velocity and not one.over}


def velocity_of(rise: float) -> int:
    """Velocity, 1 to 127, of a force that rises by `rise` N/s."""
    if rise <= SOFT:
        return 1
    return min(max(round(LOUDEST * log(rise / SOFT) / log(HARD / SOFT)), 1), LOUDEST)


def _landed(name: int, pitch: int, mark: Mark, time: float, before: float | None) -> Held:
    force = max(mark.force, 0.0)
    rise = force / (time - before) if before is not None and time > before else 0.0
    return Held(name, pitch, time, time, force, force, rise)


def _pressed(one: Held, mark: Mark, time: float) -> Held:
    """Follow a finger on its key; the key stays that on which it landed."""
    step, rise = time - one.seen, one.rise
    if step > 0 and not one.velocity:
        rise = max(rise, (mark.force - one.force) / step)
    largest = max(one.largest, mark.force)
    return replace(one, seen=time, force=mark.force, largest=largest, rise=rise)


def _sounded(one: Held, time: float) -> Held:
    """Sound a note that was listened to, and end one that was let go."""
    gone = time - one.seen > ABSENT or one.force < RELEASED * one.largest
    if not one.velocity and (gone or time - one.landed >= LISTEN):
        one = replace(one, velocity=velocity_of(one.rise))
    return replace(one, over=one.over or gone)


def _notes(before: Held, now: Held) -> Iterable[Note]:
    if now.velocity and not before.velocity:
        yield Note(now.pitch, now.velocity)
    if now.over and not before.over:
        yield Note(now.pitch, 0)
