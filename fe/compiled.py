"""Compiled functions that keep their types: Numba states none."""

from collections.abc import Callable
from typing import Any, TypeVar

import numba

from fe.kernel_file import sealed

_Function = TypeVar("_Function", bound=Callable[..., Any])


def njit(**options: Any) -> Callable[[_Function], _Function]:
    """Compile a function as `numba.njit` does with these options, of the same type as it is."""
    compile_: Any = numba.njit  # pyright: ignore[reportUnknownMemberType]
    return lambda function: sealed(compile_(**options)(function))
