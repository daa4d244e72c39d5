"""Processes beside the loop: born deaf to Ctrl-C, which is the loop's to answer."""

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def deaf_to_interrupts() -> Iterator[None]:
    """Let a process that starts here ignore Ctrl-C from its first instruction on.

    A new process that still imports would die of it with a traceback.
    """
    if threading.current_thread() is not threading.main_thread():  # signals are the main thread's
        yield
        return
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
