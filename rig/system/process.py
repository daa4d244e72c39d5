"""Ctrl-C and the processes beside the loop: they are born deaf to it, the loop answers.

SIGTERM, by which a system ends what it has started, is answered alike.
"""

import signal
import sys
import threading
from collections.abc import Generator
from contextlib import contextmanager
from types import ModuleType
from typing import Any

AGAIN = 0.5  # s after which an interrupt that was lost comes again
REPEATS = hasattr(signal, "setitimer")  # not on Windows
BLOCKS = hasattr(signal, "pthread_sigmask")  # nor this
ENDS = (signal.SIGINT, signal.SIGTERM)
SIGNALS = (*ENDS, signal.SIGALRM) if REPEATS else ENDS


@contextmanager
def deaf_to_interrupts() -> Generator[None]:
    """Let a process that starts here be deaf to Ctrl-C from its first instruction on.

    A new process that still imports would die of it with a traceback. This one puts an answer off
    until the block has ended.
    """
    if threading.current_thread() is not threading.main_thread():  # signals are the main thread's
        yield
        return
    asked = False

    def note(signum: int, frame: object) -> None:
        nonlocal asked
        asked = True

    before = _answer(note if BLOCKS else signal.SIG_IGN)
    _block(True)  # what a new process inherits
    try:
        yield
    finally:
        _restore(before)
        _block(False)
        if asked:
            signal.raise_signal(signal.SIGINT)


def leave_signals_to_the_loop() -> None:
    """Ignore Ctrl-C and SIGTERM in a process beside the loop, which ends it by closing its link."""
    for one in ENDS:
        signal.signal(one, signal.SIG_IGN)


@contextmanager
def without_script() -> Generator[None]:
    """Let a process that is spawned here leave the user's script alone.

    It would run the script once more to find what it defines. What starts here is defined in this
    package, and a script of three lines has no ``if __name__ == "__main__"``.
    """
    script = sys.modules["__main__"]
    sys.modules["__main__"] = ModuleType("__main__")
    try:
        yield
    finally:
        sys.modules["__main__"] = script


@contextmanager
def interruptible() -> Generator[None]:
    """Let Ctrl-C or SIGTERM end what runs here as KeyboardInterrupt and nothing else.

    Where it comes while compiled code is called, that code makes a SystemError of it; where it
    comes in a callback of such code, it is lost: so it comes again until the block has ended. What
    must not be broken off, the closing of what is open for instance, stands outside of the block.
    An alarm that the user has set rings as ever unless Ctrl-C came.
    """
    if threading.current_thread() is not threading.main_thread():  # signals are the main thread's
        yield
        return
    asked = False
    before = {one: signal.getsignal(one) for one in ENDS}

    def interrupt(signum: int, frame: object) -> None:
        nonlocal asked
        if REPEATS and not asked:
            before[signal.SIGALRM] = signal.signal(signal.SIGALRM, interrupt)
        asked = True
        _wake(AGAIN)
        raise KeyboardInterrupt

    for one in ENDS:
        signal.signal(one, interrupt)
    try:
        yield
    except SystemError:
        if asked:
            raise KeyboardInterrupt from None
        raise
    finally:
        if asked:
            _wake(0.0)
        for one, handler in before.items():
            signal.signal(one, handler)


def _answer(handler: Any) -> list[Any]:
    """Let a handler answer Ctrl-C and its repetition; gives those that did before."""
    return [signal.signal(one, handler) for one in SIGNALS]


def _restore(before: list[Any]) -> None:
    for one, handler in zip(SIGNALS, before, strict=True):
        signal.signal(one, handler)


def _block(deaf: bool) -> None:
    """Hold Ctrl-C back from this thread and the processes that it starts, or let it through."""
    if BLOCKS:
        if deaf:
            from multiprocessing import resource_tracker

            resource_tracker.ensure_running()  # where it starts later it lets signals through
        how = signal.SIG_BLOCK if deaf else signal.SIG_UNBLOCK
        signal.pthread_sigmask(how, {signal.SIGINT})


def _wake(seconds: float) -> None:
    """Ask for SIGALRM after a time, for none after 0 s."""
    if REPEATS:
        signal.setitimer(signal.ITIMER_REAL, seconds)
