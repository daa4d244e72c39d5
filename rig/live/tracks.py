"""Touches over time: which touch of a frame is which of the last, and how fast it moves."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import hypot
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from models import Estimate
from rig.live.touch_filter import TouchFilter, landed

GATE = 13.8  # squared Mahalanobis distance that 1 in 1000 true pairs exceeds, 2 degrees of freedom
MIN_SIGMA = 0.2  # mm; for telling fingers apart no place is known better: a finger is soft
STEADY = 2.0  # speeds that exceed their standard deviation by less are none
ABSENT = 0.15  # s that a touch may be missing before it has left
MOVED = 1.0  # mm, and
SURE = 5.0  # standard deviations of a place, or 3.5 of a difference of two: less is no move
UNKNOWN = np.diag([1e6, 1e6, 1e6])  # mm² and N²: a touch that cannot be resolved


@dataclass(frozen=True, eq=False)
class Track:
    """One touch from its landing to its leaving.

    Attributes
    ----------
    identity : int
        Never given twice.
    posterior : TouchFilter
        Of place, speed and force after the last frame that showed it, by noise alone.
    systematic : (3, 3) float64, mm and N
        Covariance of x, y, F by what is the same in all its frames, as the last one has it.
    last_time : float, s
        Capture time of that frame.
    reported : (float, float), mm
        Where it was at its last event.
    """

    identity: int
    posterior: TouchFilter
    systematic: NDArray[np.float64]
    last_time: float
    reported: tuple[float, float]

    @property
    def seen(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Mean (3,) and covariance (3, 3) of x, y, F, as an estimate of a frame is."""
        mean, noise = self.posterior.seen
        return mean, noise + self.systematic

    @property
    def force(self) -> float:
        """N."""
        return float(self.posterior.mean[4])

    @property
    def velocity(self) -> tuple[float, float]:
        """Along x and y, mm/s."""
        _, _, vx, vy, _ = self.posterior.mean.tolist()
        return vx, vy

    @property
    def sure_velocity(self) -> tuple[float, float]:
        """Along x and y, mm/s, zero for a finger at rest.

        Shrunk towards zero as James and Stein (1961) do, by what its variance would explain.
        """
        vx, vy = self.velocity
        noise = STEADY**2 * np.trace(self.posterior.covariance[2:4, 2:4]) / 2.0
        shrunk = max(0.0, 1.0 - float(noise) / max(vx**2 + vy**2, 1e-12))
        return shrunk * vx, shrunk * vy

    def at(self, time: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Where it is expected at a time, s, and how hard: mean (3,) and covariance (3, 3)."""
        return _predict(self, time).seen


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
    """Carry a track on; the time that it was last seen stays."""
    step = time - track.last_time
    return replace(track, posterior=track.posterior.predict(step)) if step > 0 else track


def _assign(tracks: list[Track], estimate: Estimate) -> dict[int, int]:
    """Pairs of track and touch, by index."""
    cost = np.empty((len(tracks), estimate.count))
    for row, track in enumerate(tracks):
        for column in range(estimate.count):
            spread = _spread(estimate, column)[:2, :2] + MIN_SIGMA**2 * np.eye(2)
            cost[row, column] = track.posterior.distance(estimate.xy[column], spread)
    # A pair beyond the gate costs more than any sum of pairs within, so it is made last.
    barred = np.where(cost <= GATE, cost, GATE * (min(cost.shape, default=0) + 1))
    rows, columns = linear_sum_assignment(barred)
    pairs = zip(rows.tolist(), columns.tolist(), strict=True)
    return {row: column for row, column in pairs if cost[row, column] <= GATE}


def _update(
    track: Track, estimate: Estimate, index: int, time: float
) -> tuple[Track, Event | None]:
    """Correct a predicted track by what was seen; the event is None if it hardly moved."""
    noise, systematic = _parts(estimate, index)
    posterior = track.posterior.update(_seen(estimate, index), noise)
    after = replace(track, posterior=posterior, systematic=systematic, last_time=time)
    (x, y, _), spread = posterior.seen
    away = hypot(x - track.reported[0], y - track.reported[1])
    if away < max(MOVED, SURE * float(np.sqrt(np.linalg.eigvalsh(spread[:2, :2])[-1]))):
        return after, None
    after = replace(after, reported=(float(x), float(y)))
    return after, _event("move", after, time)


def _begin(identity: int, estimate: Estimate, index: int, time: float) -> Track:
    x, y = estimate.xy[index].tolist()
    noise, systematic = _parts(estimate, index)
    return Track(identity, landed(_seen(estimate, index), noise), systematic, time, (x, y))


def _seen(estimate: Estimate, index: int) -> NDArray[np.float64]:
    """Return what a frame says of x, y and F, (3,) float64."""
    return np.append(estimate.xy[index], estimate.force[index])


def _parts(estimate: Estimate, index: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Covariance (3, 3) of x, y and F by noise, and by what is the same in all frames."""
    spread, systematic = estimate.touch_covariance(index), estimate.touch_systematic(index)
    if not np.isfinite(spread).all():
        return UNKNOWN, np.zeros((3, 3))
    return spread - systematic, systematic


def _spread(estimate: Estimate, index: int) -> NDArray[np.float64]:
    """Covariance (3, 3) of x, y and F, wide where the estimate knows nothing of them."""
    spread = estimate.touch_covariance(index)
    return spread if np.isfinite(spread).all() else UNKNOWN


def _event(kind: Literal["appear", "move", "leave"], track: Track, time: float) -> Event:
    x, y, *_ = track.posterior.mean.tolist()
    return Event(kind, track.identity, time, x, y, track.force)
