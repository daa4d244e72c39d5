"""What a camera's tile sums show of a deflection on any mesh, without a rendered image.

The motion of every tile is the mean over 16 of its points, read from the finite elements of the
truth; the sums are those of the gradients of a rendered pattern. Their noise is that of a sensor.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse as sp

import fe
import models
import synthetic
from dic import TileReference
from fe.elements.functional import Functional, derivative
from fe.elements.mesh import Mesh
from fe.linear.energy import free
from rig.studies.touches.pattern import AGAINST, MODES, Bench, stand
from rig.system.arrays import F64

ALONG = 4  # points along the side of a tile


@dataclass(frozen=True, eq=False)
class SeenPlate:
    """A bench, its pattern as a measurement, and the modes that the estimator knows."""

    bench: Bench
    modes: fe.Modes
    pattern: models.TilePattern

    @property
    def noise(self) -> float:
        """Of a frame less the reference, grey levels."""
        return AGAINST

    def readings(self, mesh: Mesh) -> F64:
        """Whitened measurement of each free unknown of the deflection on a mesh, (m, unknowns)."""
        plate, camera, tiles = self.bench.plate, self.bench.camera, self.bench.reference.tiles
        height = camera.face_height(plate.thickness)
        motion: list[sp.csr_array] = [sp.csr_array((2 * len(tiles.xy), _unknowns(plate, mesh)))]
        steps = (np.arange(ALONG) + 0.5) / ALONG - 0.5
        for right in steps * tiles.size:
            for down in steps * tiles.size:
                px = tiles.xy + np.array([right, down])
                motion.append(_moved(plate, mesh, camera, px, height))
        total = sp.csr_array(sum(motion[1:], motion[0]) / ALONG**2)
        right = _right(self.pattern, self.bench.reference, total)
        return np.stack([self.pattern.whiten(column, AGAINST) for column in right.T], axis=1)


def prepare_seen(thickness: float, pixels: int) -> SeenPlate:
    """See a plate of PVC of 254 mm a side through the camera of the twin."""
    bench = stand(thickness, pixels)
    modes = fe.modes(bench.plate, MODES)
    height = bench.camera.face_height(thickness)
    motions = models.prepare_motions(modes, bench.camera, height, bench.reference.tiles)
    return SeenPlate(bench, modes, models.prepare_pattern(motions, bench.reference))


def _unknowns(plate: fe.Plate, mesh: Mesh) -> int:
    rows, columns = free(plate, mesh)
    return int(rows.sum() * columns.sum())


def _matrix(plate: fe.Plate, mesh: Mesh, functional: Functional) -> sp.csr_array:
    """Functionals of the free unknowns as a matrix, (K, unknowns)."""
    x, y = functional.x, functional.y
    wide = y.columns[:, None, :] + mesh.shape[1] * x.columns[:, :, None]
    weights = x.weights[:, :, None] * y.weights[:, None, :]
    count = len(x.start)
    where = np.repeat(np.arange(count), weights[0].size), wide.ravel()
    table = sp.csr_array((weights.ravel(), where), shape=(count, mesh.shape[0] * mesh.shape[1]))
    rows, columns = free(plate, mesh)
    return sp.csr_array(table[:, np.flatnonzero(np.outer(rows, columns).ravel())])


def _moved(
    plate: fe.Plate, mesh: Mesh, camera: synthetic.Camera, px: F64, height: float
) -> sp.csr_array:
    """Image motion at pixels of each free unknown, x of all before y of all, (2N, unknowns)."""
    places = camera.on_plate(px, height)
    on = ((places >= 0) & (places <= np.array(plate.size))).all(axis=1).astype(np.float64)
    inside = np.clip(places, 0.0, np.array(plate.size))
    jacobian = camera.jacobian(np.column_stack([inside, np.full(len(inside), height)]))
    w, wx, wy = (
        _matrix(plate, mesh, derivative(mesh, inside, p, q)) for p, q in ((0, 0), (1, 0), (0, 1))
    )
    along: list[Any] = []
    for axis in (0, 1):
        by_u, by_v, by_w = (jacobian[:, axis, k] * on for k in range(3))
        along.append(
            sp.diags_array(by_w) @ w
            - sp.diags_array(height * by_u) @ wx
            - sp.diags_array(height * by_v) @ wy
        )
    return sp.csr_array(sp.vstack(along))


def _right(pattern: models.TilePattern, reference: TileReference, motion: sp.csr_array) -> F64:
    """Right-hand sides of the pattern for motions of all tiles, (K + R + 2, unknowns)."""
    count = len(reference.hessian)
    along_x, along_y = motion[:count], motion[count:]
    basis = pattern.motions.tile_basis()
    xx, xy, yy = reference.hessian.T.astype(np.float64)
    by_x = xx[:, None] * basis[:, 0] + xy[:, None] * basis[:, 1]
    by_y = xy[:, None] * basis[:, 0] + yy[:, None] * basis[:, 1]
    fx_f, fy_f, fx, fy = reference.light.T[:4].astype(np.float64)
    moved = (along_x.T @ by_x + along_y.T @ by_y).T
    light = -np.stack([along_x.T @ fx_f + along_y.T @ fy_f, along_x.T @ fx + along_y.T @ fy])
    return np.vstack([moved, light])
