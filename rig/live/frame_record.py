"""What is recorded of a frame, and what the loop expects of a recorder."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

from models import BenchEstimate
from rig.live.baseline import ReferenceFrame
from rig.live.chain import Chain, ChainState
from rig.live.frame_estimate import FrameEstimate
from rig.system.frame import Frame


@dataclass(frozen=True, eq=False)
class FrameRecord:
    """One frame and everything that is needed to find the same touches in it again.

    Attributes
    ----------
    frame : Frame
    before : ChainState
        What the loop started from, so that frames before it may be missing.
    frame_estimate : FrameEstimate
        What it found.
    identities : (n,) int
        Of the touches found.
    sentence : str
        What the user reads of the frame.
    """

    frame: Frame
    before: ChainState
    frame_estimate: FrameEstimate
    identities: tuple[int, ...]
    sentence: str


class Recorder(Protocol):
    """Keeps frames; nothing that goes wrong there reaches the loop."""

    def begin(self, reference: ReferenceFrame, chain: Chain, strain: bool) -> None:
        """Learn the reference, before the first frame."""
        ...

    def renew(self, reference: ReferenceFrame, chain: Chain) -> None:
        """Learn the reference that frames are compared with from the next on."""
        ...

    def stand_on(self, bench: BenchEstimate) -> None:
        """Learn what a recording that begins later stands on."""
        ...

    def put(self, record: FrameRecord) -> None:
        """Take a frame without waiting."""
        ...

    def summary(self) -> dict[str, Any] | None:
        """Figures so far, ready for JSON; None while nothing is recorded."""
        ...
