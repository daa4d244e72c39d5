"""How far the numbers of a bench are from what was known beforehand, in standard deviations.

The prior of a clamp and of a tension is one in parts of the plate's own stiffness: a clamp that
gives as much as a plate is soft, a tension that warms up with a plate that is stiff. Touches of
unknown force show just such parts, and with a prior of absolute numbers they would seem to say how
stiff the plate is.
"""

from __future__ import annotations

import numpy as np

from models.arrays import F64, Mask
from models.bench.bench import NAMES, BenchEstimate, correlation_root

# A prior grows with powers of the plate's E and h: a membrane is stiff as E h, bending as E h³.
_GROWTH = {"tension": (1.0, 1.0), "rotation": (-1.0, -3.0), "membrane": (-1.0, -1.0)}
_POWERS = np.array([_GROWTH.get(name.split("_")[0], (0.0, 0.0)) for name in NAMES])
_STIFFNESS = [NAMES.index("young"), NAMES.index("thickness")]


def deviation(values: F64, prior: BenchEstimate, free: Mask) -> tuple[F64, F64]:
    """Compute deviations of the free numbers from the prior, and their derivatives.

    Parameters
    ----------
    values : (63,) float64
        Numbers of the bench.
    prior : BenchEstimate
    free : (63,) bool
        P numbers that may differ from the prior.

    Returns
    -------
    deviations : (P,) float64
        In standard deviations of the prior; of numbers that were measured together, along
        directions that are independent.
    derivatives : (P, P) float64
        By those numbers, in units of their standard deviations.
    """
    stiffer = (values - prior.values)[_STIFFNESS]
    relative = values * np.exp(-_POWERS @ stiffer)
    derivatives = np.diag(np.exp(-_POWERS @ stiffer))
    derivatives[:, _STIFFNESS] -= _POWERS * relative[:, None]
    scales = prior.sigma[free]
    deviations = (relative - prior.values)[free] / scales
    by_numbers = derivatives[np.ix_(free, free)] * scales / scales[:, None]
    if not prior.measured:
        return deviations, by_numbers
    rows = np.concatenate([deviations[:, None], by_numbers], axis=1)
    rows = np.asarray(np.linalg.solve(correlation_root(prior, free), rows), dtype=np.float64)
    return rows[:, 0], rows[:, 1:]
