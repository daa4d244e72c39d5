"""Factors of a stiffness, scaled so that soft and stiff parts keep their digits."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import LinearOperator, SuperLU, onenormest, splu

from fe.arrays import F64

# Rounding was seen to leave 4e-18 times the condition number in strains and deflections: here
# 4e-5. Plates with held edges have 1e7 to 1e9 on 100 elements a side; a stiff part that only soft
# ones hold has that times the ratio of their rigidities.
_LARGEST_CONDITION = 1e13

# Right-hand sides a solve: enough to share the reading of the factors. From five on BLAS may start
# threads for each small product, which was four times slower.
_TOGETHER = 4


@dataclass(frozen=True, eq=False)
class Factor:
    """Factors of S K S with S = 1/√diag K, which brings all unknowns to one scale.

    Attributes
    ----------
    factors : SuperLU
    scale : (N,) float64
        Diagonal of S.
    condition : float
        Estimate of the condition number of S K S in the 1-norm.
    """

    factors: SuperLU
    scale: F64
    condition: float

    def solve(self, right: F64) -> F64:
        """Solve for right-hand sides (N, C) float64."""
        scaled = self.scale[:, None] * right
        parts = [
            self.factors.solve(scaled[:, first : first + _TOGETHER])
            for first in range(0, scaled.shape[1], _TOGETHER)
        ]
        return self.scale[:, None] * np.concatenate(parts, axis=1) if parts else scaled


def operator(size: int, apply: Callable[[F64], F64]) -> LinearOperator:
    """Make a symmetric operator for SciPy's iterations from what it does to vectors (size,)."""
    make: Any = LinearOperator  # its constructor is not typed
    return make((size, size), matvec=apply, rmatvec=apply, matmat=apply, dtype=np.float64)


def factor(matrix: sp.csc_array) -> Factor:
    """Factor a symmetric positive matrix (N, N).

    Raises
    ------
    ValueError
        Its condition number is so large that rounding would show.
    """
    scale = 1.0 / np.sqrt(matrix.diagonal())
    scaled = sp.csc_array(sp.diags_array(scale) @ matrix @ sp.diags_array(scale))
    # Symmetric and positive: no pivoting, and minimum degree on the pattern itself.
    factors = splu(
        scaled,
        permc_spec="MMD_AT_PLUS_A",
        diag_pivot_thresh=0.0,
        options={"SymmetricMode": True},
    )
    return Factor(factors, scale, check_condition(scaled, factors.solve))


def check_condition(scaled: sp.csc_array, solve: Callable[[F64], F64]) -> float:
    """Estimate the condition number of a scaled matrix in the 1-norm by how it is solved.

    Raises
    ------
    ValueError
        It is so large that rounding would show.
    """
    inverse = operator(scaled.shape[0], solve)
    condition = float(abs(scaled).sum(axis=0).max() * onenormest(inverse, t=1, itmax=3))
    if condition > _LARGEST_CONDITION:
        raise ValueError(
            f"stiffness of the plate has condition number {condition:.0e}, more than "
            f"{_LARGEST_CONDITION:.0e}: rounding would show in the strains; hold the edges more "
            "firmly or bring the patches nearer to each other"
        )
    return condition
