"""The shape of a plate at rest: how its middle surface lies over the plane of its frame."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite

import numpy as np

from fe.arrays import F64
from fe.plate.checks import array, number, short


@dataclass(frozen=True)
class Shape:
    """Height of the middle surface at rest, before any touch, over the plane z = 0.

    w0 = sag sin²(πx/a) sin²(πy/b) + Σ c_ij P_i(2x/a - 1) P_j(2y/b - 1), with Legendre's
    polynomials P. The first is the bow of a plate whose clamped edges lie in one plane; products
    of P of degree 2 and more bow and warp the edges as well, those of degree 1 tilt the plate.

    Attributes
    ----------
    sag : float
        Height in the middle of the plate, mm along +z, out of the touched face.
    modes : tuple of tuple of float
        Coefficients c_ij, row i along x and column j along y, mm along +z.

    Raises
    ------
    ValueError
        A number is not finite, or the rows of the table are not of one length.
    """

    sag: float = 0.0
    modes: tuple[tuple[float, ...], ...] = ()

    def __post_init__(self) -> None:
        sag = number(self.sag, "sag of a plate", "mm")
        table = array(self.modes, "modes of a shape", "mm")
        if table.size and table.ndim != 2:
            raise ValueError(
                f"modes of a shape must be rows of coefficients in mm, got {short(self.modes)}; "
                "give one row for each polynomial along x"
            )
        if not (isfinite(sag) and np.isfinite(table).all()):
            raise ValueError(
                f"shape of a plate must be finite, got sag {sag:g} mm and modes "
                f"{short(self.modes)} mm; give numbers"
            )
        object.__setattr__(self, "sag", sag)
        rows: list[list[float]] = table.tolist() if table.size else []
        object.__setattr__(self, "modes", tuple(map(tuple, rows)))

    def at(self, size: tuple[float, float], xy: F64, p: int = 0, q: int = 0) -> F64:
        """Take the derivative of w0 of order p by x and q by y at points of a plate.

        Parameters
        ----------
        size : tuple of float
            Sides (a, b) of the plate, mm.
        xy : (K, 2) float64, mm
        p, q : int

        Returns
        -------
        (K,) float64, mm^(1 - p - q)
        """
        x, y = (self._factors(axis, size, xy[:, axis], order) for axis, order in ((0, p), (1, q)))
        return np.einsum("ki,ij,kj->k", x, self._table, y)

    def on_grid(self, size: tuple[float, float], x: F64, y: F64, p: int = 0, q: int = 0) -> F64:
        """Like `at`, on all pairs of places (X,) and (Y,) mm along the sides: (X, Y) float64."""
        return self._factors(0, size, x, p) @ self._table @ self._factors(1, size, y, q).T

    @property
    def _table(self) -> F64:
        """Coefficients of products of one factor along x and one along y; the first are sin²."""
        rows, columns = len(self.modes), len(self.modes[0]) if self.modes else 0
        table = np.zeros((1 + rows, 1 + columns))
        table[0, 0] = self.sag
        table[1:, 1:] = np.reshape(self.modes, (rows, columns))
        return table

    def _factors(self, axis: int, size: tuple[float, float], x: F64, order: int) -> F64:
        """Differentiate the factors along an axis at places (K,) mm: (K, factors)."""
        count, side = self._table.shape[axis] - 1, size[axis]
        wave = 2.0 * np.pi / side
        bow = -0.5 * wave**order * np.cos(wave * x + 0.5 * np.pi * order) + 0.5 * (order == 0)
        if count == 0:
            return bow[:, None]
        legendre = np.polynomial.legendre
        series = legendre.legder(np.eye(count), order)
        each = np.asarray(legendre.legval(2.0 * x / side - 1.0, series), dtype=np.float64)
        return np.column_stack([bow, (2.0 / side) ** order * each.T])
