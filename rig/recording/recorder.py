"""Records a session from a thread of its own: a frame is never held up, only left out."""

from __future__ import annotations

import shutil
import threading
from collections.abc import Callable, Mapping
from pathlib import Path
from queue import Full, Queue
from types import TracebackType
from typing import Any

from rig.live import Chain
from rig.recording.layout import Shapes, rows, shapes
from rig.recording.place import require_new
from rig.recording.shot import Shot
from rig.recording.writer import Writer
from rig.zero import Zero

WAITING = 8  # frames that may wait to be written, 10 MB at a megapixel
RESERVE = 256 * 2**20  # bytes that are left free: a full disk would spoil the file and more


class Recorder:
    """See `rig.recording.shot.Recorder`; use it as a context.

    Attributes
    ----------
    status : str
        One sentence for the user.
    dropped : int
        Frames that are not in the file, because the disk was slow or full.

    Parameters
    ----------
    path : Path
        A new file.
    texts : mapping
        Attributes of the file: scene, calibration, when it was started.
    free : callable
        Bytes that are free where a path lies.

    Raises
    ------
    OSError, ValueError
        If the path is none for a new recording.
    """

    def __init__(
        self,
        path: Path,
        texts: Mapping[str, str],
        free: Callable[[Path], int] = lambda path: shutil.disk_usage(path).free,
    ):
        self._path, self._texts, self._free = require_new(path), texts, free
        self.status = f"'{path}' waits for the reference"
        self.dropped = 0
        self._layout: Shapes = {}
        self._writer: Writer | None = None
        self._waiting: Queue[Shot | None] = Queue(WAITING)
        self._thread = threading.Thread(target=self._write, name="recorder", daemon=True)

    def __enter__(self) -> Recorder:
        """Record what is put while the block runs."""
        self._thread.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Write what waits, then close the file."""
        self._waiting.put(None)
        self._thread.join()

    def begin(self, zero: Zero, chain: Chain, strain: bool) -> None:
        """Open the file; a disk that is full or read-only ends the recording and nothing else."""
        self._layout = shapes(chain, strain)
        try:
            self._writer = Writer(self._path, self._texts, zero, self._layout)
            self.status = f"recording to '{self._path}'"
        except OSError as error:
            self._stop(error)

    def put(self, shot: Shot) -> None:
        """Take a shot without waiting; where the disk is slow it is left out and counted."""
        try:
            self._waiting.put_nowait(shot)
        except Full:
            self.dropped += 1

    def summary(self) -> dict[str, Any]:
        """Figures so far, ready for JSON."""
        frames = self._writer.frames if self._writer else 0
        return {
            "path": str(self._path),
            "frames": frames,
            "dropped": self.dropped,
            "waiting": self._waiting.qsize(),
            "status": self.status,
        }

    def _write(self) -> None:
        """Body of the thread."""
        ended = False
        while shot := self._waiting.get():
            if self._writer is None or ended:
                self.dropped += 1
                continue
            try:
                if self._free(self._path.parent) < RESERVE:
                    raise OSError(f"less than {RESERVE >> 20} MB are free there")
                self._writer.append(rows(shot, self._layout))
            except OSError as error:
                self._stop(error)
                self.dropped += 1
                ended = True
                self._close()
        if not ended:
            self._close()

    def _close(self) -> None:
        try:
            if self._writer:
                self._writer.close()
        except (OSError, RuntimeError) as error:  # HDF5 has no other word for a full disk here
            self._stop(error)

    def _stop(self, error: Exception) -> None:
        reason = getattr(error, "strerror", None) or " ".join(str(error).split())
        self.status = (
            f"recording to '{self._path}' has ended ({reason}); free space and start a new one"
        )
