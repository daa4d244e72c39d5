"""What an operator has written to files from the page: snapshots, and a table of touches."""

from __future__ import annotations

from collections.abc import Callable, Generator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from rig.live.notice import Notice
from rig.live.snapshot import Snapshot
from rig.page.packet import Packet
from rig.recording.stills import Stills
from rig.recording.touches_table import TouchesTable


@dataclass(frozen=True, eq=False)
class Files:
    """Files of the page; use `open_files`.

    Attributes
    ----------
    keep : callable
        Keeps a snapshot: its image, its touches, and its state as JSON, as the page has it.
    table : TouchesTable
    notice : Notice
        What became of the last wish.
    """

    keep: Callable[[Snapshot], object]
    table: TouchesTable
    notice: Notice


@contextmanager
def open_files(folder: Path, say: Callable[[str], object]) -> Generator[Files]:
    """Write files to a folder while the block runs.

    Parameters
    ----------
    folder : Path
    say : callable
        Takes sentences for the terminal; the page has them as a notice.
    """
    notice = Notice()

    def note(sentence: str) -> None:
        notice.say(sentence)
        say(sentence)

    with Stills(folder, note, describe) as keep, TouchesTable(folder, note) as table:
        yield Files(keep, table, notice)


def describe(snapshot: Snapshot) -> str:
    """JSON of all of a snapshot that is text or a few numbers."""
    return Packet(snapshot, None).described
