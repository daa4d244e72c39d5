"""A table of touches that is begun and ended while the loop runs."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import ExitStack, suppress
from datetime import datetime
from pathlib import Path

from rig.live.snapshot import Snapshot
from rig.recording.touches_csv import TouchesCsv, open_touches


class TouchesTable:
    """Call it with each snapshot: while the table is on, the touches of each are written.

    Parameters
    ----------
    folder : Path
    say : callable
        Takes a sentence: where the touches go, or why they do not.

    Attributes
    ----------
    path : Path or None
        The file that is written; None while none is.
    """

    def __init__(self, folder: Path, say: Callable[[str], object]):
        self._folder, self._say = folder, say
        self.path: Path | None = None
        self._write: TouchesCsv | None = None
        self._file = ExitStack()

    def __enter__(self) -> TouchesTable:
        """Write tables while the block runs."""
        return self

    def __exit__(self, *error: object) -> None:
        """End the table that is written."""
        if self._write:
            self._end()

    def toggle(self) -> None:
        """Begin a table under the time of day, or end the one that is written."""
        if self._write:
            self._end()
            return
        path = self._folder / f"touches-{datetime.now():%Y%m%d-%H%M%S}.csv"
        try:
            self._write = self._file.enter_context(open_touches(path))
        except OSError as error:
            self._say(f"touches are not written to '{path}': {error.strerror or error}")
            return
        self.path = path
        self._say(f"touches are written to '{path}'")

    def __call__(self, snapshot: Snapshot) -> None:
        """Write the touches of a frame; a disk that is full ends the table and nothing else."""
        if self._write is None:
            return
        try:
            self._write(snapshot)
        except OSError as error:
            self._fail(error)

    def _end(self) -> None:
        path, self.path, self._write = self.path, None, None
        try:
            self._file.close()
        except OSError as error:
            self._say(f"table of touches '{path}' is not whole: {error.strerror or error}")
        else:
            self._say(f"touches are in '{path}'")

    def _fail(self, error: OSError) -> None:
        path, self.path, self._write = self.path, None, None
        with suppress(OSError):
            self._file.close()
        self._say(f"table of touches '{path}' has ended: {error.strerror or error}; free space")
