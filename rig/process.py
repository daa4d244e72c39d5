"""Ctrl-C and the processes beside the loop: they are born deaf to it, the loop answers."""

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

AGAIN = 0.5  # s after which an interrupt that was lost comes again
REPEATS = hasattr(signal, "setitimer")  # not on Windows
SIGNALS = (signal.SIGINT, signal.SIGALRM) if REPEATS else (signal.SIGINT,)


@contextmanager
def deaf_to_interrupts() -> Iterator[None]:
    """Let a process that starts here ignore Ctrl-C from its first instruction on.

    A new process that still imports would die of it with a traceback.
    """
    if threading.current_thread() is not threading.main_thread():  # signals are the main thread's
        yield
        return
    before = _answer(signal.SIG_IGN)
    try:
        yield
    finally:
        _restore(before)


@contextmanager
def interruptible() -> Iterator[None]:
    """Let Ctrl-C end what runs here as KeyboardInterrupt and nothing else.

    Where it comes while compiled code is called, that code makes a SystemError of it; where it
    comes in a callback of such code, it is lost: so it comes again until the block has ended. What
    must not be broken off, the closing of what is open for instance, stands outside of the block.
    """
    asked = False

    def interrupt(signum: int, frame: object) -> None:
        nonlocal asked
        asked = True
        _wake(AGAIN)
        raise KeyboardInterrupt

    before = _answer(interrupt)
    try:
        yield
    except SystemError:
        if asked:
            raise KeyboardInterrupt from None
        raise
    finally:
        _wake(0.0)
        _restore(before)


def _answer(handler: Any) -> list[Any]:
    """Let a handler answer Ctrl-C and its repetition; gives those that did before."""
    return [signal.signal(one, handler) for one in SIGNALS]


def _restore(before: list[Any]) -> None:
    for one, handler in zip(SIGNALS, before, strict=True):
        signal.signal(one, handler)


def _wake(seconds: float) -> None:
    """Ask for SIGALRM after a time, for none after 0 s."""
    if REPEATS:
        signal.setitimer(signal.ITIMER_REAL, seconds)
