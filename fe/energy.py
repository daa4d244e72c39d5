"""Bending energy of the plate as products of integrals along its two axes."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from fe.plate import Plate

# A clamped end of a line holds its value and its slope; in the product of two lines that holds
# w, both slopes and w,xy along the edge, as a clamped edge does.
CLAMPED = slice(2, -2)


def bending_stiffness(
    plate: Plate,
    along_x: Callable[[int, int], Any],
    along_y: Callable[[int, int], Any],
    kron: Callable[[Any, Any], Any],
) -> Any:
    """Matrix K of the energy wᵀ K w / 2 = D/2 ∫ (w,xx + w,yy)² - 2 (1 - ν)(w,xx w,yy - w,xy²) dA.

    Parameters
    ----------
    plate : Plate
    along_x, along_y : callable
        Matrix of ∫ f⁽ᵖ⁾ g⁽ᑫ⁾ over the side for the functions used along it, given (p, q).
    kron : callable
        Kronecker product for such matrices, `scipy.sparse.kron` or `numpy.kron`.

    Returns
    -------
    matrix, N/mm for functions in mm
    """
    d, nu = plate.rigidity, plate.poisson
    terms = (
        (d, (2, 2), (0, 0)),
        (d, (0, 0), (2, 2)),
        (d * nu, (2, 0), (0, 2)),
        (d * nu, (0, 2), (2, 0)),
        (2 * d * (1 - nu), (1, 1), (1, 1)),
    )
    return sum(factor * kron(along_x(*x), along_y(*y)) for factor, x, y in terms)
