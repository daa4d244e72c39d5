"""Cholesky factors of a matrix with a narrow band, and the order of unknowns that makes one."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse as sp
from scipy.linalg import get_lapack_funcs

from fe.arrays import F64, I32, I64
from fe.compiled import njit
from fe.elements.mesh import Mesh

# LAPACK's own functions, which have no types.
_LAPACK: Any = get_lapack_funcs(("pbtrf", "pbtrs"), dtype=np.float64)
_FACTOR, _SOLVE = _LAPACK

Compressed = sp.csr_array | sp.csc_array
"""A symmetric matrix, by rows or by columns alike."""


@dataclass(frozen=True, eq=False)
class Band:
    """Factors L Lᵀ = S K S of a positive matrix, with S = 1/√diag K.

    Attributes
    ----------
    lower : (width + 1, N) float64
        Diagonals of L.
    scale : (N,) float64
        Diagonal of S.
    """

    lower: F64
    scale: F64

    def solve(self, right: F64) -> F64:
        """Solve for right-hand sides, (N,) or (N, C) float64."""
        scale = self.scale if right.ndim == 1 else self.scale[:, None]
        return scale * _SOLVE(self.lower, scale * right, lower=1)[0]


@dataclass(frozen=True, eq=False)
class Ordered:
    """Factors of a matrix whose unknowns stand in another order.

    Attributes
    ----------
    band : Band
    order : (N,) int64
        Unknown of each row of the band.
    """

    band: Band
    order: I64

    def solve(self, right: F64) -> F64:
        """Solve for right-hand sides (N, C) float64."""
        solved = np.empty_like(right)
        solved[self.order] = self.band.solve(right[self.order])
        return solved


def cholesky_by(order: I64, matrix: Compressed) -> Ordered | None:
    """Factor a symmetric matrix in an order (N,); None where it is not positive definite."""
    band = cholesky(matrix[order][:, order])
    return None if band is None else Ordered(band, order)


def by_nodes(mesh: Mesh, components: int) -> I64:
    """Order the flattened unknowns (2 nx + 2, 2 ny + 2, components) by their nodes.

    Nodes along the shorter side stand together, which makes the band of a stiffness narrow.
    """
    index = np.arange(mesh.shape[0] * mesh.shape[1] * components)
    nodes = index.reshape(mesh.shape[0] // 2, 2, mesh.shape[1] // 2, 2, components)
    slow, fast = (0, 2) if mesh.counts[0] >= mesh.counts[1] else (2, 0)
    return nodes.transpose(slow, fast, 1, 3, 4).ravel()


def cholesky(matrix: Compressed) -> Band | None:
    """Factor a symmetric matrix (N, N); None where it is not positive definite."""
    diagonal = matrix.diagonal()
    if not (diagonal > 0).all():
        return None
    scale = 1.0 / np.sqrt(diagonal)
    starts, columns, data = matrix.indptr, matrix.indices, matrix.data
    rows = np.repeat(np.arange(len(diagonal)), np.diff(starts))
    lower = np.zeros((int((rows - columns).max()) + 1, len(diagonal)), order="F")
    _fill(starts, columns, data, scale, lower)
    factor, failed = _FACTOR(lower, lower=1, overwrite_ab=1)
    return None if failed else Band(factor, scale)


@njit(cache=True, nogil=True)
def _fill(starts: I32, columns: I32, data: F64, scale: F64, lower: F64) -> None:
    for row in range(scale.size):
        for k in range(starts[row], starts[row + 1]):
            column = columns[k]
            if column <= row:
                lower[row - column, column] = scale[row] * data[k] * scale[column]
