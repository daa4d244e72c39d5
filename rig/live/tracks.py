"""Touches over time: which touch of a frame is which of the last, and how fast it moves."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import hypot
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from models import Estimate

GATE = 13.8  # squared Mahalanobis distance that 1 in 1000 true pairs exceeds, 2 degrees of freedom
HASTE = 2000.0  # mm/s², by which a finger gains or loses speed; a stroke of 100 mm takes 0.5 s
QUICK = 200.0  # mm/s, standard deviation of the speed with which a finger lands
MIN_SIGMA = 0.2  # mm; what a frame says of a place is no better: a finger is soft
PACE = 0.14  # s over which the velocity of a touch is taken,
FEWEST = 3  # from so many frames or more,
STEADY = 2.0  # and where it exceeds what noise explains by so many standard deviations
ABSENT = 0.15  # s that a touch may be missing before it has left
MOVED = 1.0  # mm, and
SURE = 5.0  # standard deviations of a place, or 3.5 of a difference of two: less is no move


@dataclass(frozen=True, eq=False)
class Track:
    """One touch from its landing to its leaving.

    Attributes
    ----------
    identity : int
        Never given twice.
    motion : (4,) float64, mm and mm/s
        x, y, vx, vy by a Kalman filter.
    covariance : (4, 4) float64
    last_time : float, s
        Capture time of the last frame that showed it.
    force : float, N
        In that frame.
    reported : (float, float), mm
        Where it was at its last event.
    recent : (R, 4) float64, s, mm, mm, mm²
        Time, x and y of the frames of the last `PACE` s, and the sum of both variances.
    """

    identity: int
    motion: NDArray[np.float64]
    covariance: NDArray[np.float64]
    last_time: float
    force: float
    reported: tuple[float, float]
    recent: NDArray[np.float64]

    @property
    def velocity(self) -> tuple[float, float]:
        """Along x and y, mm/s."""
        return float(self.motion[2]), float(self.motion[3])

    @property
    def sure_velocity(self) -> tuple[float, float]:
        """Along x and y, mm/s: the line through the last places, zero for a finger at rest.

        The filter's own velocity follows every sudden move, and so the noise. This one is shrunk
        towards zero as James and Stein (1961) do, by what noise would explain.
        """
        times = self.recent[:, 0] - self.recent[:, 0].mean()
        if len(times) < FEWEST:
            return 0.0, 0.0
        vx, vy = times @ self.recent[:, 1:3] / (times @ times)
        noise = STEADY**2 * self.recent[:, 3].mean() / (times @ times)
        shrunk = max(0.0, 1.0 - noise / max(vx**2 + vy**2, 1e-12))
        return float(shrunk * vx), float(shrunk * vy)


@dataclass(frozen=True)
class Event:
    """Something that began, moved or ended: at a time, s, and a place, mm, with a force, N."""

    kind: Literal["appear", "move", "leave"]
    identity: int
    time: float
    x: float
    y: float
    force: float


@dataclass(frozen=True, eq=False)
class Tracks:
    """All touches that are followed, and how many identities were given."""

    tracks: tuple[Track, ...] = ()
    given: int = 0

    def follow(
        self, estimate: Estimate, time: float
    ) -> tuple[Tracks, tuple[int, ...], tuple[Event, ...]]:
        """Follow the touches into a frame.

        Each touch continues the track that it fits best, all pairs together at the least sum of
        squared Mahalanobis distances (Kuhn-Munkres); pairs beyond `GATE` are none.

        Parameters
        ----------
        estimate : Estimate
        time : float, s
            When the frame was captured.

        Returns
        -------
        Tracks
        identities : (n,) int
            Of the touches of `estimate`, in their order.
        events : tuple of Event
            Moves first, then what appeared, then what left.
        """
        predicted = [_predict(track, time) for track in self.tracks]
        pairs = _assign(predicted, estimate)
        kept: list[Track] = []
        moves: list[Event] = []
        identities: dict[int, int] = {}
        for row, column in pairs.items():
            track, event = _update(predicted[row], estimate, column, time)
            kept.append(track)
            moves += [event] if event else []
            identities[column] = track.identity
        born = [index for index in range(estimate.count) if index not in identities]
        for number, index in enumerate(born, start=self.given + 1):
            kept.append(_begin(number, estimate, index, time))
            identities[index] = number
        appeared = [_event("appear", track, time) for track in kept[len(pairs) :]]
        missing = [track for row, track in enumerate(self.tracks) if row not in pairs]
        left = [track for track in missing if time - track.last_time > ABSENT]
        kept += [track for track in missing if time - track.last_time <= ABSENT]
        events = (*moves, *appeared, *(_event("leave", track, time) for track in left))
        tracks = tuple(sorted(kept, key=lambda track: track.identity))
        order = tuple(identities[index] for index in range(estimate.count))
        return Tracks(tracks, self.given + len(born)), order, events


def _predict(track: Track, time: float) -> Track:
    """Carry a track on at its pace; the time that it was last seen stays."""
    step = max(time - track.last_time, 0.0)
    carry = np.eye(4)
    carry[0, 2] = carry[1, 3] = step
    # White acceleration that is constant over a step (Bar-Shalom, Li & Kirubarajan 2001, 6.3.2).
    gain = np.array([[step**2 / 2, 0], [0, step**2 / 2], [step, 0], [0, step]])
    spread = carry @ track.covariance @ carry.T + HASTE**2 * gain @ gain.T
    return replace(track, motion=carry @ track.motion, covariance=spread)


def _assign(tracks: list[Track], estimate: Estimate) -> dict[int, int]:
    """Pairs of track and touch, by index."""
    cost = np.empty((len(tracks), estimate.count))
    for column in range(estimate.count):
        place, spread = estimate.xy[column], _spread(estimate, column)
        for row, track in enumerate(tracks):
            away = place - track.motion[:2]
            cost[row, column] = away @ np.linalg.solve(track.covariance[:2, :2] + spread, away)
    # A pair beyond the gate costs more than any sum of pairs within, so it is made last.
    barred = np.where(cost <= GATE, cost, GATE * (min(cost.shape, default=0) + 1))
    rows, columns = linear_sum_assignment(barred)
    pairs = zip(rows.tolist(), columns.tolist(), strict=True)
    return {row: column for row, column in pairs if cost[row, column] <= GATE}


def _update(
    track: Track, estimate: Estimate, index: int, time: float
) -> tuple[Track, Event | None]:
    """Correct a predicted track by what was seen; the event is None if it hardly moved."""
    gain = track.covariance[:, :2] @ np.linalg.inv(
        track.covariance[:2, :2] + _spread(estimate, index)
    )
    motion = track.motion + gain @ (estimate.xy[index] - track.motion[:2])
    spread = track.covariance - gain @ track.covariance[:2]
    after = replace(
        track,
        motion=motion,
        covariance=0.5 * (spread + spread.T),
        last_time=time,
        force=float(estimate.force[index]),
        recent=_recall(track.recent, estimate, index, time),
    )
    away = hypot(motion[0] - track.reported[0], motion[1] - track.reported[1])
    if away < max(MOVED, SURE * float(np.sqrt(np.linalg.eigvalsh(spread[:2, :2])[-1]))):
        return after, None
    after = replace(after, reported=(float(motion[0]), float(motion[1])))
    return after, _event("move", after, time)


def _begin(identity: int, estimate: Estimate, index: int, time: float) -> Track:
    spread = np.zeros((4, 4))
    spread[:2, :2] = _spread(estimate, index)
    spread[2, 2] = spread[3, 3] = QUICK**2
    x, y = estimate.xy[index].tolist()
    force = float(estimate.force[index])
    recent = _recall(np.empty((0, 4)), estimate, index, time)
    return Track(identity, np.array([x, y, 0.0, 0.0]), spread, time, force, (x, y), recent)


def _recall(
    recent: NDArray[np.float64], estimate: Estimate, index: int, time: float
) -> NDArray[np.float64]:
    """Add a place to those of the last `PACE` s."""
    kept = recent[time - recent[:, 0] <= PACE]
    return np.vstack([kept, [time, *estimate.xy[index], np.trace(_spread(estimate, index))]])


def _spread(estimate: Estimate, index: int) -> NDArray[np.float64]:
    """Covariance of a place, (2, 2) mm², wide where the estimate knows nothing."""
    spread = np.nan_to_num(estimate.touch_covariance(index)[:2, :2], posinf=1e6, neginf=-1e6)
    return spread + MIN_SIGMA**2 * np.eye(2)


def _event(kind: Literal["appear", "move", "leave"], track: Track, time: float) -> Event:
    x, y = track.motion[:2].tolist()
    return Event(kind, track.identity, time, x, y, track.force)
