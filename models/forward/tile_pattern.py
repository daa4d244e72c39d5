"""Touches from the whole pattern: tile sums, reduced to one number a plate mode.

A frame differs from the reference by e = -∇f·d + α f + β + noise. The motion d is the sum of K
fields of the plate as the camera sees them and of R rigid motions of the camera (shift, rotation,
scale, tilts); α and β are a gain and an offset of the light. All are linear, so the tile sums
Σ∇f∇fᵀ and Σ∇f·e give normal equations for them, which lose nothing of what the pixels know. Camera
and light are eliminated (Schur complement); what is left is whitened by its Cholesky factor. Under
small touches the fields are plate modes, linear in the force; under large ones see `large`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.linalg import cho_solve, solve_triangular

from dic import TileReference, Tiles, TileSums, unbiased_gradient
from models.arrays import F32, F64, Mask
from models.estimate import Estimate
from models.forward.image_motion import (
    ImageMotions as ImageMotions,
    prepare_motions as prepare_motions,
)
from models.forward.linear import Forward, modal
from models.forward.rolling import Rolled, RollingFields, RollingShutter

LIGHT = 2  # gain and offset
# Added to the normal matrix, in parts of it, where tiles are hidden, so that modes which only these
# tiles show stay solvable; it moves χ² by less than this fraction of what was measured, 1 at an
# SNR of 1000.
RIDGE = 1e-6
# Weight of a tile that stands still, in parts of what a visible one tells: it holds the motion of
# hidden tiles, of which nothing is known, and takes as small a part from that of the others.
_HELD = 1e-3


@dataclass(frozen=True, eq=False)
class TilePattern:
    """The whole pattern as a measurement of touches.

    Attributes
    ----------
    motions : ImageMotions
        Of K modes and R rigid motions.
    reference : TileReference
    whole : (K + R + 2, K + R + 2) float64, grey levels²
        Normal matrix over all tiles that see the plate.
    hidden : (T,) bool
        Tiles that are left out, because something lies before them.
    normal : (K + R + 2, K + R + 2) float64, grey levels²
        Normal matrix of modes, rigid motions, gain and offset over the tiles that are visible.
    elimination : (K, R + 2) float64
        What camera and light take from the right-hand side of the modes.
    factor : (K, K) float64, grey levels
        Lower Cholesky factor of the modes' normal matrix with camera and light eliminated.
    shutter : RollingShutter, optional
        When each tile is read, where not all are at once.
    uneven : (K, R) float64, optional
        What a unit of each rigid motion leaves of the plate's amplitudes, where the camera moves
        the image otherwise than `motions` has it; see `Seen.uneven`. `whiten` takes it off.
    """

    motions: ImageMotions
    reference: TileReference
    whole: F64
    hidden: Mask
    normal: F64
    elimination: F64
    factor: F64
    shutter: RollingShutter | None = None
    uneven: F64 | None = None

    @property
    def count(self) -> int:
        """Number of fields of the plate, K."""
        return len(self.factor)

    @property
    def _visible(self) -> Mask:
        return self.motions.on_plate & ~self.hidden

    def forward(self, noise: float) -> Forward:
        """Forward model of `whiten`ed frames with a noise of `noise` grey levels.

        Raises
        ------
        ValueError
            If the noise is not positive, or the shutter rolls over a plate that is just as
            described.
        """
        if not noise > 0:
            raise ValueError(
                f"noise of a frame must be positive, got {noise:g} grey levels; measure it at rest"
            )
        large = self.motions.large
        if self.shutter is not None:
            if not isinstance(large, RollingFields):
                raise ValueError(
                    "rows that are read one after the other need the forward model of a bench, got"
                    f" {type(large).__name__}; use BenchFields"
                )
            rolled = Rolled(self.rolled / noise, self.shutter.places)
            return large.rolling_forward(self.factor / noise, rolled)
        if large is not None:
            return large.forward(self.factor / noise)
        return modal(self.motions.plate_modes, self.factor / noise)

    def hiding(self, hidden: Mask) -> TilePattern:
        """Leave out tiles (T,): what they said is taken out of the normal matrix.

        That costs in proportion to the hidden tiles, or to the visible ones if they are fewer.

        Raises
        ------
        ValueError
            If the visible tiles cannot separate the fields of the plate, or `hidden` is not one
            bool a tile.
        """
        if hidden.shape != self.hidden.shape or hidden.dtype != np.bool_:
            raise ValueError(
                f"hidden tiles must be {self.hidden.shape} bool, one a tile, got {hidden.shape} "
                f"{hidden.dtype}; use hidden_tiles"
            )
        if np.array_equal(hidden, self.hidden):
            return self
        lost, left = (self.motions.on_plate & part for part in (hidden, ~hidden))
        part = lost if np.count_nonzero(lost) < np.count_nonzero(left) else left
        normal = normal_matrix(
            self.reference.hessian[part],
            self.reference.light[part],
            self.motions.on_tiles[part],
            self.motions.tiles.size,
        )
        normal = self.whole - normal if part is lost else normal
        try:
            visible = _reduced(self.motions, self.reference, self.whole, hidden, normal)
            return replace(visible, shutter=self.shutter, uneven=self.uneven)
        except np.linalg.LinAlgError:
            fraction = np.mean(hidden[self.motions.on_plate])
            raise ValueError(
                f"{fraction:.0%} of the tiles are hidden, and the others cannot tell "
                f"{self.count} fields of the plate apart; clear the view"
            ) from None

    def gradient(self, sums: TileSums, moved: F64) -> F64:
        """Right-hand side of the normal equations for all that moved, (K + R + 2,).

        Parameters
        ----------
        sums : TileSums
            Taken at the flow of `moved`.
        moved : (K + R,) float64
            Amplitudes of modes and rigid motions by which the reference was moved.
        """
        visible = self._visible.astype(np.float64)
        gradient = unbiased_gradient(self.reference, sums) * visible[:, None]
        towards = -self.motions.project(gradient, sums.flow)
        left_over = np.concatenate([towards, [sums.ef @ visible, sums.e @ visible]])
        return left_over + self.normal[:, : len(moved)] @ moved

    def whiten(self, right: F64, noise: float) -> F64:
        """Reduce a right-hand side to K numbers with white noise of variance 1."""
        modal = self._eliminated(right)
        white = solve_triangular(self.factor, modal, lower=True, check_finite=False)
        if self.uneven is not None:
            white = white - self.factor.T @ (self.uneven @ self.motion(right)[self.count :])
        return white / noise

    def uncorrected(self, motion: F64) -> F64 | None:
        """Give the rigid part (R,) of a motion (K + R,), of which `whiten` takes nothing more off.

        None where it does, see `uneven`.
        """
        return None if self.uneven is not None else motion[self.count :]

    @cached_property
    def resolving(self) -> F64:
        """Amplitudes of the plate that an image takes a motion of each tile for, (K, 2T).

        By x then y of each. A tile counts by what it tells; what resembles the camera or the light
        stands aside.
        """
        modal = self._eliminated(self._by_tiles)
        return np.asarray(cho_solve((self.factor, True), modal), dtype=np.float64)

    @cached_property
    def resolving_camera(self) -> F64:
        """Rigid motions that an image takes a motion of each tile for, (R, 2T), as `motion`."""
        return self.motion(self._by_tiles)[self.count :]

    @property
    def _by_tiles(self) -> F64:
        """Right-hand side by a motion of each tile, (K + R + 2, 2T)."""
        basis, hessian = self.motions.tile_basis(), self.reference.hessian[:, [[0, 1], [1, 2]]]
        light = -self.reference.light[:, [[0, 2], [1, 3]]]
        by_tiles = np.concatenate([hessian @ basis, light], axis=2)
        by_tiles[~self.motions.on_plate] = 0.0
        return by_tiles.reshape(-1, by_tiles.shape[2]).T

    @cached_property
    def rolled(self) -> F64:
        """What `whiten` makes of fields that change by a unit a second, at a noise of 1, (K, K)."""
        late = np.zeros(len(self.hidden)) if self.shutter is None else self.shutter.tiles
        late = np.where(self._visible, late, 0.0)
        reference, on_tiles = self.reference, self.motions.on_tiles
        size = self.motions.tiles.size
        normal = normal_matrix(reference.hessian, reference.light, on_tiles, size, late)
        right = self._eliminated(normal[:, : self.count])
        return solve_triangular(self.factor, right, lower=True, check_finite=False)

    def motion(self, right: F64) -> F64:
        """Amplitudes of modes and rigid motions that a frame shows, whatever moved it, (K + R,)."""
        modal = cho_solve((self._held, True), self._eliminated(right), check_finite=False)
        return self.with_camera(np.asarray(modal, dtype=np.float64), right)

    @cached_property
    def _held(self) -> F64:
        """Cholesky factor of the modes' normal matrix in which every tile is held a little."""
        known = float(self.reference.hessian[:, ::2].mean())
        energy = self.motions.energy[: self.count, : self.count]
        held = np.linalg.cholesky(self.factor @ self.factor.T + _HELD * known * energy)
        return np.asarray(held, dtype=np.float64)

    def _eliminated(self, right: F64) -> F64:
        """Right-hand side of the modes with camera and light eliminated, (K, …)."""
        return right[: self.count] - self.elimination @ right[self.count :]

    def amplitudes(self, estimate: Estimate, right: F64) -> F64:
        """Amplitudes of modes and rigid motions that an estimate implies, (K + R,)."""
        return self.with_camera(self.motions.modal_amplitudes(estimate.xy, estimate.force), right)

    def with_camera(self, modal: F64, right: F64) -> F64:
        """Add the motion of the camera: what modes (K,) leave of the right-hand side."""
        rest = right[self.count :] - self.normal[self.count :, : self.count] @ modal
        nuisance = np.linalg.solve(self.normal[self.count :, self.count :], rest)
        return np.concatenate([modal, np.asarray(nuisance[:-LIGHT], dtype=np.float64)])

    def still(self) -> F64:
        """Amplitudes of a plate and a camera that did not move, (K + R,)."""
        return np.zeros(len(self.normal) - LIGHT)


