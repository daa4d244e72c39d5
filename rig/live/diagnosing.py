"""What of the bench is otherwise than described, looked for while frames do not fit.

Touches far apart are gathered as they come. Where half of them do not fit, causes are tried as by
`touchplate diagnose`; no live frame waits for it.
"""

from __future__ import annotations

from concurrent.futures import Future
from functools import partial

import numpy as np

import models
import synthetic
from rig.live.baseline import is_consistent
from rig.live.beside import beside, failure
from rig.live.chain import Chain
from rig.live.frame_estimate import FrameEstimate, touches_of
from rig.live.known_bench import KnownBench
from rig.live.notice import Notice
from rig.system.arrays import F64

TOUCHES = 8
"""Touches that are looked at together."""
MISFITS = 4
"""Of these, how many must not fit before causes are tried."""
_APART = 15.0  # mm from each other
_STRONG = 0.4  # N: weaker ones tell little


class Diagnosing:
    """Names what does not fit, once enough touches have shown it.

    Parameters
    ----------
    camera : synthetic.AnyCamera
        As it is described.
    references : int
        Frames of the reference, whose noise all touches share.
    waits : bool
        Whether frames wait meanwhile: those of images that are kept do.

    Attributes
    ----------
    sentence : str
        What explains the touches that do not fit; empty while they fit or nothing is known.
    notice : Notice
        The same when it is found.
    """

    def __init__(self, camera: synthetic.AnyCamera, references: int, waits: bool = False):
        self.sentence, self.notice = "", Notice()
        self._camera, self._references, self._waits = camera, references, waits
        self.pause()

    def pause(self) -> None:
        """Forget what is gathered or on its way: it was measured against another reference."""
        self._presses: tuple[models.Press, ...] = ()
        self._misfits = 0
        self._work: Future[str] | None = None

    def follow(self, found: FrameEstimate, chain: Chain, known: models.BenchEstimate) -> None:
        """Look at a frame.

        Parameters
        ----------
        found : FrameEstimate
        chain : Chain
            That found it.
        known : models.BenchEstimate
            The bench that it was found on.
        """
        if self._work is None:
            self._gather(found, chain, known)
        elif self._waits or self._work.done():
            self._name(self._work)
            self._work = None

    def _name(self, work: Future[str]) -> None:
        """Take what was worked out, or say why there is nothing."""
        if why := failure("the diagnosis", work):
            self.notice.say(f"what does not fit is not named: {why}; the next are tried")
            return
        self.sentence = work.result()
        self.notice.say(self.sentence)

    def _gather(self, found: FrameEstimate, chain: Chain, known: models.BenchEstimate) -> None:
        press = self._press(found, chain)
        if press is None:
            return
        self._presses += (press,)
        self._misfits += not is_consistent(found.estimate)
        if len(self._presses) < TOUCHES:
            return
        presses, misfits = self._presses, self._misfits
        self.pause()
        if misfits < MISFITS:
            self.sentence = ""
        elif not self.sentence:
            known_bench = KnownBench(known, self._camera)
            diagnose = partial(_diagnosed, chain, known_bench, presses)
            self._work = beside("diagnosing", diagnose)

    def _press(self, found: FrameEstimate, chain: Chain) -> models.Press | None:
        """Take the strongest touch of a frame; None where others fit, or it lies near another."""
        touches = touches_of(found.estimate)
        alone = len(touches) == 1 or (len(touches) and not is_consistent(found.estimate))
        if found.measured is None or not alone or not found.whole_and_clear:
            return None
        touch: F64 = touches[np.argmax(touches[:, 2])]
        near = any(np.hypot(*(touch[:2] - one.touch[:2])) < _APART for one in self._presses)
        if near or touch[2] < _STRONG:
            return None
        whitening = None
        if found.hidden.any():
            factor = chain.masked_models.pattern_for(found.hidden).factor
            whitening = np.ascontiguousarray(factor.T) / chain.noise
        unknown, frames = np.full(3, np.inf), (1, self._references)
        moved = chain.pattern.uncorrected(found.state.motion)
        return models.Press.of_frames(found.measured, touch, unknown, frames, whitening, moved)


def _diagnosed(chain: Chain, known: KnownBench, presses: tuple[models.Press, ...]) -> str:
    """Name what explains touches; empty where the bench does as it is described.

    Raises
    ------
    ValueError
        If the descent does not end.
    """
    forward = chain.pattern.forward(chain.noise)
    if not isinstance(forward, models.BenchForward):
        return ""
    look = known.look(chain.pattern)
    try:
        found = models.diagnose(forward.apart(), presses, known.estimate, look)
    except np.linalg.LinAlgError as error:
        raise ValueError(f"{len(presses)} touches do not tell causes apart ({error})") from error
    if not found.explained:
        return f"Nothing of the bench alone explains it: {models.NO_CAUSE}."
    return found.sentence if found.named else ""
