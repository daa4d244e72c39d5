"""What answers for a plate: touches in, the strain of its gauges out.

Data sets are written from any function of this kind: by superposition where touches are small,
and by a theory of large deflections where they are not.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

import fe

__all__ = ["Answer", "superpose"]

Answer = Callable[[NDArray[np.float64]], NDArray[np.float64]]
"""From touches (n, k, 3), mm, mm, N, to strain (n, M, 3): exx, eyy, exy of M gauges."""


def superpose(influence: fe.Influence, radius: float = 0.0) -> Answer:
    """Return the answer of linear theory: strains of single touches add, each times its force.

    Parameters
    ----------
    influence
        Of the gauges.
    radius
        Of the disc that a touch presses, mm; 0 for a point.
    """

    def strain(touches: NDArray[np.float64]) -> NDArray[np.float64]:
        single = influence.strain(touches[..., :2].reshape(-1, 2), radius)
        single = single.reshape(*touches.shape[:2], -1, 3)
        return np.einsum("nk,nkmc->nmc", touches[..., 2], single)

    return strain
