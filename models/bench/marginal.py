"""Touches in the noise of the image and in all that is not known of the bench.

Where the bench is known as N(θ, C), a measurement scatters about that of the most likely bench by
1 + J C Jᵀ and the model's own error: whitened by it, a touch must bring more than the bench
explains, and its covariance holds both.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import solve_triangular
from scipy.linalg.lapack import dtrtri

import fe
from models.arrays import F64
from models.bench.bench import BenchEstimate
from models.bench.traces import NO_TRACES, Traces
from models.forward.bench_forward import BenchForward

# Of a measurement in units of all that is not known, what a modal plate leaves of it beside any
# touch: in a trial 2 % under 4 N near a corner, the mean of a hundred frames, and less elsewhere.
_LEFT_OVER = 0.02
# Of a finger that presses, glides or lets go: a millimetre and a tenth of its force in a frame
# at 30 fps, in mm/s and 1/s.
_SPEED, _GROWTH = 30.0, 3.0


@dataclass(frozen=True, eq=False)
class MarginalForward:
    """A bench's forward model in units of noise and of what is not known, about some touches.

    Attributes
    ----------
    forward : BenchForward
    whitening : (m, m) float64
        From units of the noise.
    shift : (m,) float64
        What the most likely bench shows more under the touches than that of the forward model.
    """

    forward: BenchForward
    whitening: F64
    shift: F64

    @property
    def plate(self) -> fe.Plate:
        """The plate that is touched."""
        return self.forward.plate

    @property
    def model_error(self) -> float:
        """See `Forward.model_error`."""
        return _LEFT_OVER

    @property
    def freedom(self) -> int:
        """Numbers that were measured."""
        return self.forward.freedom

    def own_error(self, touches: F64) -> float:
        """None beside what is whitened: see `Forward.own_error`."""
        return 0.0

    def whiten(self, measured: ArrayLike) -> F64:
        """Put a measurement as it was taken into units of all that is not known, (m,)."""
        return self.whitened(self.forward.whiten(measured))

    def whitened(self, measured: F64) -> F64:
        """Put a measurement in units of its noise into those of all that is not known, (m,)."""
        return self.whitening @ (measured - self.shift)

    def response(self, xy: F64) -> F64:
        """See `Forward.response`."""
        return self.forward.response(xy) @ self.whitening.T

    def read(self, touches: F64) -> tuple[F64, F64]:
        """See `Forward.read`."""
        values, jacobian = self.forward.read(touches)
        return self.whitening @ values, jacobian @ self.whitening.T


def noise_covariance(forward: MarginalForward, touches: F64, covariance: F64) -> F64:
    """Compute the part that noise alone has in the covariance (3n, 3n) of touches (n, 3).

    An estimate is linear in what is measured about its solution, by C Jᵀ W: noise of variance 1 has
    C Jᵀ W Wᵀ J C of it, and what is left is the same in every frame.
    """
    gain = covariance @ forward.read(touches)[1] @ forward.whitening
    return np.asarray(gain @ gain.T)


def marginal(
    forward: BenchForward, bench: BenchEstimate, touches: F64, left: Traces = NO_TRACES
) -> MarginalForward:
    """Whiten a forward model by noise and bench as they are under some touches (n, 3).

    The plate may still show traces of touches that ended, `left`.
    """
    lower = np.linalg.cholesky(scatter(forward, bench, touches, left))
    whitening = dtrtri(lower.T)[0].T  # the inverse; LAPACK reads columns, so its transpose
    shift = likely_shift(forward, bench, touches)
    if len(left):
        shift = shift + left.shown(forward, bench)[0]
    return MarginalForward(forward, np.asarray(whitening, dtype=np.float64), shift)


def likely_shift(forward: BenchForward, bench: BenchEstimate, touches: F64) -> F64:
    """Compute what the most likely bench shows more than that of the forward model, (m,)."""
    away = bench.values - forward.fields.values
    return away @ forward.by_bench(touches) if away.any() else np.zeros(len(forward.whitening))


def scatter(
    forward: BenchForward, bench: BenchEstimate, touches: F64, left: Traces = NO_TRACES
) -> F64:
    """Covariance of a measurement by noise, memory, bench, change and model error, (m, m)."""
    beside = scatter_beside_bench(forward, bench, touches, left)
    if not len(touches):
        return beside
    derivatives = forward.by_bench(touches)
    return beside + derivatives.T @ (bench.covariance @ derivatives)


def scatter_beside_bench(
    forward: BenchForward, bench: BenchEstimate, touches: F64, left: Traces = NO_TRACES
) -> F64:
    """Compute that covariance without what the numbers of the bench add, (m, m)."""
    even = np.eye(len(forward.whitening))
    if len(left):
        shown = left.shown(forward, bench)[1]
        even += shown.T @ shown + left.misshapen(forward, bench)
    if not len(touches):
        return even
    if forward.rolled is not None:
        moving = rate_sigma(touches).ravel()[:, None] * forward.by_rate(touches)
        even += moving.T @ moving
    own = bench.discrepancy**2 * own_error(forward.read(touches)[0])
    even[np.diag_indices(len(even))] += own
    return even


def rate_sigma(touches: F64) -> F64:
    """How fast touches (n, 3) may move and change, standard deviations: mm/s, mm/s, N/s, (n, 3)."""
    sigma = np.full(touches.shape, _SPEED)
    sigma[:, 2] = _GROWTH * np.abs(touches[:, 2])
    return sigma


def own_error(seen: F64) -> float:
    """Variance of each measured number by a model that errs by as much as it predicts, `seen` (m,).

    Fields that are left out of a plate move all of the image a little, and in no direction that is
    known: the error lies evenly over what is measured.
    """
    return float(seen @ seen) / len(seen)


def traces_after(
    forward: BenchForward, bench: BenchEstimate, measured: F64, touches: F64, left: Traces
) -> Traces:
    """Take in what a frame with touches (n, 3) tells of traces, and how they may fade after it."""
    own = forward.left(left.touches) * bench.memory
    predicted, jacobian = forward.read(touches)
    rest = measured - predicted - likely_shift(forward, bench, touches)
    lower = np.linalg.cholesky(scatter(forward, bench, touches) + left.misshapen(forward, bench))
    rows = np.concatenate([rest[None], jacobian, own]).T
    white = np.asarray(solve_triangular(lower, rows, lower=True, check_finite=False))
    basis = np.linalg.qr(white[:, 1 : 1 + touches.size])[0]
    white -= basis @ (basis.T @ white)
    return left.updated(white[:, 1 + touches.size :], white[:, 0]).faded()
