"""What a model that errs by itself does to the touches that it explains a measurement by.

The error of a forward model is not known, but how large it is: Σ = s² (p/m I + q C), where s is its
norm in units of the noise (`Forward.own_error`), I lies evenly over all m numbers that are measured
and C over what touches anywhere on the plate would do, for these errors look like touches more
than noise does. The fit itself stays that in the noise of the image.
"""

from __future__ import annotations

import numpy as np

from models.arrays import F64
from models.inverse.candidates import CandidateGrid
from models.inverse.levenberg_marquardt import Fit

# Parts p and q = 1 - p: found with `models.forward.large._MISSED`.
EVEN = 0.626


def covariance_with_error(candidates: CandidateGrid, fit: Fit, error: float) -> F64:
    """Covariance of touches (3n, 3n) in noise and in a model that errs by `error` noises.

    Of least squares in white noise, where the noise is not white: G J (1 + Σ) Jᵀ G, G being the
    covariance in noise alone.
    """
    influence = fit.covariance @ fit.jacobian
    like_touches = influence @ candidates.directions.T
    even = influence @ influence.T / influence.shape[1]
    added = EVEN * even + (1.0 - EVEN) * (like_touches @ like_touches.T)
    return np.asarray(fit.covariance + error**2 * added, dtype=np.float64)
