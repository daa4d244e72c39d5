"""Where a recording may lie, a new file in a folder that is there; and those that lie there."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

SUFFIX = ".h5"
FOLDER = "recordings"  # where `touchplate record` writes to
_NAME = re.compile(r"\w[\w .+-]{0,99}", re.ASCII)


def named(folder: Path, name: str) -> Path:
    """Return the file of a name that someone else gave, inside `folder`.

    Raises
    ------
    ValueError
        If the name could lead out of the folder or holds what a file system may not like.
    """
    if not _NAME.fullmatch(name) or ".." in name:
        raise ValueError(
            f"recording cannot be called {name!r}; use up to 100 letters, digits, spaces and"
            " . + - _ without folders"
        )
    return folder / (name if name.endswith(SUFFIX) else name + SUFFIX)


def recordings(folder: Path) -> tuple[str, ...]:
    """Names of the recordings in a folder, the newest first."""
    return tuple(name for _, name in sorted(_dated(folder), reverse=True))


def recordings_at(folder: Path) -> tuple[str, ...]:
    """Names of the recordings in a folder and in its `FOLDER`, the newest first."""
    below = ((date, f"{FOLDER}/{name}") for date, name in _dated(folder / FOLDER))
    return tuple(name for _, name in sorted([*_dated(folder), *below], reverse=True))


def _dated(folder: Path) -> Iterator[tuple[float, str]]:
    """Yield when each recording was written, and its name."""
    for path in folder.glob(f"*{SUFFIX}"):
        with suppress(OSError):  # it may go while we look, or be a link to nothing
            yield path.stat().st_mtime, path.name


def require_new(path: Path) -> Path:
    """Return the path of a recording that may be written.

    Raises
    ------
    OSError
        If there is such a file already, or no such folder.
    ValueError
        If its name does not end in .h5.
    """
    if path.suffix != SUFFIX:
        raise ValueError(f"recording must be a file *{SUFFIX}, got '{path}'; name it so")
    require_absent(path, "recording")
    if not path.parent.is_dir():
        raise OSError(f"folder '{path.parent}' of the recording does not exist; make it first")
    return path


def require_absent(path: Path, what: str) -> None:
    """Refuse to write over a file, which is called `what`.

    Raises
    ------
    OSError
        If there is such a file already.
    """
    if path.exists():
        raise OSError(f"{what} '{path}' is there already; choose another name")
