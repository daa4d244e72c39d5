"""Energy of a plate, its tension and its edges as products of integrals along the two axes."""

from __future__ import annotations

from collections.abc import Callable
from math import isinf
from typing import Any

import numpy as np
import scipy.sparse as sp

from fe.arrays import F64, Mask
from fe.elements.edge_gram import edge_gram
from fe.elements.hermite import hermite, hermite_gram
from fe.elements.line import Line
from fe.elements.mesh import Mesh, on_elements
from fe.plate.edges import taper_of
from fe.plate.plate import Plate

Free = tuple[Mask, Mask]

_Products = Callable[[int, int], Any]
_ROUNDING = 1e-14  # of the largest factor


def bending_products(
    poisson: float,
    along_x: _Products,
    along_y: _Products,
    kron: Callable[[Any, Any], Any],
) -> Any:
    """Matrix K of the energy wᵀ K w / 2 = 1/2 ∫ (w,xx + w,yy)² - 2 (1 - ν)(w,xx w,yy - w,xy²) dA.

    Parameters
    ----------
    poisson : float
        ν.
    along_x, along_y : callable
        Matrix of ∫ f⁽ᵖ⁾ g⁽ᑫ⁾ over the side for the functions used along it, given (p, q).
    kron : callable
        Kronecker product for such matrices, `scipy.sparse.kron` or `numpy.kron`.

    Returns
    -------
    matrix, 1/mm², to be multiplied by the rigidity
    """
    terms = (
        (1.0, (2, 2), (0, 0)),
        (1.0, (0, 0), (2, 2)),
        (poisson, (2, 0), (0, 2)),
        (poisson, (0, 2), (2, 0)),
        (2 * (1 - poisson), (1, 1), (1, 1)),
    )
    return sum(factor * kron(along_x(*x), along_y(*y)) for factor, x, y in terms)


def tension_products(
    tension: tuple[float, float, float],
    along_x: _Products,
    along_y: _Products,
    kron: Callable[[Any, Any], Any],
) -> Any:
    """Matrix G of the energy wᵀ G w / 2 = 1/2 ∫ Nxx w,x² + Nyy w,y² + 2 Nxy w,x w,y dA, N/mm.

    Parameters are those of `bending_products`, with the tension Nxx, Nyy, Nxy in N/mm.
    """
    xx, yy, xy = tension
    terms = ((xx, (1, 1), (0, 0)), (yy, (0, 0), (1, 1)), (xy, (1, 0), (0, 1)), (xy, (0, 1), (1, 0)))
    return sum(each * kron(along_x(*x), along_y(*y)) for each, x, y in terms)


def stiffness(plate: Plate, mesh: Mesh, kept: Free | None = None) -> sp.csc_array:
    """Stiffness of the unknowns in the kept rows and columns of the table, N/mm.

    Bending of every part of one rigidity, the tension at rest, and the springs of elastic edges.
    Kept are those that the edges leave `free` if left out.
    """
    rows, columns = kept or free(plate, mesh)

    def along(
        axis: int,
        keep: Mask,
        run: tuple[int, int] | None = None,
        weights: F64 | None = None,
    ) -> _Products:
        def product(p: int, q: int) -> sp.csr_array:
            return hermite_gram(mesh.lines[axis], p, q, run, weights)[keep][:, keep]

        return product

    rigidity = rigidities(plate, mesh)
    matrix = _edge_stiffness(plate, mesh, rows, columns)
    for run_x in mesh.lines[0].runs:
        for run_y in mesh.lines[1].runs:
            for x, y in _factors(rigidity[slice(*run_x), slice(*run_y)]):
                parts = along(0, rows, run_x, x), along(1, columns, run_y, y)
                matrix = matrix + bending_products(plate.poisson, *parts, sp.kron)
    if any(plate.tension):
        whole = along(0, rows), along(1, columns)
        matrix = matrix + tension_products(plate.tension, *whole, sp.kron)
    return sp.csc_array(matrix)


def _factors(rigidity: F64) -> list[tuple[F64, F64]]:
    """Write rigidities (nx, ny) as a sum of products of one factor along x and one along y.

    One where they are even, and four where the thickness rises along both.
    """
    left, sizes, right = np.linalg.svd(rigidity, full_matrices=False)
    count = int(np.count_nonzero(sizes > _ROUNDING * sizes[0]))
    return [(size * x, y) for x, size, y in zip(left.T, sizes[:count], right, strict=False)]


def rigidities(plate: Plate, mesh: Mesh) -> F64:
    """Bending rigidity D of each element, (nx, ny) float64, N mm."""
    thickness, young = on_elements(plate, mesh)
    return young * thickness**3 / (12.0 * (1.0 - plate.poisson**2))


def free(plate: Plate, mesh: Mesh) -> Free:
    """Which unknowns of w along each line the edges leave free: two bool arrays.

    An edge that holds w holds its value along the whole edge, and so its slope along the edge;
    one that holds the rotation holds the slope across and so w,xy. Hence the free unknowns are a
    product, rows by columns of the table.
    """
    kept: list[Mask] = []
    for axis, line in enumerate(mesh.lines):
        keep = np.ones(line.unknowns, dtype=bool)
        for edge, first in zip(plate.sides.along(axis), (0, line.unknowns - 2), strict=True):
            keep[first] = not isinf(edge.springs.deflection)
            keep[first + 1] = not isinf(edge.springs.rotation)
        kept.append(keep)
    return kept[0], kept[1]


def _edge_stiffness(plate: Plate, mesh: Mesh, rows: Mask, columns: Mask) -> sp.csr_array:
    """Springs of elastic edges; a rigid one is held instead, one of no stiffness is left out."""
    matrix = sp.csr_array((rows.sum() * columns.sum(),) * 2)
    for axis, keep, other, keep_other in ((0, rows, 1, columns), (1, columns, 0, rows)):
        for end, edge in enumerate(plate.sides.along(axis)):
            # The first two springs, on deflection and on slope.
            for order, (spring, taper) in enumerate(
                zip(edge.springs[:2], taper_of(edge)[:2], strict=True)
            ):
                if spring == 0 or isinf(spring):
                    continue
                along = edge_gram(mesh.lines[other], taper)[keep_other][:, keep_other]
                across = spring * _at_end(mesh.lines[axis], end, order)[keep][:, keep]
                pair = (across, along) if axis == 0 else (along, across)
                matrix = matrix + sp.kron(*pair)
    return matrix


def _at_end(line: Line, end: int, order: int) -> sp.csr_array:
    """Square of a derivative at an end of a line, as a matrix of its unknowns."""
    start, weights = hermite(line.nodes[[0, -1]][[end]], line, order)
    row = sp.csr_array(
        (weights[0], (np.zeros(4, dtype=int), start[0] + np.arange(4))), shape=(1, line.unknowns)
    )
    return sp.csr_array(row.T @ row)
