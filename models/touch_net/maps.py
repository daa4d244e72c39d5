"""The maps that a touch net reads: what a measurement says of forces all over the plate.

Two maps of one grid, linear in the measurement and in newtons, so that they look alike on any
bench: the mean of forces that were drawn at each place by themselves, given the measurement (a
Wiener filter, sharp), and the force that each place would have if it alone were pressed (a matched
filter, smooth, and of little noise).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from models.arrays import F32, F64
from models.forward.linear import LinearForward
from models.touch_net.prior import MAX_TOUCHES, TouchRange

SIDE = 16  # places along each side of the plate
PLACES = SIDE * SIDE
INPUTS = 2 * PLACES + 1
"""Numbers that the net reads: both maps, and how sharp this bench sees."""


def grid(touches: TouchRange) -> F64:
    """Places of the maps, (256, 2) mm, row after row."""
    low, high = touches.bounds[:, :2]
    steps = np.arange(SIDE, dtype=np.float64) / (SIDE - 1)
    along, across = np.tile(steps, SIDE), np.repeat(steps, SIDE)
    return low + np.column_stack([along, across]) * (high - low)


@dataclass(frozen=True, eq=False)
class Maps:
    """From a measurement to the inputs of the net.

    Attributes
    ----------
    matrix : (512, m) float32
    sharpness : float
        Logarithm of the mean norm of a response to 1 N, less 4.
    """

    matrix: F32
    sharpness: float

    def read(self, measured: F64) -> F32:
        """Compute inputs (…, 513) of measurements (…, m) in units of their noise."""
        shown = measured.astype(np.float32) @ self.matrix.T
        even = np.full((*shown.shape[:-1], 1), self.sharpness, dtype=np.float32)
        return np.concatenate([shown, even], axis=-1)


def prepare_maps(forward: LinearForward, touches: TouchRange) -> Maps:
    """Prepare the maps of a forward model."""
    response = forward.response(grid(touches))
    low, high = touches.force
    square = (high**3 - low**3) / (3.0 * (high - low))  # mean square of a force
    spread = 0.5 * MAX_TOUCHES * square / PLACES
    scatter = spread * response.T @ response + np.eye(response.shape[1])
    sharp = spread * np.linalg.solve(scatter, response.T).T
    energy = np.einsum("gm,gm->g", response, response)
    smooth = response / np.maximum(energy, 1e-3 * energy.max())[:, None]
    matrix = np.concatenate([_SHARP * sharp, _SMOOTH * smooth]).astype(np.float32)
    return Maps(np.ascontiguousarray(matrix), float(0.5 * np.log(energy.mean()) - 4.0))


_SHARP, _SMOOTH = 4.0, 0.25  # bring both to about 1
