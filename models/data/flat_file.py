"""HDF5 files whose arrays lie flat at fixed places, so that their rows can be written in place.

HDF5 lays the file out and closes it; rows then go to their places without HDF5. So a killed writer
never leaves a file that HDF5 cannot open, and the same rows make the same bytes.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np


@dataclass(frozen=True)
class ArrayPlace:
    """Where an array lies in its file.

    Attributes
    ----------
    offset : int
        Of its first byte.
    shape : tuple of int
    dtype : numpy.dtype
    """

    offset: int
    shape: tuple[int, ...]
    dtype: np.dtype

    def put(self, file: BinaryIO, row: int, rows: np.ndarray) -> None:
        """Write `rows` from row number `row` on, into a file opened as r+b."""
        file.seek(self.offset + row * self.dtype.itemsize * int(np.prod(self.shape[1:])))
        file.write(np.ascontiguousarray(rows, self.dtype).data)

    def map(self, path: Path) -> np.memmap:
        """Return the array, read only, its rows read from the file when they are asked for."""
        return np.memmap(path, self.dtype, "r", self.offset, self.shape)


def lay_out(
    path: Path, head: Mapping[str, Any], shapes: Mapping[str, tuple[tuple[int, ...], str]]
) -> None:
    """Make a file with attributes and arrays of zeros, whole or not at all.

    Parameters
    ----------
    path
        Of the file; what is there is replaced.
    head
        Attributes: texts and numbers.
    shapes
        Shape and type of each array by name; none of them empty.

    Raises
    ------
    OSError
        When it cannot be written.
    """
    import h5py

    early = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
    early.set_alloc_time(h5py.h5d.ALLOC_TIME_EARLY)
    aside = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        # The latest format of HDF5 sums its own structure, so that damage there is seen.
        with h5py.File(aside, "w", libver="latest") as file:
            file.attrs.update(head)
            for name, (shape, dtype) in shapes.items():
                file.create_dataset(name, shape, dtype, dcpl=early)
        aside.replace(path)
    finally:
        aside.unlink(missing_ok=True)


def locate(path: Path) -> tuple[dict[str, Any], dict[str, ArrayPlace]]:
    """Return the attributes of a file and the places of its arrays.

    Raises
    ------
    OSError
        When it cannot be read, or is no HDF5 file.
    """
    import h5py

    with h5py.File(path, "r") as file:
        places = {
            name: ArrayPlace(offset, item.shape, item.dtype)
            for name, item in file.items()
            if isinstance(item, h5py.Dataset) and (offset := item.id.get_offset()) is not None
        }
        return dict(file.attrs), places
