"""Bilinear forms of the deflection, all that the reduced plate knows of the plate.

Form 0 is the bending energy (v, w) -> vᵀ K w. The next M give the stress: s_m = B_m(w, w) / 2 with
B_m(v, w) = ∫ N^m_ab v,a w,b dA for the stresses N^m of the basis. The last U give the displacement
in the plane the same way: the part of u along U_k is work of the force U_k, so of a stress too.

The shape of a plate that is not flat at rest is a fixed shape as well, the last one, of weight 1
and without energy: B_m(w0, w0) is left out, and so s_m = ½ (B_m(w0 + w, w0 + w) - B_m(w0, w0)).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fe.arrays import F32, F64, I64
from fe.elements.mesh import Mesh
from fe.elements.rise import rise
from fe.linear.membrane import pull, stretch
from fe.reduced.basis import ReducedBasis, spread_out
from fe.reduced.karman import Karman
from fe.reduced.spline import SplineTable, table
from fe.reduced.touch_shape import TouchShapes

# Elements between neighbouring places of the table, and the fewest steps between places along a
# side. One element instead of two changes nothing in 1e4; 15 mm on a plate of 90 mm, 5 %.
_STRIDE = 2
_FEWEST = 10


@dataclass(frozen=True, eq=False)
class Forms:
    """F = 1 + M + U forms on n fixed shapes and on the A functions that move with a touch.

    Attributes
    ----------
    stresses : int
        M.
    fixed : (F, n, n) float32
        Both arguments fixed shapes. Single precision, as in the table, halves what is read.
    moving : SplineTable
        Of F (n A + A (A + 1) / 2) functions of the place of a touch: one argument moving, then
        both.
    """

    stresses: int
    fixed: F32
    moving: SplineTable

    @property
    def resting(self) -> I64:
        """Which fixed shapes have no energy: that of the plate at rest, or none."""
        return np.flatnonzero(np.diagonal(self.fixed[0]) == 0)

    @property
    def functions(self) -> int:
        """A."""
        width, n = self.moving.coefficients.shape[2] // len(self.fixed), self.fixed.shape[1]
        return next(a for a in range(1, width + 1) if n * a + a * (a + 1) // 2 == width)

    def reach(self, mixtures: F64) -> F64:
        """Forms of each fixed shape and of mixtures (n, C) of them: (F, n, C) float64."""
        count, n = self.fixed.shape[:2]
        return (self.fixed.reshape(-1, n) @ mixtures).reshape(count, n, -1)

    def at(self, xy: F64, weight: F64) -> tuple[F64, F64]:
        """Forms at a place, mean over points (Q, 2) mm by weights (Q,).

        Returns
        -------
        mixed : (3, F, n, A) float64
            A fixed and a moving function; first axis value, d/dx, d/dy.
        local : (3, F, A, A) float64
            Two functions that move with the same touch.
        """
        (count, n), functions = self.fixed.shape[:2], self.functions
        found = self.moving.at(xy, weight).reshape(3, count, -1)
        mixed = found[:, :, : n * functions].reshape(3, count, n, functions)
        local = np.empty((3, count, functions, functions))
        left, right = np.triu_indices(functions)
        local[..., left, right] = local[..., right, left] = found[:, :, n * functions :]
        return mixed, local


def forms(
    shapes: TouchShapes, basis: ReducedBasis, progress: Callable[[int, int], object] | None = None
) -> Forms:
    """Compute the forms of a plate for a basis."""
    karman, stresses = shapes.karman, _all_stresses(shapes.karman, basis)
    left = _left(karman, basis.shapes, stresses)
    fixed = _fixed(karman, basis.shapes, left)
    weighed = karman.membrane.weigh(stresses)
    x, y = (_places(karman.mesh, axis) for axis in (0, 1))
    rows: list[F64] = []
    for done, place in enumerate(x, start=1):
        rows.append(_row(shapes, left, weighed, np.column_stack([np.full(len(y), place), y])))
        if progress is not None:
            progress(done, len(x))
    tabled = table(karman.plate.size, np.stack(rows))
    return Forms(basis.stresses.shape[-1], fixed.astype(np.float32), tabled)


def _places(mesh: Mesh, axis: int) -> F64:
    return np.linspace(0.0, mesh.size[axis], max(mesh.counts[axis] // _STRIDE, _FEWEST) + 1)


def _all_stresses(karman: Karman, basis: ReducedBasis) -> F64:
    """Stresses of forms 1 to F - 1, (3, gx, gy, M + U) float64."""
    forces = np.stack([spread_out(karman.mesh, component) for component in basis.drifts])
    membrane = karman.membrane
    drifting = membrane.stress(membrane.strain(membrane.solve(forces)))
    return np.concatenate([basis.stresses, -drifting], axis=-1)


def _fixed(karman: Karman, shapes: F64, left: F32) -> F64:
    """Forms of two fixed shapes, (F, n, n) float64."""
    bent, n = shapes.shape[2], left.shape[1]
    flat = shapes[karman.linear.free].reshape(-1, bent)
    fixed = np.zeros((len(left), n, n))
    found = (left.reshape(-1, left.shape[2]) @ flat).reshape(-1, n, bent)
    fixed[:, :, :bent] = found
    fixed[:, :bent, bent:] = found[:, bent:].swapaxes(1, 2)
    fixed = 0.5 * (fixed + fixed.swapaxes(1, 2))
    fixed[0, :bent, :bent] = np.eye(bent)
    return fixed


def _left(karman: Karman, shapes: F64, stresses: F64) -> F32:
    """Compute the loads that a deflection takes up as form f with fixed shape j, (F, n, N) float32.

    Single precision, for they are many and the reduced plate errs by more than 1e-4.
    """
    free, gauss, fixed = karman.linear.free, karman.membrane.gauss, shapes
    bent = karman.bend(fixed)[free].reshape(-1, fixed.shape[2]).T
    if karman.plate.shape is not None:
        fixed = np.concatenate([fixed, rise(karman.plate, karman.mesh)], axis=2)
        bent = np.concatenate([bent, np.zeros((1, bent.shape[1]))])
    n, slopes = fixed.shape[2], gauss.slopes(fixed)
    left = np.empty((1 + stresses.shape[-1], *bent.shape), dtype=np.float32)
    left[0] = bent
    for f in range(stresses.shape[-1]):
        left[1 + f] = gauss.loads(*pull(stresses[..., f, None], slopes))[free].reshape(-1, n).T
    return left


def _row(shapes: TouchShapes, left: F32, weighed: F64, xy: F64) -> F64:
    """Forms at P places, (P, F (n A + A (A + 1) / 2)) float64."""
    karman = shapes.karman
    moving = np.concatenate([shapes.at(place[None], np.ones(1)) for place in xy], axis=2)
    flat = moving[karman.linear.free].reshape(left.shape[2], -1)
    count, functions = len(left), moving.shape[2] // len(xy)
    mixed = left.reshape(-1, left.shape[2]) @ flat.astype(np.float32)
    mixed = mixed.reshape(count, -1, len(xy), functions)
    a, b = np.triu_indices(functions)
    along, across = (
        part.reshape(*part.shape[:2], len(xy), functions)
        for part in karman.membrane.gauss.slopes(moving)
    )
    pairs = 2.0 * stretch((along[..., a], across[..., a]), (along[..., b], across[..., b]))
    bent = (karman.stiffness @ flat).reshape(-1, len(xy), functions)
    energy = np.einsum("npk,npk->pk", flat.reshape(bent.shape)[..., a], bent[..., b])
    stretched = weighed @ pairs.reshape(weighed.shape[1], -1)
    local = np.concatenate([energy[None], stretched.reshape(count - 1, len(xy), -1)])
    mixed = mixed.transpose(2, 0, 1, 3).reshape(len(xy), count, -1)
    both = np.concatenate([mixed, local.transpose(1, 0, 2)], axis=2)
    return both.reshape(len(xy), -1).astype(np.float64)
