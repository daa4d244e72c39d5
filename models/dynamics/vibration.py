"""What is known of a plate that vibrates: its modes, the touches on it, and their recent forces."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from models.arrays import F64, Mask
from models.dynamics.seeing import Seeing

X, Y, FORCE, RATE = range(4)
REMEMBERED = 0.4  # s for which forces are kept and go on being corrected
RANK = 40  # directions of what is not known
_FAINT = 1e-3  # standard deviations of a measurement: fainter directions are dropped
# In which unit directions of a touch are weighed against those of a measurement: mm, mm, N, N/s.
_UNITS = np.array([0.1, 0.1, 1e-3, 1e-2])
_UNSTEADY = 0.5  # 1/s, by which the force of a steady touch may be changing, of the force
_LANDING = 20.0  # mm, by which the place of a touch that lands may be off


@dataclass(frozen=True, eq=False)
class Vibration:
    """Gaussian posterior of modes and touches at one time; its covariance is a factor squared.

    Attributes
    ----------
    amplitudes : (2, K) float64
        Amplitude of each mode, and its velocity over its frequency.
    touches : (n, 4) float64, mm, mm, N, N/s
        x, y, F and dF/dt.
    forces : (n, L) float64, N
        Force of each touch at the last knots.
    times : (L,) float64, s
        Of these knots.
    ended : (n,) float64, s
        When each touch ended; not a number while it presses.
    amplitude_factor : (2, K, r) float64
    touch_factor : (n, 4, r) float64
    force_factor : (n, L, r) float64
        What a standard deviation along each of r directions does to each.
    """

    amplitudes: F64
    touches: F64
    forces: F64
    times: F64
    ended: F64
    amplitude_factor: F64
    touch_factor: F64
    force_factor: F64

    @property
    def count(self) -> int:
        """Number of touches."""
        return len(self.touches)

    @property
    def pressing(self) -> Mask:
        """Which touches (n,) have not ended."""
        return np.isnan(self.ended)

    @property
    def rank(self) -> int:
        """Number of directions in which something is not known."""
        return self.amplitude_factor.shape[2]

    def factors(self) -> tuple[F64, F64, F64]:
        """Return the three factors."""
        return self.amplitude_factor, self.touch_factor, self.force_factor

    def turned(self, matrix: F64) -> Vibration:
        """Combine the directions by the columns of a matrix (r, s)."""
        amplitude, touch, force = (factor @ matrix for factor in self.factors())
        return replace(self, amplitude_factor=amplitude, touch_factor=touch, force_factor=force)

    def widened(self, rank: int) -> Vibration:
        """Add directions that do nothing yet, to `rank` of them; its factors may be written to."""
        amplitude, touch, force = (_wider(factor, rank) for factor in self.factors())
        return replace(self, amplitude_factor=amplitude, touch_factor=touch, force_factor=force)

    def moved(self, step: F64) -> Vibration:
        """Move the mean along the directions by so many standard deviations, (r,)."""
        return replace(
            self,
            amplitudes=self.amplitudes + self.amplitude_factor @ step,
            touches=self.touches + self.touch_factor @ step,
            forces=self.forces + self.force_factor @ step,
        )

    def with_touch(self, xy: F64) -> Vibration:
        """Let a touch land near a place (2,) mm; its force begins at nothing."""
        place, knots = np.array([[*xy, 0.0, 0.0]]), np.zeros((1, len(self.times)))
        grown = self.widened(self.rank + 2)
        landing = np.zeros((1, 4, self.rank + 2))
        landing[0, [0, 1], [-2, -1]] = _LANDING
        none = np.zeros((1, len(self.times), self.rank + 2))
        return replace(
            grown,
            touches=np.concatenate([self.touches, place]),
            forces=np.concatenate([self.forces, knots]),
            ended=np.append(self.ended, np.nan),
            touch_factor=np.concatenate([grown.touch_factor, landing]),
            force_factor=np.concatenate([grown.force_factor, none]),
        )

    def ending(self, ended: Mask, time: float) -> Vibration:
        """Let touches (n,) end: their force is nothing from now on, whatever had been left."""
        rows = self.touch_factor[ended, FORCE:].reshape(-1, self.rank)
        known = self.observed(rows / _SMALL, -self.touches[ended, FORCE:].ravel() / _SMALL)
        touches, factor = known.touches.copy(), known.touch_factor.copy()
        touches[ended, FORCE:], factor[ended, FORCE:] = 0.0, 0.0
        when = np.where(ended, time, self.ended)
        return replace(known, touches=touches, touch_factor=factor, ended=when)

    def keeping(self, kept: Mask) -> Vibration:
        """Forget touches other than those kept (n,); what they did to the modes stays."""
        return replace(
            self,
            touches=self.touches[kept],
            forces=self.forces[kept],
            ended=self.ended[kept],
            touch_factor=self.touch_factor[kept],
            force_factor=self.force_factor[kept],
        )

    def observed(self, seen: F64, away: F64) -> Vibration:
        """Correct by a measurement: seen (m, r) of each direction, away (m,) from the mean.

        Both in units of its noise, which is white.
        """
        inner = np.eye(self.rank) + seen.T @ seen
        turn = np.asarray(np.linalg.inv(np.linalg.cholesky(inner)).T, dtype=np.float64)
        return self.moved(turn @ (turn.T @ (seen.T @ away))).turned(turn)

    def compressed(self, units: F64) -> Vibration:
        """Drop directions that hardly show; `units` (K,) is what a unit of each mode shows."""
        if not self.rank:
            return self
        parts = (
            (self.amplitude_factor * units[:, None]).reshape(-1, self.rank),
            (self.touch_factor / _UNITS[:, None]).reshape(-1, self.rank),
            (self.force_factor / _UNITS[FORCE]).reshape(-1, self.rank),
        )
        values, vectors = np.linalg.eigh(
            sum((part.T @ part for part in parts[1:]), parts[0].T @ parts[0])
        )
        kept = values[-RANK:] > _FAINT**2
        return self.turned(vectors[:, -RANK:][:, kept])

    def recent(self, since: float) -> Vibration:
        """Forget knots of the forces before a time, s."""
        kept = self.times >= since
        return replace(
            self,
            times=self.times[kept],
            forces=self.forces[:, kept],
            force_factor=self.force_factor[:, kept],
        )


def _wider(factor: F64, rank: int) -> F64:
    wide = np.zeros((*factor.shape[:-1], rank))
    wide[..., : factor.shape[-1]] = factor
    return wide


_SMALL = 1e-4  # N and N/s: so surely is a force nothing that has ended


def at_rest(modes: int) -> Vibration:
    """Nothing moves, nothing touches, and all of that is known."""
    return Vibration(
        np.zeros((2, modes)),
        np.zeros((0, 4)),
        np.zeros((0, 0)),
        np.zeros(0),
        np.zeros(0),
        np.zeros((2, modes, 0)),
        np.zeros((0, 4, 0)),
        np.zeros((0, 0, 0)),
    )


def at_equilibrium(seeing: Seeing, touches: F64, covariance: F64) -> Vibration:
    """All at rest under touches x, y, F (n, 3) of which so much is known, (3n, 3n)."""
    count = len(touches)
    rest = at_rest(seeing.low)
    if not count:
        return rest
    values, vectors = np.linalg.eigh(covariance)
    root = (vectors * np.sqrt(np.maximum(values, 0.0))).reshape(count, 3, -1)
    rows = np.zeros((count, 4, 4 * count))
    rows[:, :3, : 3 * count] = root
    rows[np.arange(count), RATE, 3 * count + np.arange(count)] = _UNSTEADY * touches[:, 2]
    low = seeing.about(touches[:, :2]).low
    spread = np.zeros((2, seeing.low, 4 * count))
    spread[0] = np.einsum("nr,nk->kr", rows[:, FORCE], low[:, 0])
    spread[0] += np.einsum("n,nar,nak->kr", touches[:, 2], rows[:, :2], low[:, 1:])
    amplitudes = np.zeros((2, seeing.low))
    amplitudes[0] = touches[:, 2] @ low[:, 0]
    return replace(
        rest,
        amplitudes=amplitudes,
        touches=np.column_stack([touches, np.zeros(count)]),
        forces=np.zeros((count, 0)),
        ended=np.full(count, np.nan),
        amplitude_factor=spread,
        touch_factor=rows,
        force_factor=np.zeros((count, 0, 4 * count)),
    )
