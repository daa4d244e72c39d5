"""Roots of polynomials in an ONNX graph: touches without an order, as `set_encoding.decode`.

ONNX has no complex numbers and no roots. A complex number is a pair of columns here, and the roots
are found by the iteration of Weierstrass (Durand and Kerner), all at once, a fixed number of times:
it converges quadratically to roots that are apart.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from models.nets.onnx import Graph

STEPS = 60
"""Of the iteration; 20 are enough for touches a tenth of a millimetre apart."""

_TINY = 1e-300


class Complex(NamedTuple):
    """Names of the columns (N, 1) of real and imaginary part."""

    real: str
    imag: str


class Algebra:
    """Complex arithmetic as operators of a graph."""

    def __init__(self, graph: Graph) -> None:
        self.graph = graph

    def constant(self, number: complex) -> Complex:
        """Return a number that is the same for all samples."""
        node = self.graph.apply
        return Complex(node("Identity", number.real), node("Identity", number.imag))

    def plus(self, one: Complex, other: Complex, kind: str = "Add") -> Complex:
        """Return the sum, or with "Sub" the difference."""
        node = self.graph.apply
        return Complex(node(kind, one.real, other.real), node(kind, one.imag, other.imag))

    def times(self, one: Complex, other: Complex) -> Complex:
        """Return the product."""
        node = self.graph.apply
        return Complex(
            node("Sub", node("Mul", one.real, other.real), node("Mul", one.imag, other.imag)),
            node("Add", node("Mul", one.real, other.imag), node("Mul", one.imag, other.real)),
        )

    def over(self, one: Complex, other: Complex) -> Complex:
        """Return the quotient; one over 0 is 0, where two roots have met."""
        node = self.graph.apply
        square = node(
            "Add", node("Mul", other.real, other.real), node("Mul", other.imag, other.imag)
        )
        safe = node("Max", square, _TINY)
        turned = Complex(other.real, node("Neg", other.imag))
        product = self.times(one, turned)
        return Complex(node("Div", product.real, safe), node("Div", product.imag, safe))

    def scaled(self, one: Complex, by: str) -> Complex:
        """Return a number times a real one."""
        node = self.graph.apply
        return Complex(node("Mul", one.real, by), node("Mul", one.imag, by))

    def polynomial(self, first: Complex, rest: list[Complex], at: Complex) -> Complex:
        """Return the value of a polynomial, by Horner."""
        value = first
        for coefficient in rest:
            value = self.plus(self.times(value, at), coefficient)
        return value


def decode(graph: Graph, code: str, touches: int, magnitudes: bool) -> str:
    """Add what `set_encoding.decode` does: columns of touches sorted by x."""
    algebra, node = Algebra(graph), graph.apply

    def column(number: int) -> str:
        return node("Slice", code, np.array([number]), np.array([number + 1]), np.array([1]))

    def pair(number: int) -> Complex:
        return Complex(column(number), column(number + 1))

    centre = pair(0)
    coefficients = [pair(2 * k) for k in range(1, touches)]
    about = _roots(algebra, coefficients, touches)
    places = [algebra.plus(root, centre) for root in about]
    x, y = (node("Concat", *(p[part] for p in places), axis=1) for part in (0, 1))
    order = graph.smallest_first(x, touches)
    found = [x, y]
    if magnitudes:
        total = column(2 * touches)
        rest = [pair(2 * touches + 1 + 2 * k) for k in range(touches - 1)]
        residues = [_residue(algebra, total, rest, about, k) for k in range(touches)]
        found.append(node("Concat", *residues, axis=1))
    sorted_ = [node("GatherElements", each, order, axis=1) for each in found]
    columns = [
        node("Slice", sorted_[part], np.array([k]), np.array([k + 1]), np.array([1]))
        for k in range(touches)
        for part in (0, 1)
    ]
    return node("Concat", *columns, *sorted_[2:], name="targets", axis=1)


def _roots(algebra: Algebra, coefficients: list[Complex], touches: int) -> list[Complex]:
    """Return the roots of u^k + p_2 u^(k-2) + … + p_k, by p_2 to p_k."""
    node = algebra.graph.apply
    if touches == 1:
        return [algebra.constant(0j)]
    # All roots lie inside a circle that the coefficients give; in its unit the start suits any.
    sizes = [
        node("Pow", node("Add", node("Mul", c.real, c.real), node("Mul", c.imag, c.imag)), 0.5 / k)
        for k, c in enumerate(coefficients, 2)
    ]
    unit = node("Max", *sizes, _TINY)
    scaled = [
        algebra.scaled(c, node("Reciprocal", node("Pow", unit, float(k))))
        for k, c in enumerate(coefficients, 2)
    ]
    one, none = algebra.constant(1 + 0j), algebra.constant(0j)
    roots = [algebra.constant((0.4 + 0.9j) ** k) for k in range(touches)]
    for _ in range(STEPS):
        for k, root in enumerate(roots):
            value = algebra.polynomial(one, [none, *scaled], root)
            apart = _apart(algebra, roots, k)
            roots[k] = algebra.plus(root, algebra.over(value, apart), "Sub")
    return [algebra.scaled(root, unit) for root in roots]


def _apart(algebra: Algebra, roots: list[Complex], which: int) -> Complex:
    """Return the product of the differences of one root to all others."""
    product = algebra.constant(1 + 0j)
    for k, other in enumerate(roots):
        if k != which:
            product = algebra.times(product, algebra.plus(roots[which], other, "Sub"))
    return product


def _residue(
    algebra: Algebra, total: str, rest: list[Complex], about: list[Complex], which: int
) -> str:
    """Return the magnitude at a root."""
    first = Complex(total, algebra.graph.apply("Mul", total, 0.0))
    value = algebra.polynomial(first, rest, about[which])
    return algebra.over(value, _apart(algebra, about, which)).real
