"""A reference that is renewed while the loop runs, from frames in which nothing touches.

Frames are gathered as they come, and what they need is prepared beside the loop: no frame waits.
"""

from __future__ import annotations

from concurrent.futures import Future
from functools import partial

import numpy as np

from rig.live.baseline import average_reference, is_consistent, moved_during_reference
from rig.live.bench import Bench, PreparedBench
from rig.live.beside import beside, failure
from rig.live.frame_estimate import FrameEstimate
from rig.live.quality import BUMPED
from rig.live.visibility import SLIGHT
from rig.system.arrays import F64, Grey
from rig.system.frame import Frame

SHOWN = 6.0  # s that a notice stays in the snapshots


class Tare:
    """Gathers the frames of a new reference and prepares it in a thread of its own.

    Parameters
    ----------
    bench : Bench

    Attributes
    ----------
    notice : str
        What was done or why nothing was, as a sentence for the user; empty before anything is
        asked for.
    """

    def __init__(self, bench: Bench):
        self.notice = ""
        self._bench = bench
        self._said: float | None = None
        self._images: list[Grey] | None = None
        self._next: Future[PreparedBench] | None = None
        self._shift = np.zeros(2)  # px: of the camera, from the first reference to the last one
        self._taken_at = self._shift  # to the one that is on its way

    @property
    def busy(self) -> bool:
        """Whether a new reference is on its way."""
        return self._images is not None or self._next is not None

    def ask(self) -> None:
        """Renew the reference from the next frames; one that is on its way goes on."""
        if not self.busy:
            self._images = []
            self._say("tare: a new reference is taken, touch nothing")

    def stand_on(self, bench: Bench) -> None:
        """Prepare the next reference on a bench of which more is known."""
        self._bench = bench

    def follow(self, frame: Frame, found: FrameEstimate, shift: F64) -> None:
        """Gather a frame, if frames are wanted and this one shows the plate at rest.

        Parameters
        ----------
        frame : Frame
        found : FrameEstimate
            Of this frame, from the reference so far.
        shift : (2,) float64, px
            Of the camera since that reference.
        """
        if self._images is None:
            return
        if why := _refusal(frame, found, self._shift + shift):
            self._refuse(why)
            return
        self._images.append(frame.image)
        if len(self._images) == self._bench.reference_frames:
            self._prepare(self._images, shift)

    def ready(self) -> PreparedBench | None:
        """Take the bench with its new reference, once; None while there is none."""
        if self._next is None or not self._next.done():
            return None
        made, self._next = self._next, None
        if why := failure("the tare", made):
            self._refuse(why)
            return None
        self._shift = self._taken_at
        self._say(
            f"tare: the reference is renewed from {self._bench.reference_frames} frames; the camera"
            f" has moved by {float(np.linalg.norm(self._shift)):.2f} px since the start"
        )
        return made.result()

    def current_notice(self, time: float) -> str:
        """Give the notice for `SHOWN` seconds after it was first given; `time` is a capture's."""
        if self.notice and self._said is None:
            self._said = time
        return self.notice if self._said is not None and time - self._said < SHOWN else ""

    def _prepare(self, images: list[Grey], shift: F64) -> None:
        self._images, self._taken_at = None, self._shift + shift
        self._next = beside("tare", partial(_prepared, self._bench, images))

    def _refuse(self, why: str) -> None:
        self._images = None
        self._say(f"tare refused: {why}, and ask again")

    def _say(self, notice: str) -> None:
        self.notice, self._said = notice, None


def _prepared(bench: Bench, images: list[Grey]) -> PreparedBench:
    if moved_during_reference(images):
        raise ValueError("something moved in the image; leave the plate alone")
    return bench.prepare_all(average_reference(images))


def _refusal(frame: Frame, found: FrameEstimate, shift: F64) -> str:
    """Say why a frame does not show the plate at rest; empty where it does."""
    estimate, moved = found.estimate, float(np.linalg.norm(shift))
    if estimate.count:
        (x, y), force = estimate.xy[0], estimate.force[0]
        return f"a touch of {force:.2f} N is held at ({x:.0f}, {y:.0f}) mm; lift it"
    if frame.truth:
        return "the source says that something presses; lift it"
    if found.unusable_reason:
        return found.unusable_reason
    if found.hidden_fraction > SLIGHT:
        return f"{found.hidden_fraction:.0%} of the pattern is hidden; clear the view"
    if not is_consistent(found.from_pattern or estimate):
        return "the image does not fit a plate at rest; take away what lies on it"
    if moved > BUMPED:
        return (
            f"the camera has moved by {moved:.1f} px since the start, and places would be off by"
            " as much; move it back"
        )
    return ""
