"""Where to start: the responses of a grid of candidate touches, made once a forward model."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from models.forward import Forward

EDGE = 0.02  # of a side: closer to a clamped edge a touch leaves no trace


@dataclass(frozen=True, eq=False)
class Search:
    """Candidate touches of a forward model.

    Attributes
    ----------
    forward : Forward
    xy : (G, 2) float64, mm
    response : (G, m) float64, per N
    """

    forward: Forward
    xy: NDArray[np.float64]
    response: NDArray[np.float64]

    @property
    def bounds(self) -> NDArray[np.float64]:
        """Lower and upper corner of the places that a touch may take, (2, 2) mm."""
        size = np.asarray(self.forward.plate.size)
        return np.stack([0.5 * EDGE * size, (1 - 0.5 * EDGE) * size])

    def best(self, residual: NDArray, tangent: NDArray) -> tuple[int, float]:
        """Candidate that explains most of a residual beside the touches already there.

        Parameters
        ----------
        residual : (m,) float64
        tangent : (m, k) float64
            Columns that are free already (derivatives of the touches found so far).

        Returns
        -------
        index : int
        gain : float
            Decrease of χ² by a touch of positive force at that candidate, other touches free.
        """
        basis = np.linalg.qr(tangent)[0]
        inside = self.response @ basis
        left = np.einsum("gm,gm->g", self.response, self.response)
        free = left - np.einsum("gk,gk->g", inside, inside)
        along = self.response @ (residual - basis @ (basis.T @ residual))
        # A candidate that the tangent explains to 1e-6 cannot be told from a touch that is there.
        gain = np.where((along > 0) & (free > 1e-6 * left), along, 0.0) ** 2 / free.clip(1e-300)
        index = int(np.argmax(gain))
        return index, float(gain[index])

    def best_pair(self, residual: NDArray, tangent: NDArray) -> tuple[list[int], NDArray]:
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
        basis = np.linalg.qr(tangent)[0]
        inside = self.response @ basis
        gram = self._gram - inside @ inside.T
        along = self.response @ (residual - basis @ (basis.T @ residual))
        free = np.diag(gram)
        determinant = np.outer(free, free) - gram**2
        force = along[:, None] * free - gram * along  # of the first of each pair, times determinant
        told = determinant > 1e-6 * np.outer(np.diag(self._gram), np.diag(self._gram))
        gain = np.where(told & (force > 0) & (force.T > 0), force * along[:, None], 0.0)
        gain = (gain + gain.T) / np.where(told, determinant, 1.0)
        i, j = (int(k) for k in np.unravel_index(np.argmax(gain), gain.shape))
        if gain[i, j] <= 0:
            return [i, j], np.zeros(2)
        return [i, j], np.array([force[i, j], force[j, i]]) / determinant[i, j]

    @cached_property
    def _gram(self) -> NDArray[np.float64]:
        return self.response @ self.response.T


def prepare_search(forward: Forward, count: int = 32) -> Search:
    """Lay `count` candidates along the longer side of the plate and as dense along the other."""
    width, height = forward.plate.size
    spacing = (1 - 2 * EDGE) * max(width, height) / count
    x, y = (
        np.linspace(EDGE * side, (1 - EDGE) * side, max(2, round(side / spacing)))
        for side in (width, height)
    )
    xy = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    return Search(forward, xy, forward.response(xy))
