"""A touch that one frame alone shows, and is not sure of, waits for the next frame.

Noise brings a touch that lowers χ² by enough once in some thousand frames, for one frame. A finger
that lands is reported in its first frame or in its second. What a finger leaves that moved on and
lifted while no frame was taken lies far from where that was seen last, and looks like a weak touch.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from models import Result
from rig.live.chain import Chain, ChainState
from rig.live.fitted import touches_of
from rig.live.frame_estimate import FrameEstimate
from rig.live.memory import FADED, SLID
from rig.system.arrays import F64


def confirmed(chain: Chain, found: FrameEstimate, before: ChainState) -> FrameEstimate:
    """Leave out touches beyond those of the last frame where the frame cannot tell them.

    They stay in the state, so that a frame that shows them again reports them. What one of the last
    frame may have left does not stand for it.

    Parameters
    ----------
    chain : Chain
    found : FrameEstimate
        What the frame says by itself.
    before : ChainState
        After the last frame.
    """
    estimate = found.estimate
    known = _gone_on(before.touches, touches_of(estimate))
    uncertain = estimate.result is Result.UNRESOLVABLE and estimate.count > len(known)
    if not uncertain or found.measured is None:
        return found
    _, estimator = chain.masked_models.for_frame(found.hidden, found.level)
    measured, left = found.measured / found.level, found.state.memory.left
    fewer = estimator.fit_whitened(measured, known, count=len(known), left=left)
    return replace(found, estimate=fewer)


def _gone_on(before: F64, now: F64) -> F64:
    """Touches (n, 3) of before that may be there still among those of now (m, 3).

    All of them, unless one of now is so weak that a touch may have left it, and far from all.
    """
    apart = np.hypot(*(before[:, None, :2] - now[None, :, :2]).T).T
    near, faint = apart <= SLID, now[:, 2] < FADED * before[:, 2].max(initial=0.0)
    left = faint & ~near.any(axis=0)
    return before[near.any(axis=1)] if left.any() else before
