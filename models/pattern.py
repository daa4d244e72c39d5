"""Touches from the whole pattern: tile sums, reduced to one number a plate mode.

A frame differs from the reference by e = -∇f·d + α f + β + noise. The motion d is the sum of K
plate modes as the camera sees them and of R rigid motions of the camera (shift, rotation, scale);
α and β are a gain and an offset of the light. All are linear, so the tile sums Σ∇f∇fᵀ and Σ∇f·e
give normal equations for them, which lose nothing of what the pixels know. Camera and light are
eliminated (Schur complement); what is left is whitened by its Cholesky factor and is a
forward model that is linear in the forces.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular

import fe
import synthetic
from dic.tiles import TileReference, Tiles, TileSums
from models.estimate import Estimate
from models.forward import LinearForward, modal
from models.spread import Spread, spread_over

LIGHT = 2  # gain and offset


@dataclass(frozen=True, eq=False)
class Motions:
    """How the picture of every tile moves with the plate and the camera, whatever is on it.

    Attributes
    ----------
    modes : fe.Modes
        K modes of the plate.
    tiles : Tiles
    spread : Spread
        From the coefficients of a motion to the motion of every tile.
    basis : (2C, K + R) float32, px
        Coefficients of the motion, x then y of each, by a unit of every mode and rigid motion.
    """

    modes: fe.Modes
    tiles: Tiles
    spread: Spread
    basis: NDArray[np.float32]

    def flow(self, amplitudes: NDArray) -> NDArray[np.float64]:
        """Motion of what each tile sees for given amplitudes (K + R,), (T, 2) px.

        The field u is that of material points where they were; a tile at x sees the point that
        came from x - d, so it reads d(x) = u(x - d) ≈ u - ∇u·u. Without the second term a camera
        that shifts takes every touch along with it, twice as far as it moved itself.
        """
        coefficients = self._coefficients(amplitudes).reshape(-1, 2)
        u = self.spread.over_tiles(coefficients)
        along_x, along_y = self.spread.slopes(coefficients)
        return u - (along_x * u[:, :1] + along_y * u[:, 1:]) / self.tiles.size

    def farthest(self, amplitudes: NDArray) -> float:
        """Bound of the motion of any tile for given amplitudes, px: the largest coefficient."""
        return float(np.abs(self._coefficients(amplitudes)).max())

    def gather(self, gradient: NDArray, flow: NDArray) -> NDArray[np.float32]:
        """Sum over the tiles what each says of each amplitude, at a flow: (T, 2) → (K + R,).

        The adjoint of a small change of `flow`, but for the turn of u by its own gradient (1e-3).
        """
        along_x, along_y = (gradient * flow[:, [axis]] / self.tiles.size for axis in (0, 1))
        total = self.spread.gather(gradient) - self.spread.gather_slopes(along_x, along_y)
        return total.ravel().astype(np.float32) @ self.basis

    def of_tiles(self) -> NDArray[np.float64]:
        """Motion of every tile by a unit of every mode and rigid motion, (T, 2, K + R) px."""
        count = self.basis.shape[1]
        wide = self.basis.astype(np.float64).reshape(-1, 2 * count)
        return self.spread.over_tiles(wide).reshape(-1, 2, count)

    def _coefficients(self, amplitudes: NDArray) -> NDArray[np.float32]:
        return self.basis @ amplitudes.astype(np.float32)


def see_motions(modes: fe.Modes, camera: synthetic.Camera, height: float, tiles: Tiles) -> Motions:
    """See plate modes and camera motion on every tile, as means over the tile.

    Parameters
    ----------
    modes : fe.Modes
        Enough of them carry a touch's field: 200 to 0.2 %.
    camera : synthetic.Camera
    height : float, mm
        Height of the seen face over the plate's middle plane.
    tiles : Tiles
    """
    spread = spread_over(tiles.shape)
    motions = np.concatenate(
        [
            _tile_mean(tiles, lambda px: _modes_seen(modes, camera, height, px)),
            _tile_mean(tiles, lambda px: synthetic.rigid(camera, px)),
        ],
        axis=2,
    )
    coefficients = spread.fit(motions.reshape(len(motions), -1))
    basis = coefficients.reshape(-1, motions.shape[2]).astype(np.float32)
    return Motions(modes, tiles, spread, basis)


@dataclass(frozen=True, eq=False)
class Pattern:
    """The whole pattern as a measurement of touches.

    Attributes
    ----------
    motions : Motions
        Of K modes and R rigid motions.
    normal : (K + R + 2, K + R + 2) float64, grey levels²
        Normal matrix of modes, rigid motions, gain and offset.
    share : (K, R + 2) float64
        What camera and light take from the right-hand side of the modes.
    factor : (K, K) float64, grey levels
        Lower Cholesky factor of the modes' normal matrix with camera and light eliminated.
    """

    motions: Motions
    normal: NDArray[np.float64]
    share: NDArray[np.float64]
    factor: NDArray[np.float64]

    @property
    def count(self) -> int:
        """Number of plate modes, K."""
        return len(self.factor)

    def forward(self, noise: float) -> LinearForward:
        """Forward model of `whiten`ed frames with a noise of `noise` grey levels."""
        return modal(self.motions.modes, self.factor / noise)

    def right_side(self, sums: TileSums, moved: NDArray) -> NDArray[np.float64]:
        """Right-hand side of the normal equations for all that moved, (K + R + 2,).

        Parameters
        ----------
        sums : TileSums
            Taken at the flow of `moved`.
        moved : (K + R,) float64
            Amplitudes of modes and rigid motions by which the reference was moved.
        """
        towards = -self.motions.gather(sums.gradient, sums.flow)
        left_over = np.concatenate([towards, [sums.ef.sum(), sums.e.sum()]])
        return left_over + self.normal[:, : len(moved)] @ moved

    def whiten(self, right: NDArray, noise: float) -> NDArray[np.float64]:
        """Reduce a right-hand side to K numbers with white noise of variance 1."""
        modal = right[: self.count] - self.share @ right[self.count :]
        return solve_triangular(self.factor, modal, lower=True, check_finite=False) / noise

    def amplitudes(self, estimate: Estimate, right: NDArray) -> NDArray[np.float64]:
        """Amplitudes of modes and rigid motions that an estimate implies, (K + R,).

        With the touches known, what is left of the right-hand side is the motion of the camera.
        """
        modal = np.zeros(self.count)
        if estimate.count:
            modal = estimate.force @ self.motions.modes.response(estimate.xy)
        rest = right[self.count :] - self.normal[self.count :, : self.count] @ modal
        nuisance = np.linalg.solve(self.normal[self.count :, self.count :], rest)
        return np.concatenate([modal, np.asarray(nuisance[:-LIGHT], dtype=np.float64)])

    def still(self) -> NDArray[np.float64]:
        """Amplitudes of a plate and a camera that did not move, (K + R,)."""
        return np.zeros(len(self.normal) - LIGHT)


def see_pattern(motions: Motions, reference: TileReference) -> Pattern:
    """Set up the whole pattern of a reference as a measurement.

    Raises
    ------
    ValueError
        If the reference has other tiles than the motions.
    """
    if reference.tiles != motions.tiles:
        raise ValueError(
            f"reference has {reference.tiles} and the motions {motions.tiles}; use the same tiles"
        )
    normal = _normal(reference, motions.of_tiles())
    count = len(motions.modes.stiffness)
    modal, mixed, rest = normal[:count, :count], normal[:count, count:], normal[count:, count:]
    share = np.asarray(np.linalg.solve(rest, mixed.T).T, dtype=np.float64)
    factor = np.asarray(np.linalg.cholesky(modal - share @ mixed.T), dtype=np.float64)
    return Pattern(motions, normal, share, factor)


def noise_of(sums: TileSums, tiles: Tiles) -> float:
    """Noise of a frame, grey levels: the median tile, which a hand or a new touch hardly moves."""
    return float(np.sqrt(np.median(sums.ee)) / tiles.size)


def _modes_seen(
    modes: fe.Modes, camera: synthetic.Camera, height: float, px: NDArray
) -> NDArray[np.float64]:
    """Image motion of every mode at pixels, (N, 2, K) px; zero beside the plate."""
    places = camera.on_plate(px, height)
    inside = ((places >= 0) & (places <= np.asarray(modes.plate.size))).all(axis=1)
    seen = np.zeros((len(px), 2, len(modes.stiffness)))
    places = places[inside]
    seen[inside] = synthetic.seen(
        camera, px[inside], modes.value(places), modes.slope(places), height
    )
    return seen


def _tile_mean(
    tiles: Tiles, field: Callable[[NDArray], NDArray[np.float64]]
) -> NDArray[np.float64]:
    """Mean of a field over each tile by 2 x 2 Gauss points, (T, 2, k)."""
    step = 0.5 * tiles.size / np.sqrt(3.0)
    corners = [(-step, -step), (step, -step), (-step, step), (step, step)]
    total = field(tiles.xy + corners[0])
    for corner in corners[1:]:
        total += field(tiles.xy + corner)
    return total / len(corners)


def _normal(reference: TileReference, basis: NDArray) -> NDArray[np.float64]:
    """Build the normal matrix of motions (T, 2, k), gain and offset, (k + 2, k + 2)."""
    xx, xy, yy = (part[:, None] for part in reference.hessian.T)
    along_x, along_y = basis[:, 0], basis[:, 1]
    motions = along_x.T @ (xx * along_x + xy * along_y) + along_y.T @ (xy * along_x + yy * along_y)
    fx_f, fy_f, fx, fy, ff, f = reference.light.T
    mixed = -np.stack([fx_f @ along_x + fy_f @ along_y, fx @ along_x + fy @ along_y], axis=1)
    pixels = len(f) * reference.tiles.size**2
    light = np.array([[ff.sum(), f.sum()], [f.sum(), pixels]])
    return np.block([[motions, mixed], [mixed.T, light]])
