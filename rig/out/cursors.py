"""Touches as cursors on a surface: places from 0 to 1, sessions that last, velocities."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import count
from math import hypot

import numpy as np
from numpy.typing import NDArray

from rig.live.snapshot import Mark
from rig.projector.markers import Screen, project

REACH = 0.12  # of the surface; a touch that was further away in the last frame is another one


@dataclass(frozen=True)
class Cursor:
    """One touch as other programs see it.

    Attributes
    ----------
    session : int
        Stays with the touch from its beginning to its end; never given twice.
    x, y : float
        Place from 0 to 1; y runs downwards.
    vx, vy : float
        Velocity, surfaces a second.
    acceleration : float
        Change of the speed, surfaces a second, squared.
    """

    session: int
    x: float
    y: float
    vx: float = 0.0
    vy: float = 0.0
    acceleration: float = 0.0

    @property
    def speed(self) -> float:
        """Speed along the path."""
        return hypot(self.vx, self.vy)


class Cursors:
    """Follows the touches of a loop from frame to frame.

    Parameters
    ----------
    T_surface_plate : (3, 3) float64
        Homography from the plate (x, y, mm) to the surface (0 to 1, y downwards).
    """

    def __init__(self, T_surface_plate: NDArray[np.float64]):
        self._T = T_surface_plate
        self._sessions = count(1)
        self._known: dict[int, int] = {}
        self._last: tuple[Cursor, ...] = ()
        self._time = 0.0

    def update(self, marks: Sequence[Mark], time: float) -> tuple[Cursor, ...]:
        """Cursors of a frame, in the order of their sessions.

        Touches that the loop tracks keep their session; the others continue the nearest cursor.

        Parameters
        ----------
        marks : sequence of Mark
        time : float, s
            Capture time of the frame.
        """
        if marks:
            places = project(self._T, np.array([(mark.x, mark.y) for mark in marks])).clip(0, 1)
        else:
            places = np.empty((0, 2))
        sessions = self._match(marks, places)
        before = {cursor.session: cursor for cursor in self._last}
        step = time - self._time
        now = [
            _move(before.get(session), Cursor(session, *place), step)
            for session, place in zip(sessions, places.tolist(), strict=True)
        ]
        self._last = tuple(sorted(now, key=lambda cursor: cursor.session))
        self._time = time
        return self._last

    def _match(self, marks: Sequence[Mark], places: NDArray[np.float64]) -> list[int]:
        """Session of each touch."""
        present = {mark.identity for mark in marks}
        self._known = {name: one for name, one in self._known.items() if name in present}
        tracked = set(self._known.values())
        free = {one.session: (one.x, one.y) for one in self._last if one.session not in tracked}
        sessions: list[int] = []
        for mark, place in zip(marks, places.tolist(), strict=True):
            if mark.identity is not None:
                if mark.identity not in self._known:
                    self._known[mark.identity] = next(self._sessions)
                session = self._known[mark.identity]
            else:
                session = _nearest(free, place) or next(self._sessions)
            free.pop(session, None)
            sessions.append(session)
        return sessions


def across_plate(size: tuple[float, float]) -> NDArray[np.float64]:
    """Homography of a surface that is the plate itself, `size` its sides in mm."""
    a, b = size
    return np.array([[1 / a, 0.0, 0.0], [0.0, -1 / b, 1.0], [0.0, 0.0, 1.0]])


def across_screen(screen: Screen) -> NDArray[np.float64]:
    """Homography of a surface that is the projector's image, for programs that fill it."""
    width, height = screen.size
    to_unit = np.array([[1 / width, 0, 0.5 / width], [0, 1 / height, 0.5 / height], [0, 0, 1.0]])
    return to_unit @ screen.T_px_plate


def _nearest(free: dict[int, tuple[float, float]], place: list[float]) -> int | None:
    """Session of the nearest cursor within reach."""
    away = {one: hypot(x - place[0], y - place[1]) for one, (x, y) in free.items()}
    nearest = min(away, key=away.__getitem__, default=None)
    return None if nearest is None or away[nearest] > REACH else nearest


def _move(before: Cursor | None, now: Cursor, step: float) -> Cursor:
    """Give a cursor its velocity after `step` s; it rests where it begins or time stands."""
    if before is None or step <= 0:
        return now
    vx, vy = (now.x - before.x) / step, (now.y - before.y) / step
    return replace(now, vx=vx, vy=vy, acceleration=(hypot(vx, vy) - before.speed) / step)
