"""Intervals of the forces of a frame that are not known evenly to both sides."""

from __future__ import annotations

from dataclasses import replace

from rig.live.chain import Chain
from rig.live.frame_estimate import FrameEstimate


def with_force_intervals(chain: Chain, found: FrameEstimate) -> FrameEstimate:
    """Return a frame's estimate with the intervals of such forces; see `models.Estimate`."""
    if found.measured is None or not found.estimate.count:
        return found
    _, estimator = chain.masked_models.for_mask(found.hidden)
    left = found.state.memory.left
    estimate = estimator.with_force_intervals(found.estimate, found.measured, left)
    return replace(found, estimate=estimate)
