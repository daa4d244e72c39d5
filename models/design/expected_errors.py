"""How well a bench will know touches, before it is built.

A speckle pattern enters the Cramér-Rao bound through one number, its mean squared gradient: it is
alike all over the plate, and its grain is small against what touches do. So a patch of it shows
all, and no image of the whole plate is needed.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dic import TileReference, Tiles, aliasing_left, prepare_blocks
from models.arrays import F64
from models.forward.linear import Forward
from models.forward.tile_pattern import LIGHT, TilePattern
from models.inverse.levenberg_marquardt import covariance


@dataclass(frozen=True, eq=False)
class ExpectedErrors:
    """Errors that are to be expected of single touches.

    Attributes
    ----------
    touches : (n, 3) float64
        x, y (mm) and F (N).
    place : (n,) float64, mm
        RMS distance; in inverse proportion to the force where theory is linear.
    force : (n,) float64, N
        Standard deviation; the same for all forces where theory is linear.
    """

    touches: F64
    place: F64
    force: F64

    def scaled(self, factor: float | F64) -> ExpectedErrors:
        """Multiply by a factor of the noise, or by one for each touch (n,)."""
        return ExpectedErrors(self.touches, factor * self.place, factor * self.force)

    def combined_with(self, other: ExpectedErrors) -> ExpectedErrors:
        """Add errors of another cause, as root sum of squares."""
        place, force = np.hypot(self.place, other.place), np.hypot(self.force, other.force)
        return ExpectedErrors(self.touches, place, force)

    def force_for(self, error: float) -> F64:
        """Smallest forces (n,), N, whose places are known to `error` mm by linear theory."""
        return self.place * self.touches[:, 2] / error


def expected_errors(forward: Forward, touches: F64) -> ExpectedErrors:
    """Say how well each touch is known that presses alone, by the Cramér-Rao bound.

    Parameters
    ----------
    forward : Forward
    touches : (n, 3) array
        x, y (mm) and F (N).
    """
    touches = np.asarray(touches, dtype=np.float64)
    variances = np.array(
        [np.diag(covariance(forward.read(touch[None])[1])) for touch in touches]
    ).reshape(-1, 3)
    return ExpectedErrors(
        touches, np.sqrt(variances[:, 0] + variances[:, 1]), np.sqrt(variances[:, 2])
    )


def errors_of_interpolation(pattern: TilePattern, touches: F64) -> ExpectedErrors:
    """Say by how much each touch is off where interpolation errs, see `bias_of_interpolation`.

    Linear in the part by which small motions are measured too large; these are for a part of 1.

    Parameters
    ----------
    pattern : TilePattern
    touches : (n, 3) array
        x, y (mm) and F (N).
    """
    touches = np.asarray(touches, dtype=np.float64)
    off = np.array([bias_of_interpolation(pattern, touch) for touch in touches]).reshape(-1, 3)
    return ExpectedErrors(touches, np.linalg.norm(off[:, :2], axis=1), np.abs(off[:, 2]))


def bias_of_interpolation(pattern: TilePattern, touch: F64) -> F64:
    """Error of x, y, F of a touch (3,) by what interpolation between pixels leaves, (3,).

    It measures a motion of u px too large by a sine of it, sin(2πu)/2π (Schreier, Braasch and
    Sutton 2000), times the part by which small motions are: this is for a part of 1. Where aliasing
    does not hide that part it is known and taken off, see `dic.TileReference`.
    """
    motions, flow = pattern.motions, _flow(pattern, touch)
    x, y = np.sin(2.0 * np.pi * flow.T) / (2.0 * np.pi)
    xx, xy, yy = pattern.reference.hessian.T
    towards = motions.project(np.column_stack([xx * x + xy * y, xy * x + yy * y]), flow)
    right = np.concatenate([towards.astype(np.float64), np.zeros(LIGHT)])
    white = pattern.whiten(right, 1.0)
    jacobian = pattern.forward(1.0).read(touch[None])[1]
    return np.asarray(white @ np.linalg.pinv(jacobian), dtype=np.float64)


def aliased_part(pattern: TilePattern, touch: F64) -> float:
    """Give the variance that aliasing leaves under a touch (3,), over that of any motion.

    See `dic.aliasing_left`.
    """
    return aliasing_left(_flow(pattern, touch))


def _flow(pattern: TilePattern, touch: F64) -> F64:
    """Motion of each tile under a touch (3,), (T, 2) px."""
    moved = pattern.still()
    moved[: pattern.count] = pattern.motions.modal_amplitudes(touch[None, :2], touch[2:])
    return pattern.motions.flow(moved)


def places_over_plate(size: tuple[float, float], across: int = 24) -> F64:
    """List the middles of equal cells, `across` along the longer side, (n, 2) mm, row after row."""
    columns, rows = shape_over(size, across)
    x, y = np.meshgrid(
        (np.arange(columns) + 0.5) * size[0] / columns, (np.arange(rows) + 0.5) * size[1] / rows
    )
    return np.column_stack([x.ravel(), y.ravel()])


def shape_over(size: tuple[float, float], across: int = 24) -> tuple[int, int]:
    """Count columns and rows of the cells of `places_over_plate`."""
    a, b = (max(round(across * side / max(size)), 1) for side in size)
    return a, b


def gradient_energy(patch: TileReference) -> float:
    """Measure the mean squared gradient of a pattern along one direction, grey levels² a px².

    What a gain and an offset of the light of each tile explain is not in it, nor is what a
    prefilter takes away.

    Parameters
    ----------
    patch : TileReference
        Of an image without noise, some twenty speckles wide or more.
    """
    hessian = prepare_blocks(patch, 1).hessian
    return float(hessian[:, [0, 1], [0, 1]].mean() / patch.tiles.size**2)


def equal_tiles(tiles: Tiles, energy: float) -> TileReference:
    """Make a reference, without image, of a pattern that is alike in all tiles.

    Parameters
    ----------
    tiles : Tiles
    energy : float, grey levels² a px²
        From `gradient_energy`.
    """
    count, pixels = tiles.shape[0] * tiles.shape[1], tiles.size**2
    none = np.empty((0, 0), dtype=np.float32)
    return TileReference(
        tiles=tiles,
        image=none,
        coefficients=none,
        gradient=none[None],
        hessian=np.tile(pixels * np.array([energy, 0.0, energy]), (count, 1)),
        # Light mixes neither with motion nor with itself: its part is out of the energy already.
        light=np.tile(pixels * np.array([0.0, 0.0, 0.0, 0.0, 1.0, 0.0]), (count, 1)),
        bias=np.zeros(2),
    )
