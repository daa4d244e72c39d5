"""What is reported of the touches of a frame, beyond what the next one starts from."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from models import with_motion_errors
from rig.live.chain import Chain, ChainState
from rig.live.confirmation import confirmed
from rig.live.frame_estimate import FrameEstimate, estimate_frame
from rig.system.arrays import AnyArray
from rig.system.timing import Stopwatch

if TYPE_CHECKING:
    from rig.live.net_chain import NetChain


def report_frame(
    chain: Chain,
    net: NetChain | None,
    image: AnyArray,
    before: ChainState,
    watch: Stopwatch,
    drift: float = 0.0,
    time: float | None = None,
) -> FrameEstimate:
    """Find the touches in one frame, and report those that it is sure of, or what a net finds.

    See `estimate_frame` for drift and time.
    """
    found = estimate_frame(chain, image, before, watch, drift, time)
    found = confirmed(chain, found, before)
    if net is not None:
        return net.estimate(chain, image, found, watch)
    with watch.stage("estimate"):
        return reported(chain, found)


def reported(chain: Chain, found: FrameEstimate) -> FrameEstimate:
    """Return a frame's estimate with intervals of uneven forces, or by the causes that it shows.

    Its errors are those of the motion of the frame, not of its level. See
    `Estimator.with_force_intervals`, `Estimator.by_relevance` and `models.with_motion_errors`.
    """
    if found.measured is None or not found.estimate.count:
        return found
    _, estimator = chain.masked_models.for_frame(found.hidden, found.level)
    measured, left = found.measured / found.level, found.state.memory.left
    estimate = estimator.with_force_intervals(found.estimate, measured, left)
    estimate = estimator.by_relevance(estimate, measured, left)
    variance = found.pixel_variance
    errors = chain.motion_errors(found.state.motion, found.hidden, variance, found.level)
    return replace(found, estimate=with_motion_errors(estimate, errors))
