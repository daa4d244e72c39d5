"""A touch that one frame alone shows, and is not sure of, waits for the next frame.

Noise brings a touch that lowers χ² by enough once in some thousand frames, for one frame. A finger
that lands is reported in its first frame or in its second. So is what a finger leaves that moved on
and lifted while no frame was taken: it lies far from where that was seen last.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from models import Result
from rig.live.chain import Chain, ChainState
from rig.live.frame_estimate import FrameEstimate
from rig.live.memory import SLID
from rig.system.arrays import F64, Mask


def confirmed(chain: Chain, found: FrameEstimate, before: ChainState) -> FrameEstimate:
    """Leave out touches that follow none of the last frame where the frame cannot tell them.

    They stay in the state, so that a frame that shows them again reports them.

    Parameters
    ----------
    chain : Chain
    found : FrameEstimate
        What the frame says by itself.
    before : ChainState
        After the last frame.
    """
    estimate = found.estimate
    known = before.touches[_followed(before.touches[:, :2], estimate.xy)]
    uncertain = estimate.result is Result.UNRESOLVABLE and estimate.count > len(known)
    if not uncertain or found.measured is None:
        return found
    _, estimator = chain.masked_models.for_frame(found.hidden, found.level)
    measured, left = found.measured / found.level, found.state.memory.left
    fewer = estimator.fit_whitened(measured, known, count=len(known), left=left)
    return replace(found, estimate=fewer)


def _followed(before: F64, now: F64) -> Mask:
    """Which places (n, 2) mm one of now (m, 2) is near enough to have come from, (n,)."""
    apart = np.hypot(*(before[:, None] - now[None]).T).T
    return np.any(apart <= SLID, axis=1)
