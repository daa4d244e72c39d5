"""Waiting for what another thread or process does."""

import time

SECONDS = 60.0
"""Until it is given up: a busy machine is slow, and a right one waits for none of it."""


def wait_for(condition):
    """Ask again and again until the answer is true, and return it."""
    end = time.monotonic() + SECONDS
    while not (value := condition()):
        assert time.monotonic() < end, "waited in vain"
        time.sleep(0.005)
    return value
