"""A recording that was cut off in the middle of its bytes: what of it can still be read.

A copy that broke off lacks its end. HDF5 refuses such a file, although what it describes begins at
its start; with zeros in the place of what is missing it opens. Which frames are whole is known from
where their chunks lie.
"""

# h5py has no types.
# pyright: reportMissingTypeStubs=false, reportUnknownMemberType=false
from __future__ import annotations

import io
import struct
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

if TYPE_CHECKING:
    import h5py

END = slice(28, 36)
"""Bytes of the superblock that say where the file ends (HDF5 file format, version 3.0, II.A)."""


def missing(path: Path) -> int:
    """Bytes that a file lacks of what it says it has; 0 if it is whole, or no HDF5 file."""
    with path.open("rb") as raw:
        said = raw.read(END.stop)[END]
    if len(said) < END.stop - END.start:
        return 0
    return max(struct.unpack("<Q", said)[0] - path.stat().st_size, 0)


class Padded(io.RawIOBase):
    """A file that goes on with zeros for `more` bytes after its end; to read only."""

    def __init__(self, path: Path, more: int):
        self._raw = path.open("rb")
        self._size = path.stat().st_size + more
        self._at = 0

    def readable(self) -> bool:
        """See `io.IOBase`."""
        return True

    def seekable(self) -> bool:
        """See `io.IOBase`."""
        return True

    def seek(self, offset: int, whence: int = io.SEEK_SET) -> int:
        """See `io.IOBase`."""
        begin = {io.SEEK_SET: 0, io.SEEK_CUR: self._at, io.SEEK_END: self._size}[whence]
        self._at = begin + offset
        return self._at

    def tell(self) -> int:
        """See `io.IOBase`."""
        return self._at

    def readinto(self, buffer: Any) -> int:
        """See `io.RawIOBase`."""
        wanted = max(min(len(buffer), self._size - self._at), 0)
        self._raw.seek(self._at)
        there = self._raw.read(wanted)
        buffer[:wanted] = there.ljust(wanted, b"\0")
        self._at += wanted
        return wanted

    def close(self) -> None:
        """See `io.IOBase`."""
        self._raw.close()
        super().close()


def whole_frames(arrays: Mapping[str, h5py.Dataset], size: int) -> int:
    """Count frames of which every part lies within the first `size` bytes of a file.

    Frames are written one after the other, so the first that is not whole is looked for by halves.
    """
    low, high = 0, min(len(array) for array in arrays.values())
    while low < high:
        middle = (low + high) // 2
        if all(_lies_within(array, middle, size) for array in arrays.values()):
            low = middle + 1
        else:
            high = middle
    return low


def _lies_within(array: h5py.Dataset, index: int, size: int) -> bool:
    """Whether the chunk of a frame is there."""
    try:
        first = (index, *[0] * (array.ndim - 1))
        chunk = cast(Any, array.id).get_chunk_info_by_coord(first)
    except (OSError, RuntimeError, ValueError):  # what says where it lies is itself cut off
        return False
    return chunk.byte_offset is not None and bool(chunk.byte_offset + chunk.size <= size)