def prepare_pattern(motions: ImageMotions, reference: TileReference) -> TilePattern:
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
    on, size = motions.on_plate, motions.tiles.size
    whole = normal_matrix(
        reference.hessian[on], reference.light[on], motions.tile_basis()[on], size
    )
    hidden = np.zeros(len(reference.hessian), dtype=np.bool_)
    return _reduced(motions, reference, whole, hidden, whole)


def _reduced(
    motions: ImageMotions,
    reference: TileReference,
    whole: F64,
    hidden: Mask,
    normal: F64,
) -> TilePattern:
    """Eliminate camera and light."""
    count = motions.fields
    modal, mixed, rest = normal[:count, :count], normal[:count, count:], normal[count:, count:]
    elimination = np.asarray(np.linalg.solve(rest, mixed.T).T, dtype=np.float64)
    ridge = RIDGE * np.diag(np.diag(modal)) if hidden.any() else 0.0
    factor = np.asarray(np.linalg.cholesky(modal + ridge - elimination @ mixed.T), dtype=np.float64)
    return TilePattern(motions, reference, whole, hidden, normal, elimination, factor)


def noise_from_sums(sums: TileSums, tiles: Tiles) -> float:
    """Noise of a frame, grey levels: the median tile, which a hand or a new touch hardly moves."""
    return float(np.sqrt(np.median(sums.ee)) / tiles.size)


