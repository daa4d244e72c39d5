"""Where long work runs: here, or on the workers of a Dask scheduler (dask lives here).

Both are a `map`: results come in the order of the items, and items are taken as they are needed, so
that whoever gives them may look at what is done before giving another.
"""

from __future__ import annotations

import logging
import warnings
from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from itertools import islice
from typing import Any, Protocol

PATIENCE = 10.0
"""Wait for a scheduler to respond, and to come back where it was lost, s."""

# Items handed out for each thread of the workers, so that none waits for the oldest result.
_AHEAD = 2


class Map(Protocol):
    """What `map` of Python is, called with one iterable."""

    def __call__(self, function: Callable[[Any], Any], items: Iterable[Any], /) -> Iterator[Any]:
        """Yield the result of each item, in order."""
        ...


@contextmanager
def workers(address: str | None) -> Generator[Map, None, None]:
    """Open the workers of a scheduler.

    Work on a worker that dies is done again on another: each item gives one result.

    Parameters
    ----------
    address
        As tcp://host:8786; None for this process, where the map is Python's own.

    Raises
    ------
    ValueError
        When dask is not installed.
    OSError
        When the scheduler cannot be reached, inside also when it is lost.
    """
    if address is None:
        yield map
        return
    if find_spec("distributed") is None:
        raise ValueError(
            "dask is not installed and a scheduler needs it; run pip install 'touchplate[cluster]'"
        )
    from distributed import Client

    for name in ("distributed", "distributed.client"):
        # What they say of connections that come and go, an error here says in one sentence.
        logging.getLogger(name).setLevel(logging.CRITICAL)
    try:
        client = Client(address, timeout=PATIENCE, set_as_default=False)
    except (OSError, ValueError) as error:
        raise OSError(
            f"scheduler {address} cannot be reached ({_first_line(error)}); start it with 'dask "
            "scheduler', or work without one"
        ) from error
    with client:
        yield lambda function, items: _spread(client, address, function, iter(items))


def _spread(
    client: Any, address: str, function: Callable[[Any], Any], items: Iterator[Any]
) -> Iterator[Any]:
    """Keep a window of items on the workers; yield results from its front."""
    from distributed import CancelledError, KilledWorker

    try:
        # A task of its own: it reaches each worker once, and is made again if it is lost with one.
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", "Sending large graph")  # dask's word for it
            shared = client.submit(_itself, function, pure=False)
        window: deque[Any] = deque()
        while True:
            threads: Any = client.nthreads()
            room = max(_AHEAD * max(sum(threads.values()), 1) - len(window), 0)
            window.extend(
                client.submit(_call, shared, item, pure=False) for item in islice(items, room)
            )
            if not window:
                return
            yield window.popleft().result()
    except KilledWorker as error:
        raise OSError(
            f"workers of {address} died one after the other at the same work; give them more "
            "memory and run again, what was done is kept"
        ) from error
    except (CancelledError, OSError) as error:
        if client.status == "running":  # the work itself failed
            raise
        raise OSError(
            f"scheduler {address} was lost on the way; start it and run again, what was done is "
            "kept"
        ) from error


def _itself(function: Callable[[Any], Any]) -> Callable[[Any], Any]:
    return function


def _call(function: Callable[[Any], Any], item: Any) -> Any:
    return function(item)


def _first_line(error: Exception) -> str:
    return str(error).splitlines()[0] if str(error) else type(error).__name__
