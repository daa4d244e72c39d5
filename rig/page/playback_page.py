"""Recordings beside a running loop: a page of their own, served from a process of its own."""

from __future__ import annotations

import multiprocessing
from contextlib import suppress
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import TYPE_CHECKING

from rig.page.controls import Recordings
from rig.recording.paths import recordings_at
from rig.system.process import deaf_to_interrupts, leave_signals_to_the_loop

if TYPE_CHECKING:
    from rig.scene.loop import Page

Word = tuple[str, str]
"""Address of the page, or empty; and why there is none, as a sentence."""
NO_WORD: Word = ("", "")


class PlaybackPage:
    """Lists the recordings of a folder, and plays the one that is chosen on a page beside the run.

    Files are read and images compressed in another process, so that no frame of the loop waits.

    Parameters
    ----------
    folder : Path
    page : Page
        Who may look, and act.
    """

    def __init__(self, folder: Path, page: Page):
        self._folder, self._page = folder, page
        self._names: tuple[str, ...] = ()
        self._played, self._word = "", NO_WORD
        self._opened: tuple[Connection, BaseProcess] | None = None

    @property
    def pid(self) -> int | None:
        """Number of the process that plays; None while none does."""
        return self._opened[1].pid if self._opened else None

    def __enter__(self) -> PlaybackPage:
        """Play while the block runs."""
        return self

    def __exit__(self, *error: object) -> None:
        """End the page."""
        self._close()

    def look(self) -> None:
        """List the recordings that are there now, the newest first."""
        self._names = recordings_at(self._folder)

    def play(self, name: str) -> None:
        """Open the page of a recording that is listed; `state` says when it is there.

        Raises
        ------
        ValueError
            If none is called so.
        OSError
            If the system starts no other process.
        """
        if name not in self._names:
            raise ValueError(f"no recording here is called {name!r}; choose one of the list")
        self._close()
        self._played, self._word = "", NO_WORD
        context = multiprocessing.get_context("spawn")
        ours, theirs = context.Pipe()
        given = theirs, self._folder / name, self._page
        process = context.Process(target=play_until_closed, args=given, daemon=True)
        with deaf_to_interrupts():
            process.start()
        theirs.close()
        self._opened, self._played = (ours, process), name

    def state(self) -> Recordings:
        """Give what is listed, what is played, and where."""
        if self._opened:
            self._hear(self._opened[0])
        return Recordings(self._names, self._played, *self._word)

    def _hear(self, link: Connection) -> None:
        """Take what the page says; where it has ended without saying why, that is said."""
        try:
            while link.poll():
                self._word = link.recv()
        except (EOFError, OSError):
            self._close()
            ended = f"page of '{self._played}' has ended; choose the recording again"
            self._word = "", self._word[1] or ended

    def _close(self) -> None:
        if self._opened is None:
            return
        link, process = self._opened
        link.close()
        process.kill()  # it only reads, and its goodbye would hold the loop
        process.join()
        process.close()
        self._opened = None


def play_until_closed(link: Connection, path: Path, page: Page) -> None:
    """Body of the process: play a recording on a free port until the loop is gone."""
    leave_signals_to_the_loop()
    from rig.page.player import PagePlayer
    from rig.page.server import serve
    from rig.web.access import access_of

    def wait(seconds: float) -> None:
        if link.poll(seconds):  # nothing is ever sent: the link has ended
            raise EOFError

    with suppress(EOFError):
        try:
            with serve(0, None, access_of(page.viewers, page.control == "viewers")) as publisher:
                link.send((publisher.link or publisher.url, ""))
                PagePlayer(publisher, sleep=wait).play(path)
        except (OSError, ValueError) as error:
            with suppress(OSError):
                link.send(("", str(error)))
