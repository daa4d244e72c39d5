"""Numba's files of compiled code, each with its checksum: one that is damaged is compiled again.

Numba unpickles whatever it finds, so that a file cut off by a full disk ends every start in a
traceback, and a changed byte in machine code may end in worse. The same file lies in each package
that compiles, since these do not know each other.
"""

# Numba has no types.
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false
from __future__ import annotations

import hashlib
import io
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from numba.core import caching

SEAL = hashlib.sha256().digest_size  # bytes behind those of Numba, which does not mind them
_Files: Any = caching.IndexDataCacheFile


class _KernelFile(_Files):
    """Index and code of one kernel on disk; what is not just as it was written counts as absent."""

    def _load_index(self) -> Any:
        if not _is_whole(self._index_path):
            return {}
        return super()._load_index()

    def _load_data(self, name: str) -> Any:
        if not _is_whole(self._data_path(name)):
            raise FileNotFoundError(f"kernel {name} is damaged")  # which Numba takes as absent
        return super()._load_data(name)

    @contextmanager
    def _open_for_write(self, filepath: str) -> Generator[io.BytesIO]:
        content = io.BytesIO()
        yield content
        with super()._open_for_write(filepath) as file:
            file.write(content.getvalue() + hashlib.sha256(content.getbuffer()).digest())


def sealed(dispatcher: Any) -> Any:
    """Let a compiled function keep its code in a `_KernelFile`, if it keeps it at all."""
    cache: Any = getattr(dispatcher, "_cache", None)
    if hasattr(cache, "_cache_file"):
        cache._cache_file.__class__ = _KernelFile
    return dispatcher


def _is_whole(path: str) -> bool:
    try:
        content = Path(path).read_bytes()
    except OSError:
        return False
    return hashlib.sha256(content[:-SEAL]).digest() == content[-SEAL:]
