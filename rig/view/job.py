"""The correlation that a page has started: it runs beside the server and can be stopped."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from threading import Event, Lock, Thread
from typing import Any

Report = Callable[[int, int], None]
Work = Callable[[Report], Path]
"""Correlates, reports how far it is, and returns the path of the result."""


class Stopped(Exception):  # noqa: N818
    """Somebody has stopped it."""


@dataclass(frozen=True)
class JobState:
    """How far a correlation is.

    Attributes
    ----------
    running : bool
    done, total : int
        Frames.
    error : str
        Why it ended, in a sentence; "" where it did not fail.
    results : int
        Results that are there since the page was opened.
    """

    running: bool = False
    done: int = 0
    total: int = 0
    error: str = ""
    results: int = 0

    def as_json(self) -> dict[str, Any]:
        """Return it as the page reads it."""
        return asdict(self)


class Job:
    """Runs one correlation at a time.

    Attributes
    ----------
    stopping : Event
        Set from the wish to stop until the next correlation starts.
    """

    def __init__(self) -> None:
        self._state, self._lock = JobState(), Lock()
        self._thread: Thread | None = None
        self.stopping = Event()

    @property
    def state(self) -> JobState:
        """How far it is."""
        return self._state

    def start(self, work: Work, finish: Callable[[Path], None]) -> None:
        """Start a correlation; `finish` takes its result.

        Raises
        ------
        ValueError
            One is running.
        """
        with self._lock:
            if self._state.running:
                raise ValueError("a correlation is running; stop it first, or wait for its end")
            self._state = JobState(running=True, results=self._state.results)
            self.stopping.clear()
            self._thread = Thread(target=self._run, args=(work, finish), name="correlation")
            self._thread.start()

    def stop(self) -> None:
        """Stop the correlation after the frames that it is at; what was done is kept."""
        self.stopping.set()
        if self._thread is not None:
            self._thread.join()

    def _run(self, work: Work, finish: Callable[[Path], None]) -> None:
        error, results = "the correlation broke off; the terminal says why", self._state.results
        try:
            finish(work(self._report))
            error, results = "", results + 1
        except Stopped:
            error = "stopped; correlate with the same settings to go on from here"
        except (OSError, ValueError) as refusal:
            error = " ".join(str(refusal).split())
        finally:
            self._state = replace(self._state, running=False, error=error, results=results)

    def _report(self, done: int, total: int) -> None:
        self._state = replace(self._state, done=done, total=total)
        if self.stopping.is_set():
            raise Stopped
