"""Numbers and arrays as they come in, or one sentence that says what is wrong with them."""

from __future__ import annotations

from math import isfinite
from numbers import Integral, Real
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from fe.arrays import F64

# Of lengths in mm, moduli in MPa and forces in N: their powers stay finite.
_SMALLEST, _LARGEST = 1e-30, 1e30


def number(given: object, name: str, unit: str) -> float:
    """Return a real number as a float; NaN and infinity pass.

    Raises
    ------
    ValueError
        It is no number, or too large for a float.
    """
    value: Any = given
    if getattr(value, "ndim", None) == 0:
        value = value.item()
    if isinstance(value, bool) or not isinstance(value, Real):
        raise ValueError(f"{name} must be a number in {unit}, got {short(value)}; give one")
    try:
        return float(value)
    except OverflowError:
        raise ValueError(f"{name} must be a number in {unit} below 1e308, got more") from None


def whole(value: object, name: str) -> int:
    """Return a whole number as an int.

    Raises
    ------
    ValueError
        It is no whole number.
    """
    if isinstance(value, bool) or not isinstance(value, Integral):
        raise ValueError(f"{name} must be a whole number, got {short(value)}; give one")
    return int(value)


def positive(given: object, name: str, unit: str) -> float:
    """Return a number above 0 whose powers a float can hold.

    Raises
    ------
    ValueError
        It is no number, not positive, or beyond what any plate has.
    """
    value = number(given, name, unit)
    if not (isfinite(value) and value > 0):
        raise ValueError(f"{name} must be positive and finite, got {value:g} {unit}")
    if not _SMALLEST <= value <= _LARGEST:
        raise ValueError(
            f"{name} must lie in {_SMALLEST:g} to {_LARGEST:g} {unit}, got {value:g} {unit}; "
            "give it in that unit"
        )
    return value


def array(values: ArrayLike, name: str, unit: str) -> F64:
    """Return real numbers as a contiguous float64 array, shape as given; NaN passes.

    Raises
    ------
    ValueError
        They are no real numbers, or do not form an array.
    """
    try:
        given: Any = np.asarray(values)
    except (ValueError, TypeError, OverflowError):
        raise ValueError(
            f"{name} must form an array in {unit}, got {short(values)}; give rows of one length"
        ) from None
    if given.dtype.kind not in "iuf":
        raise ValueError(
            f"{name} must be real numbers in {unit}, got {short(values)} of type {given.dtype}"
        )
    return np.ascontiguousarray(given, dtype=np.float64)


def short(value: object) -> str:
    """Write a value for the sentence of an error: on one line, at most 40 characters."""
    text = " ".join(repr(value)[:200].split())
    return text if len(text) <= 40 else text[:37] + "..."
