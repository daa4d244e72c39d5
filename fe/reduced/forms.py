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
from math import ceil

import numpy as np

from fe.arrays import F32, F64, I64
from fe.elements.mesh import Mesh
from fe.elements.rise import rise
from fe.linear.membrane import pull, stretch
from fe.reduced.karman import Karman
from fe.reduced.parallel import in_parallel
from fe.reduced.sheet import samples
from fe.reduced.spline import SplineTable, table
from fe.reduced.touch_shape import TouchShapes

# Elements between neighbouring places of the table, and the fewest steps between places along a
# side. One element instead of two changes nothing in 1e4; 15 mm on a plate of 90 mm, 5 %.
_STRIDE = 2
_FEWEST = 10
# Places that are computed at once: their slopes at all Gauss points are what takes memory.
_TOGETHER = 6
_FORM_STEPS = 40


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
        Of F (A n + A (A + 1) / 2) functions of the place of a touch: one argument moving, then
        both.
    slopes : SplineTable
        Of the slopes of the A functions at the samples of `fe.reduced.sheet`.
    """

    stresses: int
    fixed: F32
    moving: SplineTable
    slopes: SplineTable

    @property
    def resting(self) -> I64:
        """Which fixed shapes have no energy: that of the plate at rest, or none."""
        return np.flatnonzero(np.diagonal(self.fixed[0]) == 0)

    @property
    def functions(self) -> int:
        """A."""
        width, n = self.moving.coefficients.shape[2] // len(self.fixed), self.fixed.shape[1]
        return next(a for a in range(1, width + 1) if n * a + a * (a + 1) // 2 == width)

    @property
    def row_shape(self) -> tuple[int, int]:
        """F, and the length L of a row."""
        return len(self.fixed), self.moving.coefficients.shape[2] // len(self.fixed)

    def rows(self, xy: F64, weight: F64) -> F64:
        """Forms at a place, mean over points (Q, 2) mm by weights (Q,).

        Returns
        -------
        (3, F, L) float64
            First axis value, d/dx, d/dy. Of each form A n values of a moving function and a fixed
            shape, then A (A + 1) / 2 of two functions that move with the same touch.
        """
        return self.moving.at(xy, weight).reshape(3, *self.row_shape)


def forms(
    shapes: TouchShapes, fixed: F64, work: F32, stresses: int, progress: Callable[[], object]
) -> Forms:
    """Compute the forms of a plate for a basis.

    Parameters
    ----------
    shapes : TouchShapes
    fixed : (2 nx + 2, 2 ny + 2, n) float64, mm
        Fixed shapes of w.
    work : (F - 1, 3 gx gy) float32
        See `fe.reduced.basis.work_on_strain`.
    stresses : int
        M, of the forms how many are stresses.
    progress : callable
        Called `form_steps` times.
    """
    karman = shapes.karman
    x, y = (_places(karman.mesh, axis) for axis in (0, 1))
    places = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2)
    local, moving, slopes = _local(shapes, work, places, progress)
    paired, mixed = _with_fixed(karman, fixed, work, moving, progress)
    del moving
    both = np.concatenate([mixed, local], axis=2).reshape(len(x), len(y), -1)
    del mixed, local
    tabled = table(karman.plate.size, both)
    seen = table(karman.plate.size, slopes.reshape(len(x), len(y), -1))
    return Forms(stresses, paired.astype(np.float32), tabled, seen)


def form_steps(mesh: Mesh) -> int:
    """Count the steps of `forms`."""
    return len(_parts(len(_places(mesh, 0)) * len(_places(mesh, 1)))) + _FORM_STEPS


def _places(mesh: Mesh, axis: int) -> F64:
    return np.linspace(0.0, mesh.size[axis], max(mesh.counts[axis] // _STRIDE, _FEWEST) + 1)


def _parts(places: int) -> list[I64]:
    """Places that are computed together."""
    return np.array_split(np.arange(places), ceil(places / _TOGETHER))


def _with_fixed(
    karman: Karman, shapes: F64, work: F32, moving: F32, progress: Callable[[], object]
) -> tuple[F64, F32]:
    """Forms of a fixed shape with another and with what moves, one form after the other.

    Single precision: the loads that a deflection takes up are many, and the reduced plate errs by
    more than 1e-4.

    Parameters
    ----------
    karman : Karman
    shapes : (2 nx + 2, 2 ny + 2, bent) float64, mm
    work : (F - 1, 3 gx gy) float32
    moving : (N, P, A) float32, mm
    progress : callable
        Called `_FORM_STEPS` times.

    Returns
    -------
    fixed : (F, n, n) float64
    mixed : (P, F, A n) float32
    """
    free, gauss, every = karman.linear.free, karman.membrane.gauss, shapes
    size, places, functions = moving.shape
    own = shapes[free].reshape(size, -1)
    bent, flat = own.shape[1], moving.reshape(size, -1)
    energy = karman.bend(shapes)[free].reshape(size, bent).T
    if karman.plate.shape is not None:
        every = np.concatenate([shapes, rise(karman.plate, karman.mesh)], axis=2)
        energy = np.concatenate([energy, np.zeros((1, size))])
    n, slopes = every.shape[2], gauss.slopes(every)
    fixed = np.zeros((1 + len(work), n, n))
    mixed = np.empty((places, len(fixed), functions, n), dtype=np.float32)

    one_shear = np.array([1.0, 1.0, 0.5])[:, None, None, None]

    def fill(f: int) -> None:
        loads = energy
        if f > 0:
            # The shear stood for both off-diagonal parts.
            stress = work[f - 1].reshape(3, *gauss.weights.shape, 1) * one_shear
            pulled = gauss.gathered(*pull(stress, slopes))
            loads = pulled[free].reshape(size, n).T
        fixed[f, :, :bent] = loads @ own
        found = (loads.astype(np.float32) @ flat).reshape(n, places, functions)
        mixed[:, f] = found.transpose(1, 2, 0)

    for part in np.array_split(np.arange(len(fixed)), _FORM_STEPS):
        for _ in in_parallel(fill, part.tolist()):
            pass
        progress()
    fixed[:, :bent, bent:] = fixed[:, bent:, :bent].swapaxes(1, 2)
    fixed = 0.5 * (fixed + fixed.swapaxes(1, 2))
    fixed[0, :bent, :bent] = np.eye(bent)
    return fixed, mixed.reshape(places, len(fixed), -1)


def _local(
    shapes: TouchShapes, work: F32, places: F64, progress: Callable[[], object]
) -> tuple[F32, F32, F32]:
    """Forms of two functions that move with the same touch, and these functions.

    Returns
    -------
    local : (P, F, A (A + 1) / 2) float32
    moving : (N, P, A) float32, mm
        Free unknowns under 1 N at each of the places (P, 2) mm.
    slopes : (P, 2 Q A) float32
        At the samples.
    """
    karman, grid = shapes.karman, samples(shapes.karman.mesh)
    gauss, free, functions = karman.membrane.gauss, karman.linear.free, len(shapes.factors)
    a, b = np.triu_indices(functions)
    size = karman.stiffness.shape[0]
    local = np.empty((len(places), 1 + len(work), len(a)), dtype=np.float32)
    moving = np.empty((size, len(places), functions), dtype=np.float32)
    slopes = np.empty((len(places), grid.readings, functions), dtype=np.float32)

    def fill(part: I64) -> None:
        there = shapes.each(places[part])
        seen = grid.slopes(there.reshape(*there.shape[:2], -1))
        slopes[part] = seen.reshape(grid.readings, len(part), functions).swapaxes(0, 1)
        flat = there[free].reshape(size, len(part), functions)
        moving[:, part] = flat
        along, across = (
            slope.astype(np.float32).reshape(*slope.shape[:2], len(part), functions)
            for slope in gauss.slopes(there.reshape(*there.shape[:2], -1))
        )
        pairs = stretch((along[..., a], across[..., a]), (along[..., b], across[..., b]))
        stretched = np.float32(2.0) * (work @ pairs.reshape(work.shape[1], -1))
        local[part, 1:] = stretched.reshape(len(work), len(part), -1).swapaxes(0, 1)
        bent = (karman.stiffness @ flat.reshape(size, -1)).reshape(flat.shape)
        local[part, 0] = np.einsum("npk,npk->pk", flat[..., a], bent[..., b])

    for _ in in_parallel(fill, _parts(len(places))):
        progress()
    return local, moving, slopes.reshape(len(places), -1)
