"""What a user types in the terminal while a run goes on: a line is a wish."""

from __future__ import annotations

import sys
import threading
from collections import deque
from collections.abc import Callable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rig.live.live_loop import LiveLoop
    from rig.live.snapshot import Snapshot


def typed(loop: LiveLoop, warn: Callable[[str], object]) -> Callable[[Snapshot], object] | None:
    """Read lines beside a loop; what is returned does what they ask, after a frame.

    Parameters
    ----------
    loop : LiveLoop
    warn : callable
        Takes the sentence that says why a line is no wish.

    Returns
    -------
    callable or None
        None where nobody can type, or nothing is learned.
    """
    if loop.learned is None or not sys.stdin or not sys.stdin.isatty():
        return None
    lines: deque[str] = deque(maxlen=8)
    threading.Thread(target=_read, args=(lines,), name="typed", daemon=True).start()

    def take(snapshot: Snapshot) -> None:
        while lines:
            if refused := obey(lines.popleft(), loop):
                warn(refused)

    return take


def obey(line: str, loop: LiveLoop) -> str:
    """Do what a line asks: ``w 2`` awaits a known weight of 2 N, ``t`` renews the reference.

    Returns
    -------
    str
        Why it is no wish, as a sentence; empty where it is one.
    """
    match line.split():
        case []:
            return ""
        case ["t"]:
            loop.tare()
            return ""
        case ["w", force]:
            try:
                loop.weigh(float(force))
            except ValueError as error:
                return str(error)
            return ""
        case _:
            return f"'{line.strip()}' is no wish; type 'w 2' for a known weight of 2 N, or 't'"


def _read(lines: deque[str]) -> None:
    for line in sys.stdin:
        lines.append(line)
