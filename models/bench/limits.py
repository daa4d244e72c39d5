"""Edges give and never push: no compliance of an edge is negative, at neither of its ends.

The prior of a compliance is symmetric about what is described, and a clamp that is described as
rigid can only give. Where presses cannot tell edges that push from a plate in tension, a descent
without this limit ends in a bench that cannot be.
"""

from __future__ import annotations

import numpy as np

import fe
from models.arrays import F64
from models.bench.bench import NAMES, BenchEstimate

_PLATE = len(fe.BENCH_PARAMETERS)
# Of the prior's σ: by so little a compliance may be negative, at a cost of 1 in χ².
_WIDTH = 0.03


def _ends() -> F64:
    """Compliance of both ends of each edge by the numbers of a bench, (16, 50)."""
    rows: list[F64] = []
    for name in NAMES:
        if f"{name}_slope" in NAMES:
            for sign in (1.0, -1.0):
                row = np.zeros(len(NAMES))
                row[NAMES.index(name)], row[NAMES.index(f"{name}_slope")] = 1.0, sign
                rows.append(row)
    return np.array(rows)


_ENDS = _ends()


def pushing(values: F64, described: F64, prior: BenchEstimate) -> tuple[F64, F64]:
    """Find the ends of edges that push: their rows (n, 50) and their excess (n,), below 0.

    Both in units of which the square adds to χ².

    Parameters
    ----------
    values : (50,) float64
        Numbers of the bench.
    described : (41,) float64
        What the plate's description has of them already.
    prior : BenchEstimate
        By which the limit is soft.
    """
    width = np.maximum(_WIDTH * (np.abs(_ENDS) @ prior.prior), np.finfo(float).tiny)
    compliance = _ENDS @ values + _ENDS[:, :_PLATE] @ described
    below = (compliance < 0.0) & (_ENDS @ prior.prior > 0.0)
    return _ENDS[below] / width[below, None], compliance[below] / width[below]
