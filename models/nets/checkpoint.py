"""What a training has reached, kept beside it so that a run that was killed goes on."""

from __future__ import annotations

import hashlib
import os
import zipfile
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import cast

import numpy as np

from models.arrays import AnyArray

DAMAGE = (
    OSError,
    ValueError,
    EOFError,
    KeyError,
    RuntimeError,
    TypeError,
    zipfile.BadZipFile,
    zlib.error,
)
"""What NumPy raises where an ``.npz`` is damaged: RuntimeError where its ways of packing are."""


@dataclass(frozen=True)
class Checkpoint:
    """A file that a training writes now and then.

    Attributes
    ----------
    path
        An uncompressed ``.npz``, written aside and renamed.
    every
        Epochs between two writes.

    Raises
    ------
    ValueError
        When `every` is below 1.
    """

    path: Path
    every: int = 1000

    def __post_init__(self) -> None:
        if self.every < 1:
            raise ValueError(f"epochs between checkpoints must be at least 1, got {self.every}")

    def save(self, arrays: Mapping[str, np.ndarray]) -> None:
        """Replace what the file holds.

        Raises
        ------
        OSError
            When it cannot be written.
        """
        aside = self.path.with_name(f".{self.path.name}.{os.getpid()}.part")
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            with aside.open("wb") as file:
                np.savez(file, allow_pickle=False, **arrays)
            aside.replace(self.path)
        except OSError as error:
            raise OSError(
                f"checkpoint {self.path} cannot be written ({error.strerror or error}); free space "
                "there and run again"
            ) from error
        finally:
            if aside.exists():
                aside.unlink()

    def load(self, task: str) -> dict[str, np.ndarray] | None:
        """Return what was saved for `task`; None where there is nothing, or another task's.

        Raises
        ------
        ValueError
            When the file is damaged.
        """
        if not self.path.is_file():
            return None
        try:
            with np.load(self.path, allow_pickle=False) as stored:
                arrays = {name: stored[name] for name in stored.files}
        except DAMAGE as error:
            raise ValueError(
                f"checkpoint {self.path} is damaged; delete it, and training begins anew"
            ) from error
        return arrays if str(arrays.get("task")) == task else None

    def clear(self) -> None:
        """Remove the file: the training has ended."""
        self.path.unlink(missing_ok=True)


def fingerprint(*parts: object) -> str:
    """Return the SHA-256 of arrays by their bytes and of all else by what they print as."""
    digest = hashlib.sha256()
    for part in parts:
        if isinstance(part, np.ndarray):
            array = cast(AnyArray, part)
            digest.update(f"{array.dtype.str} {array.shape}".encode())
            digest.update(np.ascontiguousarray(array).tobytes())
        else:
            digest.update(repr(part).encode())
    return digest.hexdigest()
