"""One touch as a net reports it from strains of gauges: is it there, where, how hard and how sure.

A net of places gives a place whatever it is fed. The forward model of the same strains says by how
hard a touch at that place they are explained best, and whether that is more than their noise. What
the net adds to the noise is its own error, which is known where nothing but a touch is in the
strains.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import chdtrc

from models.arrays import F64
from models.estimate import Estimate, Result
from models.forward.camera_gauges import CameraGauges
from models.forward.linear import Forward
from models.inverse.greedy import GAIN
from models.inverse.levenberg_marquardt import covariance
from models.nets.net import Net, predict
from models.nets.refine import refine

NEAR = 9
"""Places around a touch over which the net's own error is averaged: a net is worse near edges."""


@dataclass(frozen=True, eq=False)
class NetTouchEstimator:
    """A net of one touch, and what is known of the strains that it is fed.

    Attributes
    ----------
    net : Net
    whitening : (m, 3M) float64
        From the strains to numbers with white noise.
    forward : Forward
        Of these numbers.
    root : (3M, 3M) float64
        Of the covariance of the strains.
    places, bias : (N, 2) float64, mm
        Touches without noise, and what the net is off by there.
    steps : int
        Steps of the solver that follow what the net reports.
    """

    net: Net
    whitening: F64
    forward: Forward
    root: F64
    places: F64
    bias: F64
    steps: int = 0

    def fit(self, strain: F64) -> Estimate:
        """Find the touch, or none, in strains (M, 3) without missing channels.

        Without solver steps χ² leaves out what a small move of the touch would explain: that is the
        net's error, which the covariance holds.
        """
        flat, forward = strain.ravel(), self.forward
        measured = self.whitening @ flat
        place = np.clip(predict(self.net, flat)[:1], 0.0, forward.plate.size)
        response = forward.response(place)[0]
        power = float(response @ response)  # 0 on an edge that is held
        force = float(measured @ response) / power if power > 0.0 else 0.0
        touch = np.array([[*place[0], force]])
        if self.steps and force > 0.0:
            touch = refine(measured, forward, touch, self.steps)
        predicted, tangent = forward.read(touch)
        if touch[0, 2] <= 0.0 or measured @ measured - _square(measured - predicted) < GAIN:
            return _estimate(np.empty((0, 3)), np.empty((0, 0)), measured)
        residual = measured - predicted
        if self.steps:
            return _estimate(touch, covariance(tangent), residual)
        residual = residual - np.linalg.lstsq(tangent.T, residual, rcond=None)[0] @ tangent
        return _estimate(touch, self._spread(flat, touch[0], tangent), residual)

    def _spread(self, strain: F64, touch: F64, tangent: F64) -> F64:
        """Covariance of x, y, F, (3, 3): of the noise through the net, and of the net's error."""
        response, slopes = tangent[2], tangent[:2] / touch[2]
        power = response @ response
        softer = -touch[2] * (slopes @ response) / power  # N per mm, by the place being off
        off = np.vstack([np.eye(2), softer])
        moved = off @ jacobian(self.net, strain)
        moved[2] += response @ self.whitening / power
        shown, own = moved @ self.root, off @ self._bias_near(touch[:2]).T
        return shown @ shown.T + own @ own.T / NEAR

    def _bias_near(self, place: F64) -> F64:
        """Return what the net is off by at the measured places around one, (NEAR, 2) mm."""
        return self.bias[np.argsort(np.sum((self.places - place) ** 2, axis=1))[:NEAR]]


def prepare_net_estimator(
    net: Net, readings: CameraGauges, root: F64, places: F64, steps: int = 0
) -> NetTouchEstimator:
    """Prepare a net for strains that a camera sees.

    Parameters
    ----------
    net : Net
        Of one place, trained on these gauges.
    readings : CameraGauges
    root : (3M, 3M) float64
        Of the covariance of the strains.
    places : (N, 2) float64, mm
        Where the net's error without noise is measured, at 1 N.
    steps : int
        Of the solver, after the net.

    Raises
    ------
    ValueError
        If the net was trained on other gauges, or reports something else than one place.
    """
    reported = predict(net, readings.strain(places).reshape(len(places), -1))
    if reported.shape[1] != 2:
        raise ValueError(
            f"net must report x and y of one touch, got {reported.shape[1]} numbers; train one"
            " without [dataset]"
        )
    white = readings.white(root)
    return NetTouchEstimator(
        net, white.whitening, white.forward, root, places, reported - places, steps
    )


def jacobian(net: Net, strain: F64) -> F64:
    """Return how what a net reports moves with each strain of one sample (I,): (D, I).

    By differences: a step is a thousandth of the mean strain, far below where activations bend and
    far above what rounding leaves.
    """
    step = 1e-3 * float(np.sqrt(np.mean(np.square(strain)))) or 1e-9
    nudges = step * np.eye(len(strain))
    forth, back = (predict(net, strain + sign * nudges) for sign in (1.0, -1.0))
    return (forth - back).T / (2.0 * step)


def _square(residual: F64) -> float:
    return float(residual @ residual)


def _estimate(touches: F64, spread: F64, residual: F64) -> Estimate:
    chi2, freedom = _square(residual), max(len(residual) - touches.size, 1)
    return Estimate(
        xy=touches[:, :2],
        force=touches[:, 2],
        covariance=spread,
        chi2=chi2,
        dof=freedom,
        p_value=float(chdtrc(freedom, chi2)),
        result=Result.FOUND if len(touches) else Result.NO_TOUCH,
    )
