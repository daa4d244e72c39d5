"""Numbers and arrays that a caller gives, checked: what does not fit is one sentence."""

from __future__ import annotations

import math
from collections.abc import Sequence
from numbers import Integral
from os import PathLike
from pathlib import Path
from typing import TypeGuard, TypeVar, cast

import numpy as np

from dic.arrays import F64, I64, AnyArray

T = TypeVar("T")
_LONG = 1e30  # from where on a number is not written out
_KINDS = {"b": "bool", "i": "int", "u": "unsigned int", "f": "float"}
LARGEST = 1e9
"""Of any number that is given: products of four stay within single precision."""


def median(values: F64) -> float:
    """Return the median of a line; `np.median` looks for NaN, which a few points do not repay."""
    middle = len(values) // 2
    below = middle - 1 + len(values) % 2
    ordered = np.partition(values, (below, middle))
    return float(ordered[below] + ordered[middle]) / 2


def read_integer(value: object, name: str, unit: str) -> int:
    """Return `value` as an int; one of numpy is taken too, a bool or a float is not.

    Raises
    ------
    ValueError
        `value` is no whole number, or beyond `LARGEST`.
    """
    if isinstance(value, bool) or not isinstance(value, Integral):
        raise ValueError(
            f"{name} must be a whole number of {unit}, got {shown(value)}; {_integer_near(value)}"
        )
    if abs(int(value)) > LARGEST:
        raise ValueError(f"{name} must be at most {LARGEST:g} {unit}, got more; use a smaller one")
    return int(value)


def read_real(value: object, name: str, unit: str) -> float:
    """Return `value`, zero or positive, as a float.

    Raises
    ------
    ValueError
        `value` is no number, negative, NaN or larger than `LARGEST`.
    """
    if not _is_number(value):
        raise ValueError(f"{name} must be a number of {unit}, got {shown(value)}; convert it")
    number = value if isinstance(value, int) else float(value)  # float16 cannot hold LARGEST
    if not 0 <= number <= LARGEST:
        raise ValueError(
            f"{name} must be from 0 to {LARGEST:g} {unit}, got {shown(value)}; check its unit"
        )
    return float(number)


def read_array(values: object, name: str, unit: str, largest: float = LARGEST) -> F64:
    """Return `values` as float64 of any shape; NaN is kept.

    Raises
    ------
    ValueError
        `values` are no real numbers, or some are beyond `largest`.
    """
    try:
        array = np.asarray(values)
    except (ValueError, TypeError):  # such as lists of different lengths
        array = np.zeros(0, dtype=np.object_)
    if array.dtype.kind not in "iuf":
        raise ValueError(
            f"{name} must be an array of real numbers in {unit}, got {shown(values)}; convert it"
        )
    with np.errstate(over="ignore"):  # of what is longer than float64
        array = array.astype(np.float64)
    if np.any(np.abs(array) > largest):
        raise ValueError(f"{name} holds numbers beyond {largest:g} {unit}; correct or remove them")
    return array


def read_points(points: object, name: str) -> F64:
    """Return one or more points (x, y) as (N, 2) float64 px; NaN is kept.

    Raises
    ------
    ValueError
        There are none, or they are not in pairs.
    """
    xy = read_array(points, name, "px")
    if xy.ndim != 2 or xy.shape[1] != 2 or len(xy) == 0:
        raise ValueError(
            f"{name} must be (N, 2) in px, ordered (x, y), got shape {xy.shape}; stack them so"
        )
    return xy


def read_pixels(pixels: object, name: str) -> I64:
    """Return pixels (x, y) as (N, 2) int64, or raise ValueError."""
    xy = check_array(pixels, name, "iu", 2)
    if xy.shape[1] != 2:
        raise ValueError(
            f"{name} must be (N, 2) in px, ordered (x, y), got shape {xy.shape}; stack them so"
        )
    return xy.astype(np.int64, copy=False)


def read_shape(shape: object, name: str) -> tuple[int, int]:
    """Return the (H, W) of an image as two integers, or raise ValueError."""
    if not isinstance(shape, tuple | list):
        raise ValueError(f"{name} must be (H, W) in px, got {shown(shape)}; give both sides")
    sides = cast("Sequence[object]", shape)
    if len(sides) != 2:
        raise ValueError(f"{name} must be (H, W) in px, got {len(sides)} numbers; give both sides")
    height, width = (read_integer(side, f"side of {name}", "px") for side in sides)
    return height, width


def check_array(array: object, name: str, kinds: str, dimensions: int) -> AnyArray:
    """Return `array` if it is one of numpy, of these dimensions and kinds of dtype ("biuf").

    Raises
    ------
    ValueError
        It is not.
    """
    if not _is_array(array) or array.ndim != dimensions or array.dtype.kind not in kinds:
        raise ValueError(
            f"{name} must be an array of {dimensions} dimensions and of "
            f"{' or '.join(_KINDS[kind] for kind in kinds)}, got {shown(array)}; convert it"
        )
    return array


def read_path(path: object) -> Path:
    """Return `path` as a Path, or raise ValueError."""
    if not isinstance(path, str | PathLike):
        raise ValueError(f"path must be a str or a Path, got {shown(path)}; give one")
    return Path(cast("str", path))


def check_type(value: object, kind: type[T], name: str, maker: str) -> T:
    """Return `value` if it is of the kind that `maker` makes, or raise ValueError."""
    if not isinstance(value, kind):
        raise ValueError(
            f"{name} must be a {kind.__name__}, got {shown(value)}; make it by {maker}"
        )
    return value


def shown(value: object) -> str:
    """Write what was given, in a few letters: a number or text itself, of all else the kind."""
    if _is_array(value):
        return f"an array of {value.dtype} of shape {value.shape}"
    if isinstance(value, bool) or (_is_number(value) and not _is_long(value)):
        return str(value)
    if isinstance(value, str) and len(value) < 30:
        return repr(value)
    return f"a {type(value).__name__}"


def _integer_near(value: object) -> str:
    if _is_number(value) and math.isfinite(value):
        return f"use {round(value)}"
    return "use an integer such as 5"


def _is_long(value: float) -> bool:
    return isinstance(value, int) and abs(value) >= _LONG


def _is_number(value: object) -> TypeGuard[float]:
    return isinstance(value, int | float | np.integer | np.floating) and not isinstance(value, bool)


def _is_array(value: object) -> TypeGuard[AnyArray]:
    return isinstance(value, np.ndarray)
