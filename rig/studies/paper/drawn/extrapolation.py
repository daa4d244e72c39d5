"""Where a loss would end if the steps were spent: a power law of the steps, with its uncertainty.

Losses of nets fall as L = c + a·n^(-b) in the steps n at a constant learning rate (Hestness et al.
2017). The fit is to the logarithm of a curve thinned evenly in the logarithm of n. Its uncertainty
comes from three sides: the floor c is free or 0, the fit begins early or late, and the residuals
are drawn anew. What a fit is worth is seen where it is asked for a part of the curve that was held
out.
"""

from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares

from rig.system.arrays import F64

STARTS = (0.1, 0.2, 0.3)
"""Parts of the logarithm of the steps that a fit leaves out, for losses begin otherwise."""

DRAWS = 20  # of the residuals, for each kind of fit


class PowerLaw(NamedTuple):
    """c + a·n^(-b)."""

    floor: float
    size: float
    slope: float

    def at(self, steps: F64) -> F64:
        """Return the loss after some steps."""
        return self.floor + self.size * np.asarray(steps, float) ** -self.slope


class Forecast(NamedTuple):
    """Loss after some steps: the median of all fits, and the range that 9 in 10 of them span."""

    steps: F64
    middle: F64
    low: F64
    high: F64


def fit(steps: F64, loss: F64, with_floor: bool) -> PowerLaw:
    """Fit a power law to the logarithm of a curve; a floor is not below 0."""
    x, y = np.log(steps), np.log(loss)
    slope, size = np.polyfit(x, y, 1)
    start = np.array([np.log(0.3 * loss.min()), size, np.log(max(-slope, 0.05))])

    def residual(parameters: F64) -> F64:
        return np.log(_law(parameters, with_floor).at(steps)) - y

    bounds = ([-20.0, -10.0, -5.0], [np.log(loss.min()), 40.0, 1.0])
    found = least_squares(residual, np.clip(start, *bounds), bounds=bounds, loss="soft_l1")
    return _law(found.x, with_floor)


def _law(parameters: F64, with_floor: bool) -> PowerLaw:
    floor, size, slope = np.exp(parameters)
    return PowerLaw(float(floor) if with_floor else 0.0, float(size), float(slope))


def forecast(steps: F64, loss: F64, at: F64, rng: np.random.Generator) -> Forecast:
    """Extrapolate a curve.

    Parameters
    ----------
    steps, loss
        (N,) of a training at a constant learning rate, mm.
    at
        (K,) steps to extrapolate to.
    rng
        Source of the residuals that are drawn.
    """
    found: list[F64] = []
    for begin in STARTS:
        kept = np.log(steps) >= np.log(steps[0]) + begin * np.ptp(np.log(steps))
        for with_floor in (False, True):
            law = fit(steps[kept], loss[kept], with_floor)
            off = np.log(loss[kept] / law.at(steps[kept]))
            for _ in range(DRAWS):
                drawn = law.at(steps[kept]) * np.exp(rng.choice(off, len(off)))
                found.append(fit(steps[kept], drawn, with_floor).at(at))
    low, middle, high = np.percentile(found, (5, 50, 95), axis=0)
    return Forecast(at, middle, low, high)


def held_out(
    steps: F64, loss: F64, part: float, rng: np.random.Generator
) -> tuple[Forecast, float, bool]:
    """Extrapolate from the first `part` of the steps to the last.

    Returns
    -------
    The forecast at the end, its error over what was measured there, and whether the range holds it.
    """
    early = steps <= part * steps[-1]
    end = np.array([steps[-1]])
    said = forecast(steps[early], loss[early], end, rng)
    true = float(np.exp(np.log(loss[-3:]).mean()))
    return said, float(said.middle[0] / true - 1.0), bool(said.low[0] <= true <= said.high[0])
