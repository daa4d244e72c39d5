"""Touches from strain alone: the strain map of a frame, reduced to one number a plate mode.

The map is projected on the strain that each mode would show; the noise of the projections follows
from the noise of the pixels through every linear step (tiles, blocks, strain window), so that their
covariance is exact although neighbouring strains share pixels. Shift and rotation of the camera
leave no strain; its scale is eliminated.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import bsr_array, csr_array, kron

import synthetic
from dic import DisplacementField, Status, TileBlocks, strain_operator
from models.arrays import F32, F64, Mask
from models.forward.image_motion import ImageMotions
from models.forward.linear import LinearForward, modal
from models.forward.tile_pattern import TilePattern


@dataclass(frozen=True, eq=False)
class StrainMap:
    """The strain map as a measurement of touches.

    Attributes
    ----------
    motions : ImageMotions
        Of K fields of the plate.
    operator : (3T, 2T) csr_array, per px
        From displacements to strain.
    sigma : (T, 3) float64
        Standard deviation of exx, eyy, exy for a noise of 1 grey level; infinite without strain.
    whitening : (K, 3T) float32
        From strain to K whitened numbers, for a noise of 1 grey level.
    factor : (K, K) float64
        Whitened response to a unit of each mode.
    """

    motions: ImageMotions
    operator: csr_array
    sigma: F64
    whitening: F32
    factor: F64

    def forward(self, noise: float) -> LinearForward:
        """Forward model of `whiten`ed maps with a noise of `noise` grey levels."""
        return modal(self.motions.plate_modes, self.factor / noise)

    def strain(self, field: DisplacementField) -> F64:
        """Strain of a displacement field, (T, 3); NaN where there is none."""
        motion = np.column_stack([field.u, field.v])
        measured = (self.operator @ np.nan_to_num(motion).ravel()).reshape(-1, 3)
        measured[np.isinf(self.sigma[:, 0]) | self._lost(field)] = np.nan
        return measured

    def whiten(self, strain: F64, noise: float) -> F64 | None:
        """Reduce a strain map to numbers with white noise; None if a strain is missing."""
        known = np.isfinite(self.sigma[:, 0])
        if not np.isfinite(strain[known]).all():
            return None
        seen = np.where(known[:, None], strain, 0.0).ravel().astype(np.float32)
        return (self.whitening @ seen).astype(np.float64) / noise

    def _lost(self, field: DisplacementField) -> Mask:
        """Points whose strain window holds a displacement that was lost in this frame."""
        lost = np.repeat(field.status == Status.LOW_CORRELATION, 2).astype(np.float64)
        if not lost.any():
            return np.zeros(len(field.status), dtype=bool)
        touched: F64 = np.asarray(abs(self.operator) @ lost)
        hit: Mask = (touched > 0).reshape(-1, 3)
        return np.asarray(hit.any(axis=1), dtype=np.bool_)


def prepare_strain_map(
    pattern: TilePattern, blocks: TileBlocks, camera: synthetic.AnyCamera, window: int
) -> StrainMap:
    """Set up the strain map as a measurement of touches.

    Parameters
    ----------
    pattern : TilePattern
        The whole pattern of the same reference.
    blocks : TileBlocks
    camera : synthetic.AnyCamera
    window : int
        Points along the side of the strain window, odd.
    """
    tiles = blocks.reference.tiles
    measured = (blocks.status == Status.OK) & pattern.motions.on_plate
    operator = strain_operator(measured.reshape(tiles.shape), tiles.size, window)
    mean, root = _block_mean(blocks), _noise_root(blocks)
    spread = csr_array(operator @ root)
    sigma = np.sqrt(np.asarray(spread.power(2).sum(axis=1))).reshape(-1, 3)
    weight = np.divide(1.0, sigma.ravel(), out=np.zeros(sigma.size), where=sigma.ravel() > 0)
    scale = synthetic.rigid_motion_basis(camera, tiles.xy)[:, :, 3].ravel()
    modal = pattern.motions.tile_basis()[:, :, : pattern.count]
    motions = np.column_stack([modal.reshape(-1, pattern.count), scale])
    shown = weight[:, None] * (operator @ (mean @ motions))  # strain of each mode over its σ
    projected = spread.T @ (weight[:, None] * shown)
    unmix = np.linalg.inv(np.linalg.cholesky(projected.T @ projected))
    response = unmix @ (shown.T @ shown)
    without_scale = np.linalg.qr(response[:, -1:], mode="complete")[0][:, 1:].T
    return StrainMap(
        motions=pattern.motions,
        operator=operator,
        sigma=np.where(sigma > 0, sigma, np.inf),
        whitening=(without_scale @ unmix @ (shown * weight[:, None]).T).astype(np.float32),
        factor=np.asarray((without_scale @ response[:, :-1]).T, dtype=np.float64),
    )


def _block_mean(blocks: TileBlocks) -> csr_array:
    """Matrix (2T, 2T) from the motion of the tiles to the displacement that a block measures."""
    return csr_array(_block_sum(blocks) @ _diagonal(blocks.hessian))


def _noise_root(blocks: TileBlocks) -> csr_array:
    """Matrix M (2T, 2T) with M Mᵀ the covariance of all displacements at a noise of 1."""
    values, vectors = np.linalg.eigh(blocks.hessian)
    roots = vectors * np.sqrt(values.clip(0))[:, None, :]
    return csr_array(_block_sum(blocks) @ _diagonal(roots))


def _block_sum(blocks: TileBlocks) -> csr_array:
    """Matrix (2T, 2T) that sums over each block and solves for its displacement."""
    rows, columns = (_band(count, blocks.block) for count in blocks.reference.tiles.shape)
    usable = (blocks.status == Status.OK)[:, None, None]
    inverse = _diagonal(np.where(usable, blocks.inverse, 0.0))
    return csr_array(inverse @ kron(kron(rows, columns), np.eye(2), format="csr"))


def _diagonal(parts: F64) -> bsr_array:
    """Block-diagonal matrix of (T, 2, 2) parts."""
    count = len(parts)
    return bsr_array((parts, np.arange(count), np.arange(count + 1)))


def _band(count: int, width: int) -> csr_array:
    apart = np.abs(np.subtract.outer(np.arange(count), np.arange(count)))
    return csr_array((apart <= width // 2).astype(np.float64))
