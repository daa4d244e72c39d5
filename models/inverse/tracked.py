"""A frame that shows the touches of the last one: found in one call of compiled code.

In most frames nothing comes and nothing goes: the descent from the last touches explains all, each
touch stands out and none lies close to another. Then there is nothing to search for, and calls from
one compiled function to the next would take as long as their work.
"""

from __future__ import annotations

from math import sqrt
from typing import NamedTuple

from models.arrays import F32, F64
from models.compiled import njit
from models.forward.linear import LinearForward
from models.forward.table import ForwardTable
from models.inverse.candidates import CandidateGrid, best, within
from models.inverse.descent_kernel import Control, descend_table, sort_touches, weak_or_close
from models.inverse.greedy import CLEAR, GAIN, HOPE, UNUSUAL
from models.inverse.levenberg_marquardt import LevenbergMarquardt
from models.inverse.prior import Prior


class Tracked(NamedTuple):
    """Touches that explain a measurement, as many as the last frame had.

    Attributes
    ----------
    usual : bool
        Whether nothing is to be searched for; otherwise the rest says nothing.
    touches : (n, 3) float64, mm, mm, N
        Sorted by x, then y.
    covariance : (3n, 3n) float64, mm and N
    chi2 : float
    freedom : int
    evidence, apart : float
        Of the weakest touch and of the closest two; see `weak_or_close`.
    converged : bool
        Whether the descent ended by itself.
    within : bool
        Whether no touch lies on a bound of its place.
    steps, evaluations : int
        Of the descent.
    """

    usual: bool
    touches: F64
    covariance: F64
    chi2: float
    freedom: int
    evidence: float
    apart: float
    converged: bool
    within: bool
    steps: int
    evaluations: int


def track(
    measured: F64,
    candidates: CandidateGrid,
    start: F64,
    prior: Prior,
    solver: LevenbergMarquardt,
) -> Tracked | None:
    """Follow touches (n, 3) into a measurement (m,); None where there is more to it.

    That is where the forward model is not linear in forces, or the touches do not explain all, or
    one of them may be none.
    """
    forward = candidates.forward
    if not len(start) or not isinstance(forward, LinearForward):
        return None
    found = Tracked(
        *_track(
            forward.reading,
            candidates.searched,
            measured,
            start,
            prior,
            solver.control,
            forward.freedom,
            forward.model_error,
        )
    )
    return found if found.usual else None


@njit(cache=True, nogil=True)
def _track(
    table: ForwardTable,
    searched: tuple[F32, F64, F64],
    measured: F64,
    start: F64,
    prior: Prior,
    control: Control,
    freedom: int,
    model_error: float,
) -> tuple[bool, F64, F64, float, int, float, float, bool, bool, int, int]:
    """Descend and judge; see `Tracked`, and `CountProblem` for what it judges by."""
    response, energy, bounds = searched
    touches, residual, jacobian, chi2, converged, steps, evaluations, spread = descend_table(
        table, measured, start, bounds, prior, control, 0.0
    )
    known = 0
    for precision in prior.precision:
        known += precision != 0
    freedom = max(freedom - (3 - known) * len(start), 1)
    more = model_error**2 * float(measured @ measured) if model_error else 0.0
    gain = GAIN + more
    _, evidence, _, _, apart = weak_or_close(touches, spread)
    usual = (
        evidence > CLEAR * gain
        and apart > CLEAR * gain
        and chi2 <= freedom + UNUSUAL * sqrt(2.0 * freedom) + more
        and best(response, energy, residual, jacobian)[1] <= HOPE * gain
    )
    inside = within(touches, bounds)
    touches, spread = sort_touches(touches, spread)
    judged = usual, touches, spread, chi2, freedom, evidence, apart
    return *judged, converged, inside, steps, evaluations
