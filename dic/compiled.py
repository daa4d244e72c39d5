"""Numba's `njit` with its types kept, so that what calls a compiled loop is checked."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Literal, ParamSpec, TypeVar, cast

import numba

from dic.kernel_file import sealed

P = ParamSpec("P")
R = TypeVar("R")


def njit(
    *,
    cache: bool,
    nogil: bool,
    fastmath: bool = False,
    error_model: Literal["python", "numpy"] = "python",
    inline: Literal["never", "always"] = "never",
) -> Callable[[Callable[P, R]], Callable[P, R]]:
    """Compile a function as `numba.njit` does; it is called as it was written."""
    options = {"cache": cache, "nogil": nogil, "fastmath": fastmath}
    library = cast("Any", numba)
    compile_ = library.njit(error_model=error_model, inline=inline, **options)
    return lambda function: sealed(compile_(function))
