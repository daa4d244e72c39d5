"""One touch on a known base from the strain of gauges."""

from __future__ import annotations

import numpy as np

import fe
from rig.system.arrays import F64

STEPS = 8
"""Of Gauss-Newton."""


class Tangent:
    """Least squares with the tangent of a base: Gauss-Newton from the best place of a grid."""

    def __init__(self, response: fe.ShellInfluence, size: tuple[float, float]) -> None:
        self.response, self.size = response, np.array(size)
        along = [np.linspace(0.06 * side, 0.94 * side, 15) for side in size]
        self.grid = np.stack(np.meshgrid(*along), axis=-1).reshape(-1, 2)
        self.table = response.strain(self.grid).reshape(len(self.grid), -1)

    def read(self, touch: F64) -> tuple[F64, F64]:
        """Return strain (m,) of x, y, F and its derivatives (m, 3)."""
        place, force = touch[None, :2], touch[2]
        unit = self.response.strain(place).ravel()
        slope = self.response.gradient(place).reshape(len(unit), 2)
        return force * unit, np.column_stack([force * slope, unit])

    def fit(self, measured: F64) -> F64:
        """Return x, y, F."""
        power = np.sum(self.table**2, axis=1)
        explained = (self.table @ measured) ** 2 / power
        best = int(np.argmax(explained))
        force = float(self.table[best] @ measured / power[best])
        touch: F64 = np.array([*self.grid[best], force], np.float64)
        for _ in range(STEPS):
            predicted, jacobian = self.read(touch)
            step = np.linalg.lstsq(jacobian, measured - predicted, rcond=None)[0]
            touch = np.asarray(touch + step, np.float64)
            touch[:2] = np.clip(touch[:2], 0.0, self.size)
        return touch
