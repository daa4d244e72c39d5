"""Normal equations of frames that are compared with one reference: its errors are in all of them.

In every tile a frame p shows H δ_p with noise of covariance H (a δ_pq + b): a is the variance of a
pixel of a frame, b that of the reference, which is in all frames alike. For the P frames that see
the tile (a I + b 11ᵀ)⁻¹ = (I - b / (a + b P) 11ᵀ) / a.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from models.arrays import F64, I64, Mask


@dataclass(frozen=True, eq=False)
class SharedReference:
    """Linear motions of the tiles of P frames, in numbers common to all and k of each.

    Attributes
    ----------
    bases : (P, T, 2, shared + k) float64, px
        Motion of the tiles by a unit of the shared numbers, then of those of the frame.
    shared : int
    visible : (P, T) bool
        Tiles that are seen.
    noise : (float, float), grey levels
        Of a frame, and of the reference.
    """

    bases: F64
    shared: int
    visible: Mask
    noise: tuple[float, float]

    @property
    def own(self) -> int:
        """Numbers of each frame, k."""
        return self.bases.shape[3] - self.shared

    def normal(self, hessian: F64) -> F64:
        """Build the normal matrix of all M = shared + P k numbers from H of each tile (T, 2, 2)."""
        total = self._total()
        normal = -_product(total, hessian * self._correction()[:, None, None], total)
        for frame, (basis, seen) in enumerate(zip(self.bases, self.visible, strict=True)):
            columns = self._columns(frame)
            weighed = hessian * seen[:, None, None] / self.noise[0] ** 2
            normal[np.ix_(columns, columns)] += _product(basis, weighed, basis)
        return normal

    def right(self, shown: F64) -> F64:
        """Right-hand side (M,) of what the tiles of each frame show, (P, T, 2)."""
        seen = shown * self.visible[:, :, None]
        right = -np.einsum(
            "tam,ta->m", self._total(), seen.sum(axis=0) * self._correction()[:, None]
        )
        for frame, basis in enumerate(self.bases):
            part = np.einsum("tai,ta->i", basis, seen[frame]) / self.noise[0] ** 2
            right[self._columns(frame)] += part
        return right

    def _correction(self) -> F64:
        """Take b / (a + b P) / a of each tile, (T,)."""
        a, b = np.square(self.noise)
        return b / (a + b * self.visible.sum(axis=0)) / a

    def _columns(self, frame: int) -> I64:
        first = self.shared + frame * self.own
        return np.concatenate([np.arange(self.shared), np.arange(first, first + self.own)])

    def _total(self) -> F64:
        """Sum of the bases that are seen, each in its columns, (T, 2, M)."""
        total = np.zeros((*self.bases.shape[1:3], self.shared + len(self.bases) * self.own))
        for frame, (basis, seen) in enumerate(zip(self.bases, self.visible, strict=True)):
            total[:, :, self._columns(frame)] += basis * seen[:, None, None]
        return total


def _product(left: F64, hessian: F64, right: F64) -> F64:
    """Sum leftᵀ H right over tiles, (T, 2, m) and (T, 2, n) → (m, n)."""
    weighed = np.einsum("tab,tbn->tan", hessian, right)
    count = 2 * len(hessian)
    return left.reshape(count, -1).T @ weighed.reshape(count, -1)
