"""Data sets on disk, read as they are needed; a file that is not whole is refused."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from zlib import crc32

import numpy as np

from models.arrays import F32, F64
from models.data.flat_file import ArrayPlace, locate

FORMAT = "touchplate data set"
VERSION = 1
ARRAYS = ("strain", "touches", "gauges", "sums", "done")
_HEAD = ("format", "version", "block", "about")


@dataclass(frozen=True, eq=False)
class Samples:
    """A data set on disk; rows are read from the file when they are asked for.

    Attributes
    ----------
    strain : (N, M, 3) float32, strain, read only
        exx, eyy, exy of M gauges, without noise.
    touches : (N, k, 3) float64, read only
        x, y in mm and force in N of k touches.
    gauges : (M, 2) float64, mm, read only
    about : dict
        What names the bench and the plan, as it was given to `begin_dataset`.
    """

    strain: F32
    touches: F64
    gauges: F64
    about: dict[str, Any]

    def __len__(self) -> int:
        return len(self.touches)

    def batches(self, size: int, rng: np.random.Generator) -> Iterator[tuple[F32, F64]]:
        """Go through all rows once in random order, `size` at a time, the last batch shorter.

        Yields
        ------
        strain : (size, M, 3) float32
        touches : (size, k, 3) float64
        """
        order = rng.permutation(len(self))
        for first in range(0, len(order), size):
            # Sorted, so that the file is read from front to back.
            rows = np.sort(order[first : first + size])
            yield self.strain[rows], self.touches[rows]


def read_dataset(path: str | Path) -> Samples:
    """Open a data set that is finished, and check every byte of it.

    Raises
    ------
    FileNotFoundError
        When there is no such file.
    ValueError
        When the file is not finished, damaged, of another version or something else.
    """
    path = Path(path)
    head, places = open_dataset(path)
    done, rows = int(places["done"].map(path)[0]), places["touches"].shape[0]
    if done != rows:
        raise ValueError(
            f"data set {path} holds {done} of {rows} samples; run the command that began it "
            "again, and it goes on from there"
        )
    strain, touches, gauges, sums = (places[name].map(path) for name in ARRAYS[:4])
    size = int(head["block"])
    for block, expected in enumerate(sums):
        here = slice(size * block, size * (block + 1))
        if checksum(touches[here], strain[here]) != expected:
            raise ValueError(f"data set {path} is damaged; delete it and write it again")
    return Samples(strain, touches, gauges, json.loads(head["about"]))


def checksum(touches: F64, strain: F32) -> int:
    """Return the CRC-32 of a block."""
    return crc32(np.ascontiguousarray(strain).data, crc32(np.ascontiguousarray(touches).data))


def open_dataset(path: Path) -> tuple[dict[str, Any], dict[str, ArrayPlace]]:
    """Return attributes and places of a data set, finished or not.

    Raises
    ------
    FileNotFoundError
        When there is no such file.
    ValueError
        When the file is damaged, of another version or something else.
    """
    if not path.is_file():
        raise FileNotFoundError(f"data set {path} does not exist; write it first")
    try:
        head, places = locate(path)
    except PermissionError as error:
        raise PermissionError(f"data set {path} cannot be read; check its permissions") from error
    except (OSError, RuntimeError, KeyError, ValueError) as error:
        raise ValueError(f"data set {path} is damaged or no HDF5 file; write it again") from error
    if head.get("format") != FORMAT or not {*_HEAD} <= {*head} or not {*ARRAYS} <= {*places}:
        raise ValueError(f"data set {path} holds something else; give one written as a data set")
    if head["version"] != VERSION:
        raise ValueError(
            f"data set {path} has version {head['version']}, this release reads {VERSION}; write "
            "it again"
        )
    return head, places
