"""Which parts of an X desktop are lit now: SDL learns of an output that goes, not of one put out.

Source: K. Packard, "The X Resize, Rotate and Reflect Extension", version 1.6, 2017 (RRGetMonitors).
"""

from __future__ import annotations

import ctypes
from typing import Any

INTEGERS = ("x", "y", "width", "height", "mm_width", "mm_height")


class _Monitor(ctypes.Structure):
    """XRRMonitorInfo of Xrandr.h."""

    _fields_ = (
        ("name", ctypes.c_ulong),
        ("primary", ctypes.c_int),
        ("automatic", ctypes.c_int),
        ("outputs_count", ctypes.c_int),
        *((name, ctypes.c_int) for name in INTEGERS),
        ("outputs", ctypes.c_void_p),
    )


class XMonitors:
    """A link to the X server of the session, which lasts as long as the process.

    Raises
    ------
    OSError
        If there is no X server, or its libraries are missing or older than RRGetMonitors.
    """

    def __init__(self):
        self._x = _with_types(ctypes.CDLL("libX11.so.6"), _X11)
        try:
            self._randr = _with_types(ctypes.CDLL("libXrandr.so.2"), _RANDR)
        except AttributeError as error:
            raise OSError(f"libXrandr is too old: {error}") from None
        self._display = self._x.XOpenDisplay(None)
        if not self._display:
            raise OSError("no X server answers")
        self._root = self._x.XDefaultRootWindow(self._display)

    def lit(self) -> dict[tuple[int, int, int, int], int]:
        """Return what shows each part of the desktop (x, y, width, height), an atom."""
        count = ctypes.c_int()
        found = self._randr.XRRGetMonitors(self._display, self._root, 1, ctypes.byref(count))
        if not found:
            return {}
        try:
            shown = [found[index] for index in range(count.value)]
            return {(one.x, one.y, one.width, one.height): int(one.name) for one in shown}
        finally:
            self._randr.XRRFreeMonitors(found)


_X11 = {
    "XOpenDisplay": (ctypes.c_void_p, [ctypes.c_char_p]),
    "XDefaultRootWindow": (ctypes.c_ulong, [ctypes.c_void_p]),
}
_RANDR = {
    "XRRGetMonitors": (
        ctypes.POINTER(_Monitor),
        [ctypes.c_void_p, ctypes.c_ulong, ctypes.c_int, ctypes.POINTER(ctypes.c_int)],
    ),
    "XRRFreeMonitors": (None, [ctypes.POINTER(_Monitor)]),
}
"""What each function returns and takes."""


def _with_types(library: Any, functions: dict[str, tuple[Any, list[Any]]]) -> Any:
    for name, (returned, taken) in functions.items():
        function = getattr(library, name)
        function.restype, function.argtypes = returned, taken
    return library
