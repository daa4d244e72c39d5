"""What fingers do, out of the touches that are followed: taps, holds, swipes, pairs, hard presses.

A gesture is reported once. A finger that is one of a pair neither taps nor swipes.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from itertools import combinations, pairwise
from math import atan2, hypot, isfinite, pi
from statistics import median
from typing import Literal

Kind = Literal["tap", "hold", "swipe", "pinch", "rotate", "hard press"]
Point = tuple[float, float]

STILL = 5.0  # mm that a finger may wander and still rests
SHORT, LONG = 0.35, 0.6  # s that a tap lasts at most, and a hold at least
FAR, FAST = 15.0, 100.0  # mm and mm/s of a swipe at least,
STRAIGHT = 0.9  # and its length as the crow flies over that of its path
LAST = 0.15  # s before it leaves over which the speed of a swipe is taken
TOGETHER, NEAR = 0.3, 80.0  # s between the landings of a pair, and mm between its fingers
APART = 1.2  # ratio of distances of a pair that pinches, and its inverse
TURNED = 0.3  # rad of a pair that rotates
MOVED = 3.0  # mm that each finger of a pair has moved at least
DRIFT = 0.6  # of its relative motion by which the middle of a pair may move
SETTLED = (0.1, 0.4)  # s after the landing over which the force of a finger is taken,
HARDER, MORE = 1.8, 0.8  # its factor, and N by which a hard press exceeds it
STEP, SOON = 600.0, 0.07  # mm/s of a finger that has just landed, and s after which it has not
ASIDE, TURN = 8.0, 60.0  # mm, and mm/s, by which a finger leaves its course
COARSE = 1.5  # mm, standard deviation of a place that says nothing of what a finger does
GONE = 0.2  # s without a touch after which its finger has left


@dataclass(frozen=True)
class Gesture:
    """One gesture: when, where, whose, and how much.

    Attributes
    ----------
    kind : str
    time : float, s
    x, y : float, mm
        Where it began; of a pair its middle.
    value : float
        Tap and hard press: force, N. Hold: s. Swipe: mm/s. Pinch: ratio of distances. Rotate: rad,
        from x to y.
    angle : float, rad
        Direction of a swipe, from x to y; 0 for others.
    identities : tuple of int
        Of its fingers.
    """

    kind: Kind
    time: float
    x: float
    y: float
    value: float
    angle: float
    identities: tuple[int, ...]


@dataclass
class _Finger:
    """One finger from its landing: its path (s, mm, mm) and its forces (s, N)."""

    identity: int
    path: list[tuple[float, float, float]]
    forces: list[tuple[float, float]]
    held: bool = False
    hard: bool = False
    paired: bool = False

    @property
    def begun(self) -> float:
        return self.path[0][0]

    @property
    def seen(self) -> float:
        return self.path[-1][0]

    @property
    def start(self) -> Point:
        return self.path[0][1:]

    @property
    def end(self) -> Point:
        return self.path[-1][1:]

    def wandered(self) -> float:
        """Largest distance from where it landed, mm."""
        return max(_distance(self.start, point[1:]) for point in self.path)


@dataclass
class Gestures:
    """Call `follow` with the touches of each frame; gives the gestures that it completes."""

    _fingers: list[_Finger] = field(default_factory=list[_Finger])

    def follow(
        self, touches: Iterable[tuple[int, float, float, float, float]], time: float
    ) -> tuple[Gesture, ...]:
        """Follow touches into a frame at `time` s.

        Parameters
        ----------
        touches : iterable of (identity, x, y, force, sigma), mm, mm, N, mm
            The last is the standard deviation of the place in its worst direction; a place that is
            known worse than `COARSE` counts as not seen.
        time : float, s
        """
        for identity, x, y, force, sigma in touches:
            if not (isfinite(x) and isfinite(y) and isfinite(force) and sigma <= COARSE):
                continue
            finger = self._finger_of(identity, time, (x, y))
            finger.identity = identity
            finger.path.append((time, x, y))
            finger.forces.append((time, force))
        found: list[Gesture] = []
        there = [finger for finger in self._fingers if time - finger.seen <= GONE]
        left = [finger for finger in self._fingers if time - finger.seen > GONE]
        found += self._of_pairs(there, time)
        for finger in there:
            found += _hold(finger, time)
            found += _hard_press(finger, time)
        for finger in left:
            found += _leaving(finger, time)
        self._fingers = there
        return tuple(found)

    def _finger_of(self, identity: int, time: float, place: Point) -> _Finger:
        """Return the finger that a touch continues, or a new one.

        The tracker may find a touch that has just left at some distance, where another finger has
        landed, and so take its identity away: the course of a finger says more.
        """
        waiting = [one for one in self._fingers if one.seen < time and _continues(one, time, place)]
        if not waiting:
            self._fingers.append(_Finger(identity, [], []))
            return self._fingers[-1]
        return min(waiting, key=lambda one: (one.identity != identity, _distance(one.end, place)))

    def _of_pairs(self, fingers: Sequence[_Finger], time: float) -> Iterable[Gesture]:
        """Pair free fingers, the nearest first."""
        free = combinations([finger for finger in fingers if not finger.paired], 2)
        for one, other in sorted(free, key=lambda two: _distance(two[0].start, two[1].start)):
            if one.paired or other.paired or not _belong(one, other):
                continue
            if gesture := _of_pair(one, other, time):
                one.paired = other.paired = True
                yield gesture


def _continues(finger: _Finger, time: float, place: Point) -> bool:
    """Whether a touch lies where a finger was going."""
    gap = time - finger.seen
    if len(finger.path) < 2:
        return _distance(finger.end, place) <= STEP * min(gap, SOON)
    (before, x, y), (last, *_) = finger.path[-2:]
    ahead = gap / max(last - before, 1e-9)
    going = _between((x, y), finger.end)
    there = finger.end[0] + ahead * going[0], finger.end[1] + ahead * going[1]
    return _distance(there, place) <= ASIDE + TURN * gap


def _belong(one: _Finger, other: _Finger) -> bool:
    """Whether two fingers may be a pair: landed together, near each other, both in motion."""
    return (
        abs(one.begun - other.begun) <= TOGETHER
        and _distance(one.start, other.start) <= NEAR
        and min(_distance(each.start, each.end) for each in (one, other)) >= MOVED
    )


def _of_pair(one: _Finger, other: _Finger, time: float) -> Gesture | None:
    """Pinch or rotation, whichever is further on; None for a pair that moves as a whole."""
    before, now = _between(one.start, other.start), _between(one.end, other.end)
    middle = _middle(one.start, other.start)
    relative = hypot(now[0] - before[0], now[1] - before[1]) / 2
    if _distance(middle, _middle(one.end, other.end)) > DRIFT * relative:
        return None
    ratio = hypot(*now) / max(hypot(*before), 1e-9)
    turn = (atan2(now[1], now[0]) - atan2(before[1], before[0]) + pi) % (2 * pi) - pi
    spread = max(ratio, 1 / max(ratio, 1e-9)) - 1
    names = (one.identity, other.identity)
    if abs(turn) >= TURNED and abs(turn) / TURNED >= spread / (APART - 1):
        return Gesture("rotate", time, *middle, turn, 0.0, names)
    if spread >= APART - 1:
        return Gesture("pinch", time, *middle, ratio, 0.0, names)
    return None


def _hold(finger: _Finger, time: float) -> list[Gesture]:
    age = time - finger.begun
    if finger.held or finger.paired or age < LONG or finger.wandered() > STILL:
        return []
    finger.held = True
    return [Gesture("hold", time, *finger.start, age, 0.0, (finger.identity,))]


def _hard_press(finger: _Finger, time: float) -> list[Gesture]:
    early, late = (finger.begun + part for part in SETTLED)
    usual = [force for when, force in finger.forces if early <= when <= late]
    force = finger.forces[-1][1]
    if finger.hard or not usual or time < late:
        return []
    if force < max(HARDER * median(usual), median(usual) + MORE):
        return []
    finger.hard = True
    return [Gesture("hard press", time, *finger.end, force, 0.0, (finger.identity,))]


def _leaving(finger: _Finger, time: float) -> list[Gesture]:
    """Tap or swipe of a finger that has left."""
    if finger.paired or finger.held or finger.hard:
        return []
    lasted, name = finger.seen - finger.begun, (finger.identity,)
    if lasted <= SHORT and finger.wandered() <= STILL:
        force = max(force for _, force in finger.forces)
        return [Gesture("tap", time, *finger.start, force, 0.0, name)]
    away = _distance(finger.start, finger.end)
    length = sum(_distance(a[1:], b[1:]) for a, b in pairwise(finger.path))
    last = [point for point in finger.path if finger.seen - point[0] <= LAST]
    pace = _distance(last[0][1:], last[-1][1:]) / max(last[-1][0] - last[0][0], 1e-9)
    if away < FAR or away < STRAIGHT * length or pace < FAST:
        return []
    dx, dy = _between(finger.start, finger.end)
    return [Gesture("swipe", time, *finger.start, pace, atan2(dy, dx), name)]


def _between(one: Point, other: Point) -> Point:
    return other[0] - one[0], other[1] - one[1]


def _middle(one: Point, other: Point) -> Point:
    return (one[0] + other[0]) / 2, (one[1] + other[1]) / 2


def _distance(one: Point, other: Point) -> float:
    return hypot(other[0] - one[0], other[1] - one[1])
