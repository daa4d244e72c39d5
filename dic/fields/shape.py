"""Shape functions: the polynomial by which a subset deforms.

u(ξ, η) = Σ c_m ξ^a η^b over the monomials below, and v likewise. Orders 0 and 1 share the three
coefficients of order 1; those of ξ and η stay zero at order 0.
"""

from __future__ import annotations

import numpy as np

from dic.arrays import F64, I64

ORDERS = (0, 1, 2)


def monomials(degree: int) -> I64:
    """Exponents (a, b) of ξ and η, (M, 2), by rising degree: 1, ξ, η, ξ², ξη, η² and so on."""
    return np.array([(d - b, b) for d in range(degree + 1) for b in range(d + 1)])


def degree(order: int) -> int:
    """Degree of the polynomials that are carried for an order."""
    return max(order, 1)


def count(order: int) -> int:
    """Coefficients of u, as many as of v: 3 or 6."""
    return len(monomials(degree(order)))


def unknowns(order: int) -> I64:
    """Places of what is solved for among (c of u, c of v, gain, offset)."""
    every = np.arange(2 * count(order) + 2)
    return every if order else every[[0, 3, 6, 7]]


def products(order: int) -> I64:
    """Place of the product of two monomials among those of twice the degree, (P, P)."""
    exponents = monomials(degree(order))
    total = exponents[:, None] + exponents
    sums = total.sum(axis=-1)
    return sums * (sums + 1) // 2 + total[..., 1]


def centre_weights(order: int, side: int) -> F64:
    """Weigh the pixels of a subset as the fit does that gives the motion of its centre.

    For a texture that is the same everywhere: (side, side), of sum 1. Orders 0 and 1 take the mean.
    """
    eta, xi = 2 * (np.mgrid[:side, :side] - (side - 1) / 2) / side
    powers = monomials(order)[:, :, None, None]
    basis = xi ** powers[:, 0] * eta ** powers[:, 1]
    normal = np.einsum("iyx,jyx->ij", basis, basis)
    return np.einsum("i,iyx->yx", np.asarray(np.linalg.inv(normal)[0], dtype=np.float64), basis)
