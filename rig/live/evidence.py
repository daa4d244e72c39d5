"""What known presses prove: linear equations, weighed by what is known and by how they scatter."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import cast

import numpy as np
from scipy.optimize import root_scalar
from scipy.special import fdtrc

from rig.system.arrays import F64, Mask

SIGNIFICANCE = 0.002  # by which an unknown that is zero seems not to be
FAR = 4.0  # robust standard deviations beyond which a press does not fit the others
# Least scatter that is believed, over the stated variance, however many frames a press is the mean
# of: errors of the reference, which all presses share, would look like a shift.
MIN_SCATTER = 1.0


@dataclass(frozen=True, eq=False)
class Equations:
    """Equations of P presses in k unknowns, c of each press.

    Attributes
    ----------
    design : (P, c, k) float64
    measured : (P, c) float64
    sigma : (P, c) float64
        Standard deviations of what is measured; presses are independent.
    """

    design: F64
    measured: F64
    sigma: F64

    @property
    def freedom(self) -> int:
        """Equations less unknowns."""
        return self.measured.size - self.design.shape[2]

    @property
    def normal(self) -> F64:
        """Normal matrix, (k, k)."""
        return np.einsum("pci,pcj->ij", self._weighed, self.design)

    @property
    def chi2(self) -> float:
        """Sum of squared residuals in units of σ."""
        return float(np.square(self.left() / self.sigma).sum())

    @property
    def scatter(self) -> float:
        """Variance of the presses in units of what is stated."""
        return max(self.chi2 / self.freedom, MIN_SCATTER)

    @property
    def _weighed(self) -> F64:
        return self.design / self.sigma[:, :, None] ** 2

    def of(self, kept: Mask) -> Equations:
        """Keep the equations of some presses, (P,) bool."""
        return Equations(self.design[kept], self.measured[kept], self.sigma[kept])

    def first(self, count: int) -> Equations:
        """Keep the first unknowns; the others are zero."""
        return replace(self, design=self.design[:, :, :count])

    def fit(self) -> F64:
        """Unknowns of least χ², (k,)."""
        right = np.einsum("pci,pc->i", self._weighed, self.measured)
        return cast(F64, np.linalg.solve(self.normal, right))

    def left(self) -> F64:
        """Residuals, (P, c)."""
        return self.measured - self.design @ self.fit()

    def left_out(self) -> float:
        """RMS over presses of the residual of each where it is left out of the fit."""
        leverage = np.einsum(
            "pci,ij,pdj->pcd", self.design, np.linalg.inv(self.normal), self._weighed
        )
        own = np.eye(self.measured.shape[1]) - leverage
        alone = cast(F64, np.linalg.solve(own, self.left()[:, :, None]))
        return float(np.sqrt(np.square(alone).sum(axis=(1, 2)).mean()))

    def shared(self) -> float:
        """Variance that all equations share beside their own, so that χ² is as it should be.

        0 where they fit as they are. R. C. Paule and J. Mandel, "Consensus values and weighting
        factors", J. Res. NBS 87 (1982) 377.
        """

        def surplus(variance: float) -> float:
            return self.widened(variance).chi2 - self.freedom

        if surplus(0.0) <= 0:
            return 0.0
        upper = float(np.square(self.measured).sum())
        return float(root_scalar(surplus, bracket=(0.0, upper)).root)

    def widened(self, variance: float) -> Equations:
        """Add a variance to that of every equation."""
        return replace(self, sigma=np.sqrt(self.sigma**2 + variance))

    def fitting(self) -> Equations:
        """Add the variance that all share."""
        return self.widened(self.shared())

    def agreeing(self) -> Mask:
        """Which presses fit the others, (P,)."""
        kept = np.ones(len(self.measured), dtype=bool)
        for _ in range(2):
            shared = self.of(kept).shared()
            wide = self.widened(shared)
            away = self.measured - self.design @ wide.of(kept).fit()
            distance = np.linalg.norm(away / wide.sigma, axis=1)
            kept = distance <= FAR * max(1.4826 * float(np.median(distance)), 1e-9)
        return kept

    def proven(self, counts: tuple[int, ...]) -> int:
        """Return how many of the unknowns are proven not to be zero: 0 or one of `counts`.

        By F-tests against the scatter that all unknowns together leave.
        """
        taken = 0
        for count in counts:
            fall = max(self.first(taken).chi2 - self.first(count).chi2, 0.0)
            ratio = fall / (count - taken) / self.scatter
            if fdtrc(count - taken, self.freedom, ratio) < SIGNIFICANCE:
                taken = count
        return taken
