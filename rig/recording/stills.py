"""Stills: the image of one frame and its touches as a table, kept on request."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from datetime import datetime
from pathlib import Path
from threading import Semaphore

import cv2

from rig.live.snapshot import Snapshot
from rig.recording.touches_csv import open_touches

WAITING = 8  # stills that may wait until they are written


class Stills:
    """Call it with the snapshot to keep; a thread of its own writes, so no frame waits.

    Parameters
    ----------
    folder : Path
    say : callable
        Takes a sentence: what was kept, or why it was not.
    describe : callable or None
        Gives all else that is known of a frame, as JSON; None keeps nothing of it.
    """

    def __init__(
        self,
        folder: Path,
        say: Callable[[str], object],
        describe: Callable[[Snapshot], str] | None = None,
    ):
        self._folder, self._say, self._describe = folder, say, describe
        self._pool = ThreadPoolExecutor(1, "stills")
        self._places = Semaphore(WAITING)

    def __enter__(self) -> Stills:
        """Keep stills while the block runs."""
        return self

    def __exit__(self, *error: object) -> None:
        """Write what waits, then end the thread."""
        self._pool.shutdown()

    def __call__(self, snapshot: Snapshot) -> None:
        """Keep a frame under the time of day and its number, unless too many wait."""
        if not self._places.acquire(blocking=False):
            self._say(f"snapshot is not kept: {WAITING} wait to be written; ask for fewer")
            return
        name = f"still-{datetime.now():%Y%m%d-%H%M%S}-{snapshot.sequence}"
        kept = self._pool.submit(self._keep, snapshot, self._folder / name)
        kept.add_done_callback(lambda _: self._places.release())

    def _keep(self, snapshot: Snapshot, path: Path) -> None:
        try:
            state = self._describe(snapshot) if self._describe else None
            self._say(f"snapshot kept in '{write_still(snapshot, path, state)}'")
        except OSError as error:
            self._say(f"snapshot is not kept in '{path}.png': {error.strerror or error}")


def write_still(snapshot: Snapshot, path: Path, state: str | None = None) -> Path:
    """Write `path`.png, the image, and `path`.csv, its touches as `touchplate run --touches` does.

    Each is written under another name first, so that no half of a file is left. Where a `state` is
    given, `path`.json has it.

    Returns
    -------
    Path
        Of the image.

    Raises
    ------
    OSError
        If the folder cannot be written.
    """
    image, table, text = map(path.with_suffix, (".png", ".csv", ".json"))
    coming = [whole.with_suffix(f"{whole.suffix}.part") for whole in (image, table, text)]
    try:
        coming[0].write_bytes(cv2.imencode(".png", snapshot.image)[1].tobytes())
        with open_touches(coming[1]) as write:
            write(snapshot)
        if state is not None:
            coming[2].write_text(state, encoding="utf-8")
        for part, whole in zip(coming, (image, table, text), strict=True):
            if part.exists():
                part.replace(whole)
    finally:
        for part in coming:
            part.unlink(missing_ok=True)
    return image
