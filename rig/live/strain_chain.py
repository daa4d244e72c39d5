"""Strain of a frame, and the touches that it shows by itself."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

import synthetic
from dic import TileBlocks, TileSums, prepare_blocks, tile_displacement
from models import (
    Estimate,
    Estimator,
    MotionErrors,
    StrainMap,
    prepare_strain_map,
    with_motion_errors,
)
from rig.live.alignment import Alignment
from rig.live.chain import Chain, ChainState
from rig.live.fitted import touches_of
from rig.live.frame_estimate import TOO_NOISY, FrameEstimate
from rig.system.arrays import F64
from rig.system.timing import Stopwatch


@dataclass(frozen=True, eq=False)
class StrainChain:
    """What draws the strain map of the same frames; with an estimator, touches are found in it."""

    blocks: TileBlocks
    map: StrainMap
    noise: float
    estimator: Estimator | None = None


def prepare_strain(
    chain: Chain, camera: synthetic.AnyCamera, block: int, window: int
) -> StrainChain:
    """Prepare strain over blocks of `block` tiles and windows of `window` blocks a side."""
    blocks = prepare_blocks(chain.reference, block)
    strain_map = prepare_strain_map(chain.pattern, blocks, camera, window)
    return StrainChain(blocks, strain_map, chain.noise)


def with_touches(strain: StrainChain, chain: Chain) -> StrainChain:
    """Find touches in strain too, on the bench on which a chain stands."""
    large, factor = chain.pattern.motions.large, strain.map.factor / chain.noise
    forward = large.forward(factor) if large else strain.map.forward(chain.noise)
    return replace(strain, estimator=replace(chain.estimator, forward=forward))


def sense_strain(
    chain: StrainChain, sums: TileSums, state: ChainState, watch: Stopwatch
) -> tuple[F64, Estimate | None]:
    """Strain of one frame, (T, 3), and the touches that it shows beyond the plate at rest.

    The touches are None where a part of the map is lost in this frame, by a hand for instance.
    """
    with watch.stage("strain"):
        field = tile_displacement(chain.blocks, sums, chain.noise)
        strain = chain.map.strain(field)
    if chain.estimator is None:
        return strain, None
    with watch.stage("from strain"):
        measured = chain.map.whiten(strain, chain.noise)
        if measured is None:
            return strain, None
        measured -= state.rest @ chain.map.factor / chain.noise
        return strain, chain.estimator.fit_whitened(measured, state.from_strain)


def with_strain(
    strain_chain: StrainChain | None,
    frame_estimate: FrameEstimate,
    watch: Stopwatch,
    alignment: Alignment | None = None,
) -> FrameEstimate:
    """Add what strain says, where it is wanted, to the estimate of a frame, and correct it all.

    The state stays as it was found: the next frame starts from what this one shows.
    """
    if strain_chain is None:
        return _aligned(frame_estimate, alignment)
    strain, found = sense_strain(strain_chain, frame_estimate.sums, frame_estimate.state, watch)
    if frame_estimate.unusable_reason or frame_estimate.pixel_variance > TOO_NOISY:
        found = None  # what blurs a frame strains it, too
    if found is not None:
        found = with_motion_errors(found, MotionErrors(frame_estimate.pixel_variance))
    start = np.empty((0, 3)) if found is None else touches_of(found)
    after = replace(frame_estimate.state, from_strain=start)
    whole = replace(frame_estimate, strain=strain, from_strain=found, state=after)
    return _aligned(whole, alignment)


def _aligned(frame_estimate: FrameEstimate, alignment: Alignment | None) -> FrameEstimate:
    """Correct each estimate of a frame by what known presses have shown."""
    if alignment is None:
        return frame_estimate
    names = "estimate", "from_strain", "from_pattern"
    found = {name: getattr(frame_estimate, name) for name in names}
    corrected = {name: alignment.apply(one) for name, one in found.items() if one}
    return replace(frame_estimate, **corrected)
