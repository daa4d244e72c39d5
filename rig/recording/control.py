"""A recording that is started and ended while the loop runs."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rig.live.baseline import ReferenceFrame
from rig.live.chain import Chain
from rig.live.frame_record import FrameRecord
from rig.recording.recorder import SessionRecorder, new_recorder

if TYPE_CHECKING:
    from models import BenchEstimate
    from rig.calibration.store import Calibration
    from rig.scene import Scene


@dataclass(frozen=True, eq=False)
class Begun:
    """What the loop began with; each recording begins with it."""

    reference: ReferenceFrame
    chain: Chain
    strain: bool


def open_switch(path: Path | None, scene: Scene, calibration: Calibration) -> Switch:
    """Return a switch for recordings of a scene, on from the first frame if a file is named."""
    known = [calibration]

    def stand_on(bench: BenchEstimate) -> None:
        known[0] = calibration.on_bench(bench)

    return Switch(lambda file: new_recorder(file, scene, known[0]), path, stand_on)


class Switch:
    """A `rig.live.frame_record.Recorder` that hands on to a recording while one runs.

    Parameters
    ----------
    open_recorder : callable
        Makes a recorder of a new file, called as given or by the time if that is None.
    first : Path or None
        File of the recording that runs from the first frame on; None for none.
    stand_on : callable
        Takes the bench that a recording which begins later stands on.

    Attributes
    ----------
    begun : Begun or None
        None until the reference is there.
    refusal : str
        Why the last recording could not be started, as a sentence; empty if it could.
    """

    def __init__(
        self,
        open_recorder: Callable[[Path | None], SessionRecorder],
        first: Path | None,
        stand_on: Callable[[BenchEstimate], object] = lambda bench: None,
    ):
        self.begun: Begun | None = None
        self.refusal = ""
        self._open = open_recorder
        self._stand_on = stand_on
        self._recorder: SessionRecorder | None = None
        self._running = ExitStack()
        if first:
            self._recorder = self._running.enter_context(open_recorder(first))

    def __enter__(self) -> Switch:
        """Record while the block runs, if the switch is on."""
        return self

    def __exit__(self, *error: object) -> None:
        """End the recording that runs."""
        self._running.close()

    @property
    def failure(self) -> str:
        """Why the recording that runs has ended by itself, as a sentence; empty if it has not."""
        return self._recorder.failure if self._recorder else ""

    @property
    def where(self) -> str:
        """Where the recording that runs lies, as a sentence; empty while none does."""
        said = self.summary()
        return f"recording to '{Path(said['path']).absolute()}'" if said else ""

    @property
    def on(self) -> bool:
        """Whether a recording runs."""
        return self._recorder is not None

    def toggle(self) -> None:
        """Start a recording, or end the one that runs; `refusal` says what fails."""
        self.refusal = ""
        if self._recorder:
            self._running.close()
            self._recorder = None
            return
        try:
            recorder = self._open(None)
        except (OSError, ValueError) as error:
            self.refusal = str(error)
            return
        self._recorder = self._running.enter_context(recorder)
        if self.begun:
            recorder.begin(self.begun.reference, self.begun.chain, self.begun.strain)

    def begin(self, reference: ReferenceFrame, chain: Chain, strain: bool) -> None:
        """See `rig.live.frame_record.Recorder`."""
        self.begun = Begun(reference, chain, strain)
        if self._recorder:
            self._recorder.begin(reference, chain, strain)

    def renew(self, reference: ReferenceFrame, chain: Chain) -> None:
        """See `rig.live.frame_record.Recorder`."""
        if self.begun:
            self.begun = Begun(reference, chain, self.begun.strain)
        if self._recorder:
            self._recorder.renew(reference, chain)

    def stand_on(self, bench: BenchEstimate) -> None:
        """See `rig.live.frame_record.Recorder`."""
        self._stand_on(bench)

    def put(self, record: FrameRecord) -> None:
        """See `rig.live.frame_record.Recorder`."""
        if self._recorder:
            self._recorder.put(record)

    def summary(self) -> dict[str, Any] | None:
        """Figures of the recording that runs; None without one."""
        return self._recorder.summary() if self._recorder else None
