"""Files of nets that are plain arrays: options as JSON and a checksum beside them, in one npz."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from models.arrays import AnyArray
from models.nets.checkpoint import DAMAGE, fingerprint

_LARGEST = 1e3  # of a weight; NaN is not below it either


@dataclass(frozen=True)
class NetKind:
    """Which net a file holds.

    Attributes
    ----------
    format : str
    version : int
    remedy : str
        What to do where its file cannot be read.
    """

    format: str
    version: int
    remedy: str


def save_arrays(
    path: str | Path, kind: NetKind, arrays: Mapping[str, AnyArray], options: Mapping[str, Any]
) -> None:
    """Write arrays and options aside and rename the file.

    Raises
    ------
    OSError
        The file cannot be written.
    """
    path = Path(path)
    named = {"format": kind.format, "version": kind.version}
    text = json.dumps(named | dict(options), sort_keys=True)
    aside = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with aside.open("wb") as file:
            np.savez_compressed(
                file,
                allow_pickle=False,
                options=np.array(text),
                checksum=np.array(_sum(arrays, text)),
                **arrays,
            )
        aside.replace(path)
    except OSError as error:
        raise OSError(
            f"net file {path} cannot be written ({error.strerror or error}); free space there or "
            "choose another place"
        ) from error
    finally:
        aside.unlink(missing_ok=True)


def net_format(path: str | Path) -> str:
    """Return which net a file says that it holds, as `NetKind.format` has it.

    Raises
    ------
    FileNotFoundError
        There is no such file.
    ValueError
        It is damaged or no file of a net.
    """
    return _read(Path(path), "net", "train one by 'touchplate train'").format


def load_arrays(
    path: str | Path, kind: NetKind, shapes: Mapping[str, tuple[int, ...]]
) -> tuple[dict[str, AnyArray], dict[str, Any]]:
    """Read what `save_arrays` wrote: float32 arrays of these shapes, and the options.

    Raises
    ------
    FileNotFoundError
        There is no such file.
    ValueError
        It is damaged, of another version or something else.
    """
    path = Path(path)
    found = _read(path, kind.format.removeprefix("touchplate "), kind.remedy)
    if found.format != kind.format or found.options.get("version") != kind.version:
        raise ValueError(
            f"net file {path} is a '{found.format}' of version {found.options.get('version')}, this"
            f" release reads a '{kind.format}' of version {kind.version}; {kind.remedy}"
        )
    if found.checksum != _sum(found.arrays, found.text) or not _sound(found.arrays, shapes):
        raise ValueError(f"net file {path} is damaged; {kind.remedy}")
    return found.arrays, found.options


@dataclass(frozen=True, eq=False)
class _Stored:
    """What stands in a file, before it is checked."""

    arrays: dict[str, AnyArray]
    text: str
    checksum: str
    options: dict[str, Any]

    @property
    def format(self) -> str:
        return str(self.options.get("format"))


def _read(path: Path, what: str, remedy: str) -> _Stored:
    """Read a file of which the options can be read; nothing else of it is checked."""
    if not path.is_file():
        raise FileNotFoundError(f"net file {path} does not exist; {remedy}")
    try:
        with np.load(path, allow_pickle=False) as file:
            arrays = {name: np.asarray(file[name]) for name in file.files}
        text, checksum = str(arrays.pop("options")), str(arrays.pop("checksum"))
        return _Stored(arrays, text, checksum, dict(json.loads(text)))
    except DAMAGE as error:
        raise ValueError(f"net file {path} is damaged or no {what}; {remedy}") from error


def _sound(arrays: Mapping[str, AnyArray], shapes: Mapping[str, tuple[int, ...]]) -> bool:
    return arrays.keys() == shapes.keys() and all(
        arrays[name].shape == shape
        and arrays[name].dtype == np.float32
        and bool((np.abs(arrays[name]) < _LARGEST).all())
        for name, shape in shapes.items()
    )


def _sum(arrays: Mapping[str, AnyArray], text: str) -> str:
    return fingerprint(text, *(part for name in sorted(arrays) for part in (name, arrays[name])))
