"""A prefilter for tile sums that no frame has to pass.

Smoothed by the same symmetric filter G, gradient and difference of two images give Σ(G∇f)(Ge),
which is Σ(GG∇f)e but for the rims of the sums. So the gradient of the reference passes the filter
twice, and the frame none: its noise stays white, and tiles stay independent of each other.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dic.arrays import F32, F64, AnyArray
from dic.images.image import check_reference
from dic.images.prefilter import Prefilter, choose_tile_prefilter
from dic.numbers import read_integer, read_real

_FLAT = 1e-6  # of the median Σφ²: added to that of each tile, since one without pattern has none
_NOTHING = 1e-30  # where no tile has any


@dataclass(frozen=True, eq=False)
class SmoothGradient:
    """Gradient of a reference that passed a prefilter twice, by which frames are read.

    Attributes
    ----------
    prefilter : Prefilter
    coefficients : (H, W) float32
        Coefficients of the B-spline of degree 7 through the smoothed image.
    gradient : (2, H, W) float32, grey levels per px
        φ, its slopes at the pixels.
    scale : (T, 2, 2) float64
        A = (Σ∇fφᵀ)(Σφφᵀ)⁻¹ of each tile. With Aφ in the place of ∇f, what a motion does to the
        right-hand side, ΣAφ∇fᵀ, and its noise, ΣAφφᵀAᵀ, are one matrix again: a Hessian.
    """

    prefilter: Prefilter
    coefficients: F32
    gradient: F32
    scale: F64

    def vectors(self, sums: F64) -> F64:
        """Scale Σφe of each tile, (T, 2)."""
        (a, b), (c, d) = self.scale.transpose(1, 2, 0)  # ten times as fast as products of matrices
        x, y = sums.T
        return np.column_stack([a * x + b * y, c * x + d * y])

    def hessian(self, products: F64) -> F64:
        """Scale Σφxφx, Σφxφy, Σφyφy of each tile, (T, 3)."""
        (a, b), (c, d) = self.scale.transpose(1, 2, 0)
        xx, xy, yy = products.T
        return np.column_stack(
            [
                a * a * xx + 2 * a * b * xy + b * b * yy,
                a * c * xx + (a * d + b * c) * xy + b * d * yy,
                c * c * xx + 2 * c * d * xy + d * d * yy,
            ]
        )

    def light(self, sums: F64) -> F64:
        """Scale Σφx f, Σφy f, Σφx, Σφy of each tile, beside Σf², Σf, (T, 6)."""
        return np.hstack([self.vectors(sums[:, :2]), self.vectors(sums[:, 2:4]), sums[:, 4:]])


def tile_prefilter(image: AnyArray, size: int, noise: float) -> Prefilter:
    """Choose the prefilter of tile sums by the error that the pattern's spectrum predicts.

    Parameters
    ----------
    image : (H, W) uint8, uint16 or float, grey levels
        The reference.
    size : int, px
        Side of a tile.
    noise : float, grey levels
        Standard deviation of a frame less the reference.

    Raises
    ------
    ValueError
        If the image cannot be used, the tiles are smaller than 4 px, or a number is none.
    """
    grey = check_reference(image)
    size = read_integer(size, "tile size", "px")
    if size < 4:
        raise ValueError(f"tile size must be 4 px or more, got {size} px; choose a larger one")
    noise = read_real(noise, "noise", "grey levels")
    return choose_tile_prefilter(grey, size, noise)


def tile_scale(mixed: F64, products: F64) -> F64:
    """Give `SmoothGradient.scale` from Σφ∇fᵀ (T, 2, 2) and Σφxφx, Σφxφy, Σφyφy (T, 3)."""
    square = products[:, [[0, 1], [1, 2]]]
    flat = _FLAT * float(np.median(products[:, [0, 2]])) + _NOTHING
    return mixed.transpose(0, 2, 1) @ np.linalg.inv(square + flat * np.eye(2))
