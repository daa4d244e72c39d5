"""Chunks of HDF5 files, compressed before they are handed over: on any thread, and by runs.

What was measured holds few strings that come again: looking for them takes longer and saves
nothing.
"""

import zlib

import numpy as np

from rig.system.arrays import AnyArray


def deflate(data: bytes | memoryview) -> bytes:
    """Compress a chunk as HDF5's filter "gzip" reads it."""
    packer = zlib.compressobj(1, zlib.DEFLATED, zlib.MAX_WBITS, 9, zlib.Z_RLE)
    return packer.compress(data) + packer.flush()


def shuffle(values: AnyArray) -> bytes:
    """Put the first bytes of all numbers first, then the second, as HDF5's filter "shuffle"."""
    flat = np.ascontiguousarray(values).reshape(-1)
    return flat.view(np.uint8).reshape(-1, flat.itemsize).T.tobytes()
