"""How files are changed: as a disk, a cable or an editor would change them."""

from __future__ import annotations

import re
from collections.abc import Callable

import numpy as np

Rng = np.random.Generator
NUMBER = re.compile(r"(?<![\w.#-])-?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?(?![\w.])")
IMPOSSIBLE = ("nan", "inf", "-inf", "1e300", "-1e300", "1e-300", "NaN", "1e999", "0", "-1", "-5.0")
"""What is written in the place of a number; the last three can be right for some."""
OTHER = ("true", '"12 stones"', "[]", "[1.0]", "null", "{}", "99999999999999999999999")
"""What is no such number at all."""


def flip(content: bytes, rng: Rng) -> bytes:
    """Change one bit."""
    changed = bytearray(content)
    changed[rng.integers(len(content))] ^= 1 << int(rng.integers(8))
    return bytes(changed)


def cut_off(content: bytes, rng: Rng) -> bytes:
    """Leave the end out."""
    return content[: rng.integers(len(content))]


def take_out(content: bytes, rng: Rng) -> bytes:
    """Leave some bytes out."""
    start, end = _span(content, rng)
    return content[:start] + content[end:]


def repeat(content: bytes, rng: Rng) -> bytes:
    """Write some bytes twice."""
    start, end = _span(content, rng)
    return content[:end] + content[start:]


def blank(content: bytes, rng: Rng) -> bytes:
    """Make some bytes zero, as a block that never came to the disk."""
    start, end = _span(content, rng)
    return content[:start] + bytes(end - start) + content[end:]


def scramble(content: bytes, rng: Rng) -> bytes:
    """Put noise in the place of some bytes."""
    start, end = _span(content, rng)
    return content[:start] + rng.bytes(end - start) + content[end:]


BYTES: tuple[Callable[[bytes, Rng], bytes], ...] = (
    flip, flip, flip, cut_off, take_out, repeat, blank, scramble,
)  # fmt: skip


def mutate_bytes(content: bytes, rng: Rng) -> bytes:
    """Change a file without knowing what it is."""
    return BYTES[rng.integers(len(BYTES))](content, rng)


def mutate_number(text: str, rng: Rng) -> str:
    """Put something else in the place of one number of a text."""
    places = list(NUMBER.finditer(text))
    place = places[rng.integers(len(places))]
    words = IMPOSSIBLE if rng.random() < 0.8 else OTHER
    return text[: place.start()] + str(rng.choice(words)) + text[place.end() :]


def _span(content: bytes, rng: Rng) -> tuple[int, int]:
    """Draw some bytes, from one of them to a disk's block."""
    start = int(rng.integers(len(content)))
    return start, min(start + int(2 ** rng.uniform(0, 12)), len(content))


def mutate_text(content: bytes, rng: Rng) -> bytes:
    """Change a number of a text, or any of its bytes."""
    if rng.random() < 0.7:
        return mutate_number(content.decode(), rng).encode()
    return mutate_bytes(content, rng)
