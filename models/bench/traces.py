"""What a plate still shows of touches that ended: a few percent of each, or nothing.

A trace is a part of the touch that left it, and of what that would show more if it had pressed a
little further along x and y. At first nothing is known of these three numbers but how large they
usually are; each frame then tells more of them, and until the next touch ends they may have faded.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag

from models.arrays import F64, Mask
from models.bench.bench import BenchEstimate
from models.forward.bench_forward import ASTRAY, BenchForward

# Of what a plate usually keeps: how much a trace may change besides fading, and how far a state
# that is not quite that of the plate may mislead a frame.
_CHANGES = 0.1


@dataclass(frozen=True, eq=False)
class Traces:
    """Touches that ended, and what is known of the traces that they left.

    Attributes
    ----------
    touches : (k, 3) float64, mm, mm, N
        The latest first.
    part : (3k,) float64
        Most likely numbers of each: its part, and that along x and y, all in units of
        `BenchEstimate.memory`; see `BenchForward.left`.
    covariance : (3k, 3k) float64
        Of these.
    """

    touches: F64
    part: F64
    covariance: F64

    def __len__(self) -> int:
        """Count the touches that ended."""
        return len(self.touches)

    def same(self, other: Traces) -> bool:
        """Whether the same is known of the same touches."""
        return self is other or (
            np.array_equal(self.touches, other.touches)
            and np.array_equal(self.part, other.part)
            and np.array_equal(self.covariance, other.covariance)
        )

    def of(self, which: Mask) -> Traces:
        """Return those of some touches, which (k,) says."""
        three = np.repeat(which, 3)
        return Traces(self.touches[which], self.part[three], self.covariance[three][:, three])

    def and_older(self, older: Traces) -> Traces:
        """Return these and older ones, of which they say nothing."""
        return Traces(
            np.concatenate([self.touches, older.touches]),
            np.concatenate([self.part, older.part]),
            block_diag(self.covariance, older.covariance),
        )

    def shown(self, forward: BenchForward, bench: BenchEstimate) -> tuple[F64, F64]:
        """Compute what a measurement shows of them: the most likely, (m,), and how that scatters.

        The covariance of a measurement by what is not known of their numbers is the square of the
        second, (3k, m).
        """
        seen = bench.memory * forward.left(self.touches)
        return self.part @ seen, np.linalg.cholesky(self.covariance).T @ seen

    def misshapen(self, forward: BenchForward, bench: BenchEstimate) -> F64:
        """Compute the covariance of a measurement by how a bench not known shapes them, (m, m).

        Of each, the product of two numbers that are not known: its part, and how much else it would
        show on another bench.
        """
        size = bench.memory**2 * (np.square(self.part) + np.diag(self.covariance))[::3]
        by_bench = forward.left_by_bench(self.touches)
        spread = size[:, None, None] * (bench.covariance @ by_bench)
        columns = by_bench.shape[2]
        return spread.reshape(-1, columns).T @ by_bench.reshape(-1, columns)

    def updated(self, seen: F64, residual: F64) -> Traces:
        """Take in what a frame tells of them.

        Parameters
        ----------
        seen : (m, 3k) float64
            What a unit of each number shows, in units of all else that is not known.
        residual : (m,) float64
            Measurement less all else, in these units.
        """
        precision = np.linalg.inv(self.covariance) + seen.T @ seen
        covariance = np.linalg.inv(precision)
        part = self.part + covariance @ (seen.T @ (residual - seen @ self.part))
        return Traces(self.touches, part, 0.5 * (covariance + covariance.T))

    def faded(self) -> Traces:
        """Let each be less sure: it may have stayed, or gone, or be anything between."""
        covariance = self.covariance + _CHANGES**2 * np.eye(self.part.size)
        for first in range(0, self.part.size, 3):
            own = slice(first, first + 3)
            covariance[own, own] += 0.25 * np.outer(self.part[own], self.part[own])
        return Traces(self.touches, 0.5 * self.part, covariance)


def left_by(touches: F64, moved: F64 | None = None) -> Traces:
    """State what is known of traces that touches (k, 3) have just left.

    Parameters
    ----------
    touches : (k, 3) float64, mm, mm, N
        As they were seen last.
    moved : (k, 2) float64, mm, optional
        How far each had moved from the frame before. It ended up to as far further on, anywhere
        alike: its trace is looked for half-way. Without it all had rested.
    """
    steps = np.zeros((len(touches), 2)) if moved is None else moved
    half_way = touches + np.column_stack([0.5 * steps, np.zeros(len(steps))])
    # Variance of an even distribution.
    return left_about(half_way, steps[:, :, None] * steps[:, None, :] / 12.0)


def left_about(touches: F64, places: F64) -> Traces:
    """State what is known of traces of touches (k, 3) that ended about a place.

    Parameters
    ----------
    touches : (k, 3) float64, mm, mm, N
    places : (k, 2, 2) float64, mm²
        Covariance of where each ended.
    """
    covariance = np.eye(touches.size)
    for index, place in enumerate(places / ASTRAY**2):
        own = slice(3 * index + 1, 3 * index + 3)
        covariance[own, own] += place
    return Traces(touches, np.zeros(touches.size), covariance)


NO_TRACES = left_by(np.empty((0, 3)))
"""Traces of a plate that nothing has touched."""
