"""Open Sound Control 1.0 as far as TUIO needs it: bundles of messages of texts, integers, floats.

Source: M. Wright, "The Open Sound Control 1.0 Specification", 2002.
"""

import struct
from collections.abc import Iterable

HEAD = b"#bundle\0" + struct.pack(">Q", 1)  # time 1 stands for "at once"


def message(address: str, *values: str | int | float) -> bytes:
    """Encode one message."""
    tags = "".join({str: "s", int: "i", float: "f"}[type(value)] for value in values)
    return _text(address) + _text(f",{tags}") + b"".join(map(_value, values))


def bundle(messages: Iterable[bytes]) -> bytes:
    """Put messages together that belong to one moment."""
    return HEAD + b"".join(struct.pack(">i", len(one)) + one for one in messages)


def _value(value: str | int | float) -> bytes:
    match value:
        case str():
            return _text(value)
        case int():
            return struct.pack(">i", value)
        case _:
            return struct.pack(">f", value)


def _text(text: str) -> bytes:
    """Text with one to four zeros behind it, so that its length divides by four."""
    raw = text.encode("ascii")
    return raw + b"\0" * (4 - len(raw) % 4)
