"""Entries of the cache and compiled kernels, changed."""

from __future__ import annotations

import importlib
import os
import warnings
from collections.abc import Generator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from rig.studies.files.kind import Kind, Wrong
from rig.studies.files.mutation import mutate_bytes
from rig.system import cache
from rig.system.arrays import AnyArray


def computed() -> cache.Arrays:
    """Return what a plate leaves in the cache, made small."""
    rng = np.random.default_rng(1)
    return {"a": rng.normal(size=(20, 30)), "b": np.arange(7), "c": np.array(3.0)}


@contextmanager
def cache_in(folder: Path) -> Generator[None]:
    """Let the cache lie in a folder."""
    before = os.environ.get("TOUCHPLATE_CACHE")
    os.environ["TOUCHPLATE_CACHE"] = str(folder)
    try:
        yield
    finally:
        os.environ.pop("TOUCHPLATE_CACHE")
        if before is not None:
            os.environ["TOUCHPLATE_CACHE"] = before


def make_cache(path: Path) -> None:
    """Write an entry of the cache, and put it where it is wanted."""
    with cache_in(path.parent / "cache"):
        path.unlink(missing_ok=True)
        cache.fetch("study", 1, computed)
    entry(path).replace(path)


def entry(path: Path) -> Path:
    """Where the cache looks for the entry."""
    return path.parent / "cache" / "study" / f"{cache.key('study', 1)}.npz"


def read_cache(path: Path) -> Wrong:
    """Ask the cache for what the file held."""
    entry(path).write_bytes(path.read_bytes())
    with cache_in(path.parent / "cache"), warnings.catch_warnings():
        warnings.simplefilter("ignore", cache.CacheWarning)
        yield from _same_arrays(cache.fetch("study", 1, computed))
        yield from _same_arrays(cache.fetch("study", 1, dict))  # it has healed


def _same_arrays(found: Mapping[str, AnyArray]) -> Wrong:
    for name, array in computed().items():
        if name not in found or not np.array_equal(found[name], array):
            yield f"{name} is other than it was computed"


def double(x: int) -> int:
    """Give something to compile."""
    return 2 * x


def compiled(path: Path) -> tuple[int, list[Path]]:
    """Run a kernel as a new process would, with its code in the folder of `path`."""
    config: Any = importlib.import_module("numba").config
    with cache_in(path.parent):  # which leaves the environment as it was
        os.environ["NUMBA_CACHE_DIR"] = str(path.parent / "kernels")
        config.reload_config()
        try:
            njit = importlib.import_module("dic.compiled").njit
            result = njit(cache=True, nogil=True)(double)(21)
        finally:
            os.environ.pop("NUMBA_CACHE_DIR")
            config.reload_config()
    return result, sorted((path.parent / "kernels").rglob("*.nb?"))


def make_kernel(path: Path) -> None:
    """Compile, and put the code where it is wanted."""
    _, files = compiled(path)
    path.write_bytes(files[0].read_bytes())


def read_kernel(path: Path) -> Wrong:
    """Run the kernel with changed code."""
    _, files = compiled(path)
    files[0].write_bytes(path.read_bytes())
    for _ in range(2):
        if compiled(path)[0] != 42:
            yield "the kernel gives another number"


CACHE = Kind(".npz", make_cache, mutate_bytes, read_cache)
KERNEL = Kind(".nbc", make_kernel, mutate_bytes, read_kernel)
