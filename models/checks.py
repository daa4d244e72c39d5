"""Numbers and arrays that callers give, checked: each refusal is one sentence."""

from __future__ import annotations

from math import inf
from numbers import Integral, Real
from typing import cast

import numpy as np

from models.arrays import F64


def check_integer(name: str, value: object, smallest: int, remedy: str = "") -> int:
    """Return a whole number that is `smallest` or more.

    Raises
    ------
    ValueError
        If it is none; `remedy` says what to use.
    """
    whole = not isinstance(value, bool) and isinstance(value, Integral)
    if not whole or int(cast(Integral, value)) < smallest:
        remedy = remedy or f"use {smallest}"
        raise ValueError(
            f"{name} must be a whole number of {smallest} or more, got {shown(value)}; {remedy}"
        )
    return int(cast(Integral, value))


def check_number(
    name: str, value: object, unit: str, above: float = -inf, below: float = inf, remedy: str = ""
) -> float:
    """Return a finite number between two bounds that it may not reach.

    Raises
    ------
    ValueError
        If it is none; `remedy` says what to use.
    """
    real = isinstance(value, Real) and not isinstance(value, bool | np.bool_)
    if not real or not above < float(cast(float, value)) < below:
        limits = [f"above {above:g}"] * (above > -inf) + [f"below {below:g}"] * (below < inf)
        wanted = " ".join(["a finite number", " and ".join(limits), unit]).replace("  ", " ")
        remedy = remedy or "give a number of that range"
        raise ValueError(f"{name} must be {wanted.rstrip()}, got {shown(value)}; {remedy}")
    return float(cast(float, value))


def read_array(
    name: str, values: object, unit: str, shape: tuple[int | str, ...], remedy: str = ""
) -> F64:
    """Read an array of real numbers in float64, which may be NaN or infinite.

    Parameters
    ----------
    name, unit
        For the sentence that refuses it.
    shape
        Numbers that must be met, and names of those that may be any.
    remedy
        What to do where the shape is another.

    Raises
    ------
    ValueError
        If the values are not real numbers or have another shape.
    """
    remedy = remedy or "give one number for each"
    wanted = "(" + ", ".join(map(str, shape)) + ("," if len(shape) == 1 else "") + ")"
    try:
        given = np.asarray(values)
    except (ValueError, TypeError):
        raise ValueError(f"{name} must be one array {wanted}, {unit}; give equal rows") from None
    if given.dtype.kind not in "fiu":
        raise ValueError(
            f"{name} must be real numbers {wanted}, {unit}, got {given.dtype}; convert it to float"
        )
    fits = given.ndim == len(shape) and all(
        isinstance(want, str) or want == there
        for want, there in zip(shape, given.shape, strict=True)
    )
    if not fits:
        raise ValueError(f"{name} must have shape {wanted}, {unit}, got {given.shape}; {remedy}")
    return np.asarray(given, dtype=np.float64)


def read_measured(measured: object, shape: tuple[int, ...]) -> F64:
    """Read a measurement of a forward model; what it leaves out may be NaN.

    Raises
    ------
    ValueError
        As `read_array`.
    """
    # Frame after frame this is all that it takes.
    if type(measured) is np.ndarray and measured.shape == shape and measured.dtype == np.float64:
        return measured
    return read_array("measurement", measured, "in the units of the forward model", shape)


def check_finite(name: str, values: F64, remedy: str) -> F64:
    """Return an array of which every number is finite.

    Raises
    ------
    ValueError
        If one is not.
    """
    if not np.isfinite(values).all():
        raise ValueError(f"{name} holds NaN or infinite values; {remedy}")
    return values


def shown(value: object) -> str:
    """Write a value in a sentence: a number as it is, of anything else the type."""
    if isinstance(value, bool | np.bool_ | Real):
        return f"{value}"
    return f"a {type(value).__name__}"
