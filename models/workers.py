"""Where long work runs: here, or on the workers of a Dask scheduler (dask lives here).

Both are a `map`: results come in the order of the items, and items are taken as they are needed, so
that whoever gives them may look at what is done before giving another.
"""

from __future__ import annotations

import logging
import warnings
from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator
from contextlib import contextmanager, suppress
from importlib.util import find_spec
from itertools import islice
from typing import Any, Protocol

PATIENCE = 10.0
"""Wait for a scheduler to respond, and to come back where it was lost, s."""

ALONE = 60.0
"""Wait for a worker where a scheduler has none, s."""

LOOK = 1.0
"""From one look at who works to the next while a result is waited for, s."""

# Items handed out for each thread of the workers, so that none waits for the oldest result.
_AHEAD = 2


class Map(Protocol):
    """What `map` of Python is, called with one iterable."""

    def __call__(self, function: Callable[[Any], Any], items: Iterable[Any], /) -> Iterator[Any]:
        """Yield the result of each item, in order."""
        ...


Say = Callable[[str], None]
"""Takes a sentence for the user."""


@contextmanager
def workers(address: str | None, say: Say = lambda sentence: None) -> Generator[Map, None, None]:
    """Open the workers of a scheduler.

    Work on a worker that dies is done again on another: each item gives one result.

    Parameters
    ----------
    address
        As tcp://host:8786; None for this process, where the map is Python's own.
    say
        Takes a sentence for each worker that is gone, and where none is left.

    Raises
    ------
    ValueError
        When dask is not installed.
    OSError
        When the scheduler cannot be reached, inside also when it is lost or stays without a worker.
    """
    if address is None:
        yield map
        return
    if find_spec("distributed") is None:
        raise ValueError(
            "dask is not installed and a scheduler needs it; run pip install 'touchplate[cluster]'"
        )
    from distributed import Client
    from distributed.comm.addressing import resolve_address

    for name in ("distributed", "distributed.client"):
        # What they say of connections that come and go, an error here says in one sentence.
        logging.getLogger(name).setLevel(logging.CRITICAL)
    try:
        resolve_address(address)  # of one that is none a client is left that cannot be closed
        client = Client(address, timeout=PATIENCE, set_as_default=False)
    except (OSError, ValueError) as error:
        raise OSError(
            f"scheduler {address} cannot be reached ({_first_line(error)}); start it with 'dask "
            "scheduler', or work without one"
        ) from error
    with client:
        yield lambda function, items: _spread(
            _Crew(client, address, say), client, function, iter(items)
        )


class _Crew:
    """Who works for a scheduler: says who is gone, and does not wait for ever for another."""

    def __init__(self, client: Any, address: str, say: Say) -> None:
        self.address = address
        self._client, self._say = client, say
        self._known: set[str] = set()
        self._found_none = 0  # looks in a row

    def threads(self) -> int:
        """Threads of all of them.

        Raises
        ------
        OSError
            There has been none for too long.
        """
        threads: dict[str, int] = self._client.nthreads()
        for gone in sorted(self._known - threads.keys()):
            self._say(f"worker {gone} is gone" + ("; the others go on" if threads else ""))
        self._known = set(threads)
        self._require_some()
        return sum(threads.values())

    def _require_some(self) -> None:
        self._found_none = 0 if self._known else self._found_none + 1
        if self._found_none == 1:
            self._say(f"scheduler {self.address} has no worker; waiting {ALONE:g} s for one")
        if self._found_none * LOOK > ALONE:
            raise OSError(
                f"scheduler {self.address} had no worker for {ALONE:g} s; start some with 'dask"
                f" worker {self.address}' and run again, what was done is kept"
            )

    def result(self, future: Any) -> Any:
        """Wait for a result, and look from time to time who works for it."""
        while future.status != "error":
            # One that is done is waited for longer than a look: it may be large, and on its way; or
            # it died with its worker, and is to be done again.
            with suppress(TimeoutError):
                return future.result(timeout=ALONE if future.done() else LOOK)
            self.threads()
        return future.result()


def _spread(
    crew: _Crew, client: Any, function: Callable[[Any], Any], items: Iterator[Any]
) -> Iterator[Any]:
    """Keep a window of items on the workers; yield results from its front."""
    from distributed import CancelledError, KilledWorker
    from distributed.comm.core import CommClosedError

    try:
        # A task of its own: it reaches each worker once, and is made again if it is lost with one.
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", "Sending large graph")  # dask's word for it
            shared = client.submit(_itself, function, pure=False)
        window: deque[Any] = deque()
        while True:
            room = max(_AHEAD * max(crew.threads(), 1) - len(window), 0)
            window.extend(
                client.submit(_call, shared, item, pure=False) for item in islice(items, room)
            )
            if not window:
                return
            yield crew.result(window.popleft())
    except KilledWorker as error:
        raise OSError(
            f"workers of {crew.address} died one after the other at the same work; give them more "
            "memory and run again, what was done is kept"
        ) from error
    except (CancelledError, OSError) as error:
        cut = isinstance(error, (CancelledError, CommClosedError))
        if client.status == "running" and not cut:  # the work itself failed, or nobody does it
            raise
        raise OSError(
            f"scheduler {crew.address} was lost on the way; start it and run again, what was done "
            "is kept"
        ) from error


def _itself(function: Callable[[Any], Any]) -> Callable[[Any], Any]:
    return function


def _call(function: Callable[[Any], Any], item: Any) -> Any:
    return function(item)


def _first_line(error: Exception) -> str:
    return str(error).splitlines()[0] if str(error) else type(error).__name__
