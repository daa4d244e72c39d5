"""Says when kernels are compiled: the first time after an install, and for a minute or more."""

# Numba has no types.
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false
# pyright: reportUntypedBaseClass=false
from __future__ import annotations

from collections.abc import Generator
from contextlib import contextmanager

from numba.core import event

from rig.commands.output import say


class _Announcement(event.Listener):
    """Speaks up at the first kernel that is in no cache."""

    def __init__(self) -> None:
        self._said = False

    def on_start(self, event: object) -> None:
        if not self._said:
            self._said = True
            say("kernels are compiled for this machine, once: that takes a minute or more")

    def on_end(self, event: object) -> None: ...


@contextmanager
def compiling_announced() -> Generator[None]:
    """Say so once if a kernel is compiled in the block."""
    with event.install_listener("numba:compile", _Announcement()):
        yield
