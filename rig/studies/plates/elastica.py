"""Euler's elastica between clamps."""

from scipy.optimize import brentq
from scipy.special import ellipe, ellipk


def elastica(length: float, bend: float) -> float:
    """Height of the middle of a strip between clamps that came nearer by `bend`."""
    modulus: float = brentq(
        lambda k: 2 - 2 * ellipe(k**2) / ellipk(k**2) - bend / length, 1e-6, 0.9
    )  # pyright: ignore[reportAssignmentType]
    return length * modulus / ellipk(modulus**2)
