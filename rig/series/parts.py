"""The fields of single frames, kept until all are there: a test that was killed goes on."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from zipfile import is_zipfile

import numpy as np

from dic import export
from rig.system.arrays import AnyArray

FIELDS = (
    "u", "v", "sigma_u", "sigma_v", "zncc", "exx", "eyy", "exy", "sigma_exx", "sigma_eyy",
    "sigma_exy",
)  # fmt: skip
"""What is always kept of a point, float32, beside its status."""

NO_FRAME = -1
"""Status of every point of a frame that could not be read or compared."""

Part = tuple[dict[str, AnyArray], str]
"""Fields (N,) of a frame by their names, and why there are none."""


def open_parts(folder: Path, settings: Mapping[str, object]) -> Path:
    """Return the folder of the parts of a test, begun or to be gone on with.

    Raises
    ------
    OSError
        It holds parts of another test.
    """
    folder.mkdir(parents=True, exist_ok=True)
    known, text = folder / "settings.json", json.dumps(settings, sort_keys=True)
    if not known.exists():
        with export.aside(known) as draft:
            draft.write_text(text, encoding="utf-8")
    elif known.read_text(encoding="utf-8") != text:
        raise OSError(
            f"folder '{folder.parent}' holds a part of a test with other settings, or with frames"
            " of other names or content; name another with --out, or pass --force to begin anew"
        )
    return folder


def path_of(folder: Path, number: int) -> Path:
    """Where the part of a frame lies."""
    return folder / f"{number:06d}.npz"


def is_whole(folder: Path, number: int) -> bool:
    """Whether the part of a frame is there, and its file not cut short."""
    path = path_of(folder, number)
    return path.exists() and is_zipfile(path)


def write_part(folder: Path, number: int, table: Mapping[str, AnyArray], error: str) -> None:
    """Keep the fields (N,) of one frame and their `status`, whole or not at all."""
    small = {n: np.asarray(table[n], dtype=np.float32) for n in table if n != "status"}
    status = np.asarray(table["status"], dtype=np.int8)
    with export.aside(path_of(folder, number)) as draft, draft.open("wb") as file:
        np.savez(file, allow_pickle=False, status=status, error=np.array(error), **small)


def missing_part(fields: Sequence[str], points: int) -> dict[str, AnyArray]:
    """Fields of a frame that gave none."""
    table: dict[str, AnyArray] = {name: np.full(points, np.nan, np.float32) for name in fields}
    return table | {"status": np.full(points, NO_FRAME, np.int8)}


def read_part(folder: Path, number: int) -> Part | None:
    """Read the part of a frame and its error; None where there is none, or half of one."""
    path = path_of(folder, number)
    if not path.exists():
        return None
    try:
        with np.load(path, allow_pickle=False) as file:
            return {name: file[name] for name in file if name != "error"}, str(file["error"])
    except (OSError, ValueError, KeyError, EOFError):
        path.unlink()
        return None
