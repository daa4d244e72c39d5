"""What tells the content of one file from another's, wherever they lie and whatever their names."""

from __future__ import annotations

import hashlib
from pathlib import Path

_BLOCKS, _BLOCK = 16, 4096  # how many of how many bytes, spread over a file


def digest_of(path: Path) -> str:
    """SHA-256 of the size of a file and of blocks from its first byte to its last.

    Frames of one camera differ everywhere by noise, and compressed ones from the first change on:
    blocks tell them apart in the time that a small file takes. Empty where it cannot be read, which
    who reads it will say.
    """
    digest = hashlib.sha256()
    try:
        size = path.stat().st_size
        digest.update(str(size).encode())
        with path.open("rb") as file:
            for number in range(_BLOCKS):
                file.seek(max(size - _BLOCK, 0) * number // (_BLOCKS - 1))
                digest.update(file.read(_BLOCK))
    except OSError:
        return ""
    return digest.hexdigest()