def normal_matrix(
    hessian: F64, light: F64, basis: F32 | F64, size: int, weight: F64 | None = None
) -> F64:
    """Build the normal matrix of motions (T, 2, k), gain and offset over T tiles, (k + 2, k + 2).

    As precise as the motions are given. Each tile may have a weight of either sign, (T,).
    """
    along_x, along_y = basis[:, 0], basis[:, 1]
    # The Cholesky factor of each Hessian leaves one product of a matrix with itself.
    xx, xy, yy = hessian.T
    root = np.sqrt(np.maximum(xx, 1e-30))
    below = np.sqrt(np.maximum(yy - (xy / root) ** 2, 0.0))
    root, across, below = (part.astype(basis.dtype)[:, None] for part in (root, xy / root, below))
    rows = np.concatenate([root * along_x + across * along_y, below * along_y])
    if weight is None:
        motions = rows.T @ rows
    else:
        motions = rows.T @ (np.tile(weight, 2).astype(basis.dtype)[:, None] * rows)
        light = weight[:, None] * light
    fx_f, fy_f, fx, fy, ff, f = light.T
    mixed = -np.stack([fx_f @ along_x + fy_f @ along_y, fx @ along_x + fy @ along_y], axis=1)
    corner = np.array([[ff.sum(), f.sum()], [f.sum(), len(f) * size**2]])
    return np.asarray(np.block([[motions, mixed], [mixed.T, corner]]), dtype=np.float64)
