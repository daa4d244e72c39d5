"""What is slow to compute is kept on disk, found again by its content.

An entry is one uncompressed ``.npz`` file with its own SHA-256 behind it, which is checked before
anything of it is read; one that is damaged is computed again. Its name is the SHA-256 of everything
the result depends on. It is written aside and renamed, so that two processes at work on one entry,
or a killed one, leave a whole file.
"""

import hashlib
import io
import os
import tempfile
import warnings
from collections.abc import Callable, Mapping
from dataclasses import fields, is_dataclass
from pathlib import Path
from types import ModuleType
from typing import Any, cast

import numpy as np

from rig.system.arrays import AnyArray

FORMAT = 2
"""Version of the files' format; part of every key."""

SEAL = hashlib.sha256().digest_size
"""Bytes of the checksum at the end of a file."""

Arrays = dict[str, np.ndarray]


class CacheError(OSError):
    """A cache that cannot be read or written; its text is one sentence with the remedy."""


class CacheWarning(UserWarning):
    """A cache that had to be put right."""


def folder() -> Path:
    """Return the folder of the cache: TOUCHPLATE_CACHE, or the usual place of the system."""
    import platformdirs

    return Path(os.environ.get("TOUCHPLATE_CACHE") or platformdirs.user_cache_dir("touchplate"))


def fetch(kind: str, parts: Any, compute: Callable[[], Arrays]) -> Arrays:
    """Return arrays from the cache, computed and stored where they are not there or damaged.

    Parameters
    ----------
    kind
        What is stored ("influence"): the name of its folder in the cache.
    parts
        Everything the result depends on: numbers, texts, None, arrays, modules, and mappings,
        sequences and frozen dataclasses of them. A module stands for its source and that of the
        package it is, so that a result does not outlive the code that made it.
    compute
        Called without arguments where nothing is stored; returns arrays by name.

    Raises
    ------
    CacheError
        If the stored file may not be read, or the folder cannot be written. The folder is tried
        before `compute` is called.
    TypeError
        If a part is of a type that has no content to be found by.

    Warns
    -----
    CacheWarning
        If the stored file is damaged and so computed again.
    """
    path = folder() / kind / f"{key(kind, parts)}.npz"
    if path.exists():
        stored = _read(path)
        if stored is not None:
            return stored
        warnings.warn(
            CacheWarning(f"cache file {path} was damaged and is computed again"), stacklevel=2
        )
    _prepare(path.parent)
    arrays = compute()
    _write(path, arrays)
    return arrays


def key(kind: str, parts: Any) -> str:
    """Return the hexadecimal SHA-256 under which a result is stored."""
    digest = hashlib.sha256()
    _feed(digest.update, (FORMAT, kind, parts))
    return digest.hexdigest()


def _feed(update: Callable[[bytes], None], part: Any) -> None:
    """Hash a part with its type and length before it, so that no two parts read the same."""
    match part:
        case None | bool() | int() | float() | str():
            text = repr(part).encode()
            update(f"{type(part).__name__}:{len(text)}:".encode() + text)
        case np.generic():
            _feed(update, part.item())
        case np.ndarray():
            array = cast(AnyArray, part)
            update(f"array:{array.dtype.str}:{array.shape}:".encode())
            update(np.ascontiguousarray(array).tobytes())
        case ModuleType():
            _feed(update, _source(part))
        case Mapping():
            _feed(update, sorted(cast(Mapping[str, Any], part).items()))
        case tuple() | list():
            items = cast(tuple[Any, ...] | list[Any], part)
            update(f"sequence:{len(items)}:".encode())
            for item in items:
                _feed(update, item)
        case _ if is_dataclass(part):
            named = [(field.name, getattr(part, field.name)) for field in fields(part)]
            _feed(update, (type(part).__qualname__, named))
        case _:
            raise TypeError(f"a {type(part).__name__} cannot be part of a cache key")


def _source(module: ModuleType) -> list[tuple[str, str]]:
    home = Path(str(module.__file__))
    files = sorted(home.parent.rglob("*.py")) if home.name == "__init__.py" else [home]
    return [(path.name, path.read_text(encoding="utf-8")) for path in files]


def _read(path: Path) -> Arrays | None:
    """Arrays of a file; None where it is not as it was written."""
    try:
        sealed = path.read_bytes()
    except OSError as error:
        raise CacheError(
            f"cache file {path} cannot be read ({_reason(error)}); check its permissions and disk"
        ) from error
    content = memoryview(sealed)[:-SEAL]
    if hashlib.sha256(content).digest() != sealed[-SEAL:]:
        return None
    with np.load(io.BytesIO(content), allow_pickle=False) as stored:
        return {name: stored[name] for name in stored.files}


def _prepare(home: Path) -> None:
    try:
        home.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=home):
            pass
    except OSError as error:
        raise _unwritable(home, error) from error


def _write(path: Path, arrays: Arrays) -> None:
    aside = path.with_name(f"{path.stem}.{os.getpid()}.partial")
    try:
        with aside.open("w+b") as file:
            np.savez(file, allow_pickle=False, **arrays)
            file.seek(0)
            file.write(hashlib.file_digest(file, "sha256").digest())
        aside.replace(path)
    except OSError as error:
        raise _unwritable(path.parent, error) from error
    finally:
        aside.unlink(missing_ok=True)


def _unwritable(home: Path, error: OSError) -> CacheError:
    return CacheError(
        f"cache folder {home} cannot be written ({_reason(error)}); free space there or set"
        " TOUCHPLATE_CACHE to another folder"
    )


def _reason(error: OSError) -> str:
    return error.strerror or " ".join(str(error).split()) or "unreadable"
