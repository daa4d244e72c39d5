"""Edges give and never push: no compliance of an edge is negative, at neither of its ends.

The prior of a compliance is symmetric about what is described, and a clamp that is described as
rigid can only give. Where presses cannot tell edges that push from a plate in tension, a descent
without this limit ends in a bench that cannot be.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.optimize import nnls

import fe
from models.arrays import F64
from models.bench.bench import NAMES, BenchEstimate

_PLATE = len(fe.BENCH_PARAMETERS)
# Of the prior's σ: by so little a compliance may be negative, at a cost of 1 in χ².
HARD = 1e-3  # in a descent
SOFT = 0.03  # in a covariance: a number at its limit is not known to HARD


def _ends() -> F64:
    """Compliance of both ends of each edge by the numbers of a bench, (16, 63)."""
    rows: list[F64] = []
    for name in NAMES:
        if f"{name}_slope" in NAMES:
            for sign in (1.0, -1.0):
                row = np.zeros(len(NAMES))
                row[NAMES.index(name)], row[NAMES.index(f"{name}_slope")] = 1.0, sign
                rows.append(row)
    return np.array(rows)


_ENDS = _ends()


def pushing(values: F64, described: F64, prior: BenchEstimate, width: float) -> tuple[F64, F64]:
    """Find the ends of edges that push: their rows (n, 63) and their excess (n,), below 0.

    Both in units of which the square adds to χ².

    Parameters
    ----------
    values : (63,) float64
        Numbers of the bench.
    described : (54,) float64
        What the plate's description has of them already.
    prior : BenchEstimate
    width : float
        Compliance below 0 that costs 1, in σ of the prior: `HARD` or `SOFT`.
    """
    rows, room = ends(values, described, prior, width)
    below = room < 0.0
    return rows[below], room[below]


def ends(values: F64, described: F64, prior: BenchEstimate, width: float) -> tuple[F64, F64]:
    """Find the ends of all edges that may give: rows (n, 63) and compliances (n,).

    Parameters are those of `pushing`, and so are the units.
    """
    sigma = np.abs(_ENDS) @ prior.prior
    rows = _ENDS[sigma > 0.0]
    unit = width * sigma[sigma > 0.0]
    compliance = rows @ values + rows[:, :_PLATE] @ described
    return rows / unit[:, None], compliance / unit


class LimitedStep(NamedTuple):
    """A step within limits, (P,), and by how much χ² is more than without them."""

    step: F64
    cost: float


def limited(step: F64, covariance: F64, rows: F64, room: F64) -> LimitedStep:
    """Limit a step so that no end pushes after it.

    Of all steps it is the one that makes χ², limits included, smallest, where χ² is square about
    the one that is given. By its dual: Lagrange multipliers of the ends (n,), none of them
    negative.

    Parameters
    ----------
    step : (P,) float64
        That makes χ² smallest without limits.
    covariance : (P, P) float64
        By which χ² grows about it.
    rows : (n, P) float64
        Compliances by the step, in units of which the square adds to χ²; see `ends`.
    room : (n,) float64
        Compliances before it.
    """
    if not len(rows):
        return LimitedStep(step, 0.0)
    given = covariance @ rows.T
    spread = rows @ given + np.eye(len(rows))
    root = np.linalg.cholesky(spread)
    multipliers = nnls(root.T, -np.linalg.solve(root, room + rows @ step))[0]
    return LimitedStep(step + given @ multipliers, float(multipliers @ spread @ multipliers))
