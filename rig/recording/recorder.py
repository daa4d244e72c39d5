"""Records a session from a thread of its own: a frame is never held up, only left out."""

from __future__ import annotations

import re
import shutil
import threading
from collections.abc import Callable, Mapping
from contextlib import suppress
from datetime import UTC, datetime
from pathlib import Path
from queue import Full, Queue
from typing import TYPE_CHECKING, Any

from rig.live.baseline import ReferenceFrame
from rig.live.chain import Chain
from rig.live.frame_record import FrameRecord
from rig.recording.layout import Shapes, rows, shapes
from rig.recording.paths import require_new
from rig.recording.writer import Writer

if TYPE_CHECKING:
    from models import BenchEstimate
    from rig.calibration.store import Calibration
    from rig.scene import Scene

WAITING = 48  # frames that may wait to be written: 1.6 s of 30 a second, 60 MB at a megapixel
RESERVE = 256 * 2**20  # bytes that are left free: a full disk would spoil the file and more


def new_recorder(path: Path | None, scene: Scene, calibration: Calibration) -> SessionRecorder:
    """Return a recorder of a scene; without a path the file is called by the time of day.

    Raises
    ------
    OSError, ValueError
        If the path is none for a new recording, the disk has no room for one, or the plate of the
        scene is bent by its base.
    """
    if scene.base is not None:
        raise ValueError(
            f"scene '{scene.title}' has a bent plate, and a recording keeps what the loop of a flat"
            " one needs; run it without a recording"
        )
    now = datetime.now(UTC)
    texts = {
        "scene": scene.model_dump_json(),
        "calibration": calibration.model_dump_json(exclude_none=True),
        "started": now.isoformat(timespec="seconds"),
    }
    path = path or Path(f"session-{now.astimezone():%Y%m%d-%H%M%S}.h5")
    recorder = SessionRecorder(path, texts)
    free = shutil.disk_usage(path.parent).free
    if free < RESERVE:
        raise OSError(
            f"folder '{path.parent}' has {free >> 20} MB free, of which a recording leaves"
            f" {RESERVE >> 20} MB; free space there or record elsewhere"
        )
    return recorder


class SessionRecorder:
    """A `rig.live.frame_record.Recorder` that writes a file; use it as a context.

    Attributes
    ----------
    status : str
        One sentence for the user.
    dropped : int
        Frames that are not in the file, because the disk was slow or full.
    failure : str
        Why the recording ended by itself, as a sentence; empty while it has not.

    Parameters
    ----------
    path : Path
        A new file.
    texts : mapping
        Attributes of the file: scene, calibration, when it was started.
    free : callable
        Bytes that are free where a path lies.
    waiting : int
        Frames that may wait to be written.

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
        waiting: int = WAITING,
    ):
        self._path, self._texts, self._free = require_new(path), texts, free
        self.status = f"'{path}' waits for the reference"
        self.dropped = 0
        self.failure = ""
        self._layout: Shapes = {}
        self._writer: Writer | None = None
        self._waiting: Queue[tuple[FrameRecord, int] | None] = Queue(waiting)
        self._renewed: list[ReferenceFrame] = []
        self._thread = threading.Thread(target=self._write, name="recorder", daemon=True)

    def __enter__(self) -> SessionRecorder:
        """Record what is put while the block runs."""
        self._thread.start()
        return self

    def __exit__(self, *error: object) -> None:
        """Write what waits, then close the file."""
        while self._thread.is_alive():
            with suppress(Full):
                self._waiting.put(None, timeout=0.1)
                self._thread.join()

    def begin(self, reference: ReferenceFrame, chain: Chain, strain: bool) -> None:
        """Open the file; a disk that is full or read-only ends the recording and nothing else."""
        self._layout = shapes(chain, strain)
        try:
            self._writer = Writer(self._path, self._texts, reference, self._layout)
            self.status = f"recording to '{self._path}'"
        except FileExistsError as error:
            self._stop(_reason(error))
        except (OSError, RuntimeError) as error:
            self._path.unlink(missing_ok=True)
            self._stop(_reason(error))

    def renew(self, reference: ReferenceFrame, chain: Chain) -> None:
        """Keep a new reference; it is written before the first frame that was compared with it."""
        self._renewed.append(reference)

    def stand_on(self, bench: BenchEstimate) -> None:
        """See `rig.live.frame_record.Recorder`; what is learned later is none of this recording."""

    def put(self, record: FrameRecord) -> None:
        """Take a frame without waiting; where the disk is slow it is left out and counted."""
        try:
            self._waiting.put_nowait((record, len(self._renewed)))
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
            "complete": not self.failure,
        }

    def _write(self) -> None:
        """Body of the thread."""
        while waited := self._waiting.get():
            if self._writer and not self.failure:
                self._append(self._writer, *waited)
            if self.failure:
                self.dropped += 1
        if self._writer and not self.failure:
            self._close(self._writer)

    def _close(self, writer: Writer) -> None:
        try:
            writer.close()
        except (OSError, RuntimeError) as error:
            writer.abandon()
            self._stop(_reason(error))

    def _append(self, writer: Writer, record: FrameRecord, number: int) -> None:
        """Write a frame; where that is impossible the file ends before it."""
        if self._free(self._path.parent) < RESERVE:
            self._close(writer)
            self._stop(f"less than {RESERVE >> 20} MB are free there")
            return
        try:
            for reference in self._renewed[writer.renewed : number]:
                writer.renew(reference, record.frame.captured)
            writer.append(rows(record, self._layout, number))
        except (OSError, RuntimeError) as error:  # HDF5 calls some full disks a RuntimeError
            writer.abandon()
            self._stop(_reason(error))

    def _stop(self, reason: str) -> None:
        frames = self._writer.frames if self._writer else 0
        self.status = self.failure = (
            f"recording to '{self._path}' has ended with {frames} frames ({reason}); free space and"
            " start a new one"
        )


def _reason(error: Exception) -> str:
    """Why a disk takes no more; HDF5 hides that in a long text of its own."""
    text = getattr(error, "strerror", None) or " ".join(str(error).split())
    reason = re.search("error message = '([^']+)'", text)
    return reason[1].lower() if reason else text
