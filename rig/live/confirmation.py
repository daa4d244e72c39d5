"""A touch that one frame alone shows, and is not sure of, waits for the next frame.

Noise brings a touch that lowers χ² by enough once in some thousand frames, for one frame. A finger
that lands is reported in its first frame or in its second.
"""

from __future__ import annotations

from dataclasses import replace

from models import Result
from rig.live.chain import Chain, ChainState
from rig.live.frame_estimate import FrameEstimate


def confirmed(chain: Chain, found: FrameEstimate, before: ChainState) -> FrameEstimate:
    """Leave out touches beyond those of the last frame where the frame cannot tell them.

    They stay in the state, so that a frame that shows them again reports them.

    Parameters
    ----------
    chain : Chain
    found : FrameEstimate
        What the frame says by itself.
    before : ChainState
        After the last frame.
    """
    estimate, known = found.estimate, len(before.touches)
    uncertain = estimate.result is Result.UNRESOLVABLE and estimate.count > known
    if not uncertain or found.measured is None:
        return found
    _, estimator = chain.masked_models.for_frame(found.hidden, found.level)
    measured, left = found.measured / found.level, found.state.memory.left
    fewer = estimator.fit_whitened(measured, before.touches, count=known, left=left)
    return replace(found, estimate=fewer)
