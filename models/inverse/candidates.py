"""Where to start: the responses of a grid of candidate touches, made once a forward model."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from models.arrays import F32, F64, AnyArray
from models.checks import check_integer
from models.compiled import njit
from models.forward.linear import Forward, LinearForward

EDGE = 0.02  # of a side: closer to a clamped edge a touch leaves no trace
# A candidate that the tangent explains to so much cannot be kept apart from a touch found.
ALIKE = 1e-6


@dataclass(frozen=True, eq=False)
class CandidateGrid:
    """Candidate touches of a forward model.

    Attributes
    ----------
    forward : Forward
    xy : (G, 2) float64, mm
    response : (G, m) float64, per N
    """

    forward: Forward
    xy: F64
    response: F64

    @cached_property
    def bounds(self) -> F64:
        """Smallest and largest x, y, F that a touch may take, (2, 3) mm, mm, N: forces push."""
        a, b = self.forward.plate.size
        low, high = 0.5 * EDGE, 1 - 0.5 * EDGE
        return np.array([[low * a, low * b, 0.0], [high * a, high * b, np.inf]])

    def prepare(self) -> CandidateGrid:
        """Make now what the first measurement would have to wait for; return the same grid."""
        _ = self.searched
        return self

    @cached_property
    def searched(self) -> tuple[F32, F64, F64]:
        """Responses, their sums of squares and `bounds`, as compiled code takes them."""
        return self._single, self._energy, self.bounds

    def within(self, touches: F64) -> bool:
        """Whether all touches (n, 3) lie within the bounds, and none on a bound of its place."""
        return bool(within(touches, self.bounds))

    def best(self, residual: F64, tangent: F64) -> tuple[int, float, float]:
        """Candidate that explains most of a residual beside the touches already there.

        Parameters
        ----------
        residual : (m,) float64
        tangent : (k, m) float64
            Rows that are free already (derivatives of the touches found so far).

        Returns
        -------
        index : int
        gain : float
            Decrease of χ² by a touch of positive force at that candidate, other touches free.
        force : float, N
            Of that touch.
        """
        return best(self._single, self._energy, residual, tangent)

    def best_pair(self, residual: F64, tangent: F64) -> tuple[list[int], F64]:
        """Two candidates that together explain most of a residual, by trying all pairs.

        Parameters
        ----------
        residual, tangent
            As for `best`.

        Returns
        -------
        indices : list of two int
        force : (2,) float64, N
            Of these two; both zero where no pair of positive forces explains anything.
        """
        i, j, *force = _best_pair(self.response, self._gram, residual, tangent)
        return [i, j], np.array(force)

    def weighted(self, weight: F64) -> CandidateGrid:
        """Trust each measurement by a factor (m,), in a forward model that is linear."""
        if not isinstance(self.forward, LinearForward):
            raise TypeError("weights need a forward model that is linear in the forces")
        forward = self.forward.weighted(weight)
        return replace(self, forward=forward, response=forward.response(self.xy))

    def through(self, forward: Forward, whitening: F64) -> CandidateGrid:
        """Ask a forward model that whitens what this one measures (m,) once more, by (m', m)."""
        response = self._single @ whitening.astype(np.float32).T
        return replace(self, forward=forward, response=response.astype(np.float64))

    @cached_property
    def _single(self) -> F32:
        """Responses to single precision: enough for one place to start from, in half the time."""
        return self.response.astype(np.float32)

    @cached_property
    def _energy(self) -> F64:
        return np.einsum("gm,gm->g", self.response, self.response)

    @cached_property
    def _gram(self) -> F64:
        return self.response @ self.response.T


def prepare_candidates(forward: Forward, count: int = 17) -> CandidateGrid:
    """Lay `count` candidates along the longer side of the plate and as dense along the other.

    Raises
    ------
    ValueError
        If there are fewer than two a side.
    """
    check_integer("candidates along a side", count, 2, "use 17")
    width, height = forward.plate.size
    spacing = (1 - 2 * EDGE) * max(width, height) / count
    x, y = (
        np.linspace(EDGE * side, (1 - EDGE) * side, max(2, round(side / spacing)))
        for side in (width, height)
    )
    xy = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    return CandidateGrid(forward, xy, forward.response(xy))


def unexplained(residual: F64, tangent: F64) -> float:
    """Sum of squares of a residual (m,) that rows free already, (k, m), cannot take away."""
    return _unexplained(residual, tangent)


def with_forward(candidates: CandidateGrid, forward: Forward) -> CandidateGrid:
    """Ask another forward model of the same plate for the same candidates."""
    return CandidateGrid(forward, candidates.xy, forward.response(candidates.xy))


@njit(cache=True, nogil=True)
def within(touches: F64, bounds: F64) -> bool:
    """Whether the places of all touches (n, 3) lie within bounds (2, 3), and none on one."""
    for touch in touches:
        for k in range(2):
            if not bounds[0, k] < touch[k] < bounds[1, k]:
                return False
    return True


@njit(cache=True, nogil=True)
def _unexplained(residual: F64, tangent: F64) -> float:
    outside = _outside(residual, _orthonormal(tangent))
    return float(outside @ outside)


@njit(cache=True, nogil=True)
def _outside(residual: F64, basis: F64) -> F64:
    return residual - (basis @ residual) @ basis


@njit(cache=True, nogil=True, fastmath=True)
def _orthonormal(tangent: F64) -> F64:
    """Orthonormal rows that span what k rows (k, m) span, by Gram and Schmidt, to rounding."""
    basis = tangent.copy()
    for k in range(len(basis)):
        whole = _dot(basis[k], basis[k])
        for before in range(k):
            overlap = _dot(basis[before], basis[k])
            for i in range(basis.shape[1]):
                basis[k, i] -= overlap * basis[before, i]
        left = _dot(basis[k], basis[k])
        # Below this only rounding tells a row from those before.
        basis[k] *= 1.0 / np.sqrt(left) if left > 1e-13 * whole else 0.0
    return basis


@njit(cache=True, nogil=True, fastmath=True)
def _dot(one: AnyArray, other: AnyArray) -> float:
    """Product of two short rows, which a call of BLAS would take longer to begin."""
    total = 0.0 * one[0]
    for i in range(len(one)):
        total += one[i] * other[i]
    return total


@njit(cache=True, nogil=True, fastmath=True)
def _explained(row: F32, basis: F32) -> float:
    """Sum of squares of the part of a row (m,) in an orthonormal basis (k, m).

    Three of its rows, those of one touch, pass through the cache with the row.
    """
    total = 0.0
    for k in range(0, len(basis) - 2, 3):
        x, y, force = np.float32(0.0), np.float32(0.0), np.float32(0.0)
        for i in range(len(row)):
            x += row[i] * basis[k, i]
            y += row[i] * basis[k + 1, i]
            force += row[i] * basis[k + 2, i]
        total += float(x**2 + y**2 + force**2)
    for k in range(len(basis) - len(basis) % 3, len(basis)):
        total += _dot(row, basis[k]) ** 2
    return total


@njit(cache=True, nogil=True)
def best(response: F32, energy: F64, residual: F64, tangent: F64) -> tuple[int, float, float]:
    """Compiled; see `CandidateGrid.best`."""
    basis = _orthonormal(tangent)
    outside = _outside(residual, basis)
    along = response @ outside.astype(np.float32)
    rows = basis.astype(np.float32)
    best, gain, force = 0, 0.0, 0.0
    for g in range(len(along)):
        if along[g] > 0:
            free = energy[g] - _explained(response[g], rows)
            if free > ALIKE * energy[g] and along[g] ** 2 > gain * free:
                best, gain, force = g, along[g] ** 2 / free, along[g] / free
    return best, gain, force


@njit(cache=True, nogil=True)
def _best_pair(
    response: F64, gram: F64, residual: F64, tangent: F64
) -> tuple[int, int, float, float]:
    along, left = response @ residual, gram.copy()
    if len(tangent):
        basis = _orthonormal(tangent)
        inside = response @ basis.T
        along -= inside @ (basis @ residual)
        left -= inside @ inside.T
    best, highest = (0, 0, 0.0, 0.0), 0.0
    for i in range(len(along)):
        for j in range(i + 1, len(along)):
            determinant = left[i, i] * left[j, j] - left[i, j] ** 2
            if determinant <= ALIKE * gram[i, i] * gram[j, j]:
                continue
            # Forces times the determinant.
            first = along[i] * left[j, j] - left[i, j] * along[j]
            second = along[j] * left[i, i] - left[i, j] * along[i]
            if first <= 0 or second <= 0:
                continue
            gain = (first * along[i] + second * along[j]) / determinant
            if gain > highest:
                best, highest = (i, j, first / determinant, second / determinant), gain
    return best
