"""What is not known of a bench, as errors of touches, before the bench is built.

The errors of `expected_errors` are those of a bench that is exactly as described. Here its numbers
are known only so well: each is off by its standard deviation, or has been found from presses.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from models.arrays import F64
from models.bench.bench import NAMES, BenchEstimate
from models.bench.marginal import marginal, own_error
from models.design.expected_errors import ExpectedErrors
from models.forward.bench_forward import BenchForward
from models.inverse.levenberg_marquardt import covariance


def errors_on_bench(forward: BenchForward, bench: BenchEstimate, touches: F64) -> ExpectedErrors:
    """Say how well each touch is known that presses alone, on a bench that is known so well.

    Parameters
    ----------
    forward : BenchForward
    bench : BenchEstimate
    touches : (n, 3) float64
        x, y (mm) and F (N).
    """
    spread = [
        covariance(marginal(forward, bench, touch[None]).read(touch[None])[1]) for touch in touches
    ]
    return _errors(touches, np.array(spread))


def cost_of(
    forward: BenchForward, bench: BenchEstimate, names: Sequence[str], touches: F64
) -> ExpectedErrors:
    """Say by how much touches are off where some numbers of the bench are taken as described.

    Everything else is exact and there is no noise: what is left is J⁺ D δ, with the derivatives J
    and D of what is measured by the touch and by the numbers, and δ their errors.

    Parameters
    ----------
    forward : BenchForward
    bench : BenchEstimate
        Its covariance is that of δ.
    names : sequence of str
        Numbers of `BENCH`.
    touches : (n, 3) float64
        x, y (mm) and F (N).
    """
    chosen = [NAMES.index(name) for name in names]
    errors = bench.covariance[np.ix_(chosen, chosen)]
    spread = list[F64]()
    for touch in touches:
        derivatives = forward.by_bench(touch[None])[chosen]
        moved = derivatives @ np.linalg.pinv(forward.read(touch[None])[1])
        spread.append(moved.T @ errors @ moved)
    return _errors(touches, np.array(spread))


def bench_after(
    forward: BenchForward, bench: BenchEstimate, presses: F64, label: F64, noise: float
) -> BenchEstimate:
    """Say how well presses at known places would let the bench be known, before any is made.

    That is the covariance of Laplace about the bench as it is described.

    Parameters
    ----------
    forward : BenchForward
    bench : BenchEstimate
        What is known before.
    presses : (n, 3) float64
        x, y (mm) and F (N).
    label : (3,) float64, mm, mm, 1
        Standard deviations of their places, and of their forces as fractions.
    noise : float
        Of the mean of the frames of a press, in units of that of one: 1/√n.
    """
    known = bench.covariance
    for press in presses:
        seen, own = forward.read(press[None])
        derivatives = forward.by_bench(press[None])
        even = noise**2 + bench.discrepancy**2 * own_error(seen)
        listed = own * (label * np.array([1.0, 1.0, press[2]]))[:, None]
        expected = known @ derivatives
        spread = even * np.eye(len(seen)) + listed.T @ listed + derivatives.T @ expected
        known = known - expected @ np.linalg.solve(spread, expected.T)
        known = 0.5 * (known + known.T)
    return replace(bench, covariance=known)


def _errors(touches: F64, spread: F64) -> ExpectedErrors:
    """Root mean square distances and forces of covariances (n, 3, 3)."""
    variances = np.diagonal(spread, axis1=1, axis2=2)
    return ExpectedErrors(
        touches, np.sqrt(variances[:, 0] + variances[:, 1]), np.sqrt(variances[:, 2])
    )
