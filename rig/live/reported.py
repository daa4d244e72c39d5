"""What is reported of the touches of a frame, beyond what the next one starts from."""

from __future__ import annotations

from dataclasses import replace

from rig.live.chain import Chain
from rig.live.frame_estimate import FrameEstimate


def reported(chain: Chain, found: FrameEstimate) -> FrameEstimate:
    """Return a frame's estimate with intervals of uneven forces, or by the causes that it shows.

    See `Estimator.with_force_intervals` and `Estimator.by_relevance`.
    """
    if found.measured is None or not found.estimate.count:
        return found
    _, estimator = chain.masked_models.for_mask(found.hidden)
    left = found.state.memory.left
    estimate = estimator.with_force_intervals(found.estimate, found.measured, left)
    estimate = estimator.by_relevance(estimate, found.measured, left)
    return replace(found, estimate=estimate)
