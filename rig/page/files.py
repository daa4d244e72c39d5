"""Files of a run, from the page: snapshots and a table of touches to write, recordings to play."""

from __future__ import annotations

from collections.abc import Callable, Generator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from rig.live.notice import Notice
from rig.live.snapshot import Snapshot
from rig.page.packet import Packet
from rig.page.playback_page import PlaybackPage
from rig.recording.stills import Stills
from rig.recording.touches_table import TouchesTable

if TYPE_CHECKING:
    from rig.scene.loop import Page


@dataclass(frozen=True, eq=False)
class Files:
    """Files of the page; use `open_files`.

    Attributes
    ----------
    keep : callable
        Keeps a snapshot: its image, its touches, and its state as JSON, as the page has it.
    table : TouchesTable
    playback : PlaybackPage
    notice : Notice
        What became of the last wish.
    """

    keep: Callable[[Snapshot], object]
    table: TouchesTable
    playback: PlaybackPage
    notice: Notice


@contextmanager
def open_files(folder: Path, page: Page, say: Callable[[str], object]) -> Generator[Files]:
    """Write files to a folder, and play those that are there, while the block runs.

    Parameters
    ----------
    folder : Path
    page : Page
        Who may look at recordings.
    say : callable
        Takes sentences for the terminal; the page has them as a notice.
    """
    notice = Notice()

    def note(sentence: str) -> None:
        notice.say(sentence)
        say(sentence)

    with (
        Stills(folder, note, describe) as keep,
        TouchesTable(folder, note) as table,
        PlaybackPage(folder, page) as playback,
    ):
        yield Files(keep, table, playback, notice)


def describe(snapshot: Snapshot) -> str:
    """JSON of all of a snapshot that is text or a few numbers."""
    return Packet(snapshot, None).described
