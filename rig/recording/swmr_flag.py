"""The mark that HDF5 puts on a file while it writes: taken off, any program opens the file.

A writer that is killed leaves its mark behind, and other programs refuse the file until `h5clear`
was run on it. In SWMR mode what was flushed is in order at any time, so nothing is lost by taking
the mark off after each flush; HDF5 puts it on again whenever it writes its superblock. The bytes
are those of a superblock of version 3 (HDF5 file format specification, version 3.0, II.A).
"""

from __future__ import annotations

import struct

SUPERBLOCK = 48  # bytes at the start of the file, the last four of them a checksum
MARK = 11  # the byte of the mark
START = 0xDEADBEEF
FULL = 0xFFFFFFFF
MIX = ((0, 2, 4), (1, 0, 6), (2, 1, 8), (0, 2, 16), (1, 0, 19), (2, 1, 4))
END = ((2, 1, 14), (0, 2, 11), (1, 0, 25), (2, 1, 16), (0, 2, 4), (1, 0, 14), (2, 1, 24))


def unmarked(superblock: bytes) -> bytes:
    """Return a superblock without the mark of a writer."""
    rest = superblock[:MARK] + b"\0" + superblock[MARK + 1 : -4]
    return rest + struct.pack("<I", _checksum(rest))


def _checksum(data: bytes) -> int:
    """Sum up bytes as HDF5 does: lookup3 (B. Jenkins, "Hash functions for hash tables", 2006)."""
    state = [(START + len(data)) & FULL] * 3
    blocks = [data[at : at + 12].ljust(12, b"\0") for at in range(0, len(data), 12)]
    for block in blocks[:-1]:
        _add(state, block)
        for to, of, turn in MIX:
            state[to] = (state[to] - state[of]) & FULL ^ _turned(state[of], turn)
            state[of] = (state[of] + state[3 - to - of]) & FULL
    _add(state, blocks[-1])
    for to, of, turn in END:
        state[to] = ((state[to] ^ state[of]) - _turned(state[of], turn)) & FULL
    return state[2]


def _add(state: list[int], block: bytes) -> None:
    for index, word in enumerate(struct.unpack("<III", block)):
        state[index] = (state[index] + word) & FULL


def _turned(word: int, by: int) -> int:
    """Rotate 32 bits to the left."""
    return (word << by | word >> 32 - by) & FULL
