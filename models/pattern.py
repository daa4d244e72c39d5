"""Touches from the whole pattern: tile sums, reduced to one number a plate mode.

A frame differs from the reference by e = -∇f·d + α f + β + noise. The motion d is the sum of K plate
modes as the camera sees them and of R rigid motions of the camera (shift, rotation, scale); α and β
are a gain and an offset of the light. All are linear, so the tile sums Σ∇f∇fᵀ and Σ∇f·e give normal
equations for them, which lose nothing of what the pixels know. Camera and light are eliminated
(Schur complement); what is left is whitened by its Cholesky factor and is a `Modal` forward model.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular

import fe
import synthetic
from dic.tiles import TileReference, TileSums

from .estimate import Estimate
from .forward import Modal

LIGHT = 2  # gain and offset
SPARSE = 16  # tiles, of which one is asked how far it moved


@dataclass(frozen=True, eq=False)
class Pattern:
    """The whole pattern as a measurement of touches.

    Attributes
    ----------
    modes : fe.Modes
        K modes of the plate.
    basis : (2T, K + R) float32, px
        Motion of every tile, x then y of each, by a unit of every mode and rigid motion.
    normal : (K + R + 2, K + R + 2) float64, grey levels²
        Normal matrix of modes, rigid motions, gain and offset.
    share : (K, R + 2) float64
        What camera and light take from the right-hand side of the modes.
    factor : (K, K) float64, grey levels
        Lower Cholesky factor of the modes' normal matrix with camera and light eliminated.
    """

    modes: fe.Modes
    basis: NDArray[np.float32]
    normal: NDArray[np.float64]
    share: NDArray[np.float64]
    factor: NDArray[np.float64]

    @property
    def count(self) -> int:
        """Number of plate modes, K."""
        return len(self.factor)

    def forward(self, noise: float) -> Modal:
        """Forward model of `whiten`ed frames with a noise of `noise` grey levels."""
        return Modal(self.modes, self.factor / noise)

    def right_side(self, sums: TileSums, moved: NDArray) -> NDArray[np.float64]:
        """Right-hand side of the normal equations for all that moved, (K + R + 2,).

        Parameters
        ----------
        sums : TileSums
            Taken at the flow of `moved`.
        moved : (K + R,) float64
            Amplitudes of modes and rigid motions by which the reference was moved.
        """
        towards = -sums.gradient.ravel().astype(np.float32) @ self.basis
        left_over = np.concatenate([towards, [sums.ef.sum(), sums.e.sum()]])
        return left_over + self.normal[:, : len(moved)] @ moved

    def whiten(self, right: NDArray, noise: float) -> NDArray[np.float64]:
        """Reduce a right-hand side to K numbers with white noise of variance 1."""
        modal = right[: self.count] - self.share @ right[self.count :]
        return solve_triangular(self.factor, modal, lower=True, check_finite=False) / noise

    def motion(self, estimate: Estimate, right: NDArray) -> NDArray[np.float64]:
        """Amplitudes of modes and rigid motions that an estimate implies, (K + R,).

        With the touches known, what is left of the right-hand side is the motion of the camera.
        """
        modal = np.zeros(self.count)
        if estimate.count:
            modal = estimate.force @ self.modes.response(estimate.xy)
        rest = right[self.count :] - self.normal[self.count :, : self.count] @ modal
        nuisance = np.linalg.solve(self.normal[self.count :, self.count :], rest)
        return np.concatenate([modal, nuisance[:-LIGHT]])

    def flow(self, motion: NDArray) -> NDArray[np.float64]:
        """Motion of every tile for given amplitudes, (T, 2) px."""
        return (self.basis @ motion.astype(np.float32)).reshape(-1, 2).astype(np.float64)

    def change(self, motion: NDArray) -> float:
        """Largest motion of a tile for given amplitudes, px, from one tile in `SPARSE`."""
        return float(np.abs(self.basis[:: 2 * SPARSE + 1] @ motion.astype(np.float32)).max())

    def still(self) -> NDArray[np.float64]:
        """Amplitudes of a plate and a camera that did not move, (K + R,)."""
        return np.zeros(self.basis.shape[1])


def see_pattern(
    modes: fe.Modes, camera: synthetic.Camera, height: float, reference: TileReference
) -> Pattern:
    """Set up the whole pattern as a measurement.

    Parameters
    ----------
    modes : fe.Modes
        Enough of them carry a touch's field: 200 to 0.2 %.
    camera : synthetic.Camera
    height : float, mm
        Height of the seen face over the plate's middle plane.
    reference : TileReference
    """
    plate_motion = _tile_mean(reference, lambda px: _modes_seen(modes, camera, height, px))
    camera_motion = _tile_mean(reference, lambda px: synthetic.rigid(camera, px))
    basis = np.concatenate([plate_motion, camera_motion], axis=2)
    normal = _normal(reference, basis)
    count = plate_motion.shape[2]
    modal, mixed, rest = normal[:count, :count], normal[:count, count:], normal[count:, count:]
    share = np.linalg.solve(rest, mixed.T).T
    return Pattern(
        modes=modes,
        basis=np.ascontiguousarray(basis.reshape(-1, basis.shape[2]), dtype=np.float32),
        normal=normal,
        share=share,
        factor=np.linalg.cholesky(modal - share @ mixed.T),
    )


def noise_of(sums: TileSums, size: int) -> float:
    """Noise of a frame, grey levels: the median tile, which a hand or a new touch hardly moves."""
    return float(np.sqrt(np.median(sums.ee) / size**2))


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


def _tile_mean(reference: TileReference, field) -> NDArray[np.float64]:
    """Mean of a field over each tile by 2 x 2 Gauss points, (T, 2, k)."""
    step = 0.5 * reference.size / np.sqrt(3.0)
    corners = [(-step, -step), (step, -step), (-step, step), (step, step)]
    total = field(reference.xy + corners[0])
    for corner in corners[1:]:
        total += field(reference.xy + corner)
    return total / len(corners)


def _normal(reference: TileReference, basis: NDArray) -> NDArray[np.float64]:
    """Normal matrix of motions, gain and offset, (k + 2, k + 2)."""
    xx, xy, yy = (part[:, None] for part in reference.hessian.T)
    along_x, along_y = basis[:, 0], basis[:, 1]
    motions = along_x.T @ (xx * along_x + xy * along_y) + along_y.T @ (xy * along_x + yy * along_y)
    fx_f, fy_f, fx, fy, ff, f = reference.light.T
    mixed = -np.stack([fx_f @ along_x + fy_f @ along_y, fx @ along_x + fy @ along_y], axis=1)
    pixels = len(f) * reference.size**2
    light = np.array([[ff.sum(), f.sum()], [f.sum(), pixels]])
    return np.block([[motions, mixed], [mixed.T, light]])
