"""The live chain: from a frame to touches, starting from what the last frame said."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

import synthetic
from dic.tile_field import TileBlocks, prepare_blocks, tile_displacement
from dic.tiles import TileReference, TileSums, prepare_tiles, tile_sums
from models.estimate import Estimate
from models.pattern import Motions, Pattern, see_pattern
from models.search import Search, prepare_search
from models.solver import find
from models.strain_map import StrainMap, see_strain
from rig.calibration.alignment import Alignment
from rig.stopwatch import Stopwatch
from rig.zero import Zero, fits, settle

STALE = 0.1  # px: a reference that was moved wrongly by more is moved again within the frame
PASSES = 3  # at most so often


@dataclass(frozen=True, eq=False)
class Chain:
    """Everything that is prepared once for a reference.

    Attributes
    ----------
    reference : TileReference
    pattern : Pattern
    search : Search
        Candidates of the forward model at the noise of the reference.
    noise : float, grey levels
    most : int
        Largest number of touches looked for.
    """

    reference: TileReference
    pattern: Pattern
    search: Search
    noise: float
    most: int


def prepare_chain(zero: Zero, motions: Motions, most: int) -> Chain:
    """Prepare the chain for a reference."""
    reference = prepare_tiles(zero.image, size=motions.tiles.size)
    pattern = see_pattern(motions, reference)
    return Chain(reference, pattern, prepare_search(pattern.forward(zero.noise)), zero.noise, most)


@dataclass(frozen=True, eq=False)
class StrainChain:
    """What estimates touches from the strain map of the same frames, and draws that map."""

    blocks: TileBlocks
    map: StrainMap
    search: Search
    noise: float
    most: int


def prepare_strain(chain: Chain, camera: synthetic.Camera, block: int, window: int) -> StrainChain:
    """Prepare strain over blocks of `block` tiles and windows of `window` blocks a side."""
    blocks = prepare_blocks(chain.reference, block)
    strain_map = see_strain(chain.pattern, blocks, camera, window)
    search = prepare_search(strain_map.forward(chain.noise))
    return StrainChain(blocks, strain_map, search, chain.noise, chain.most)


@dataclass(frozen=True, eq=False)
class State:
    """What the next frame starts from.

    Attributes
    ----------
    motion : (K + R,) float64
        Amplitudes of the plate's modes and of the camera's rigid motions.
    rest : (K,) float64
        Those of the modes while nothing touches: what the plate has crept to since the reference.
    touches : (n, 3) float64, mm, mm, N
        x, y, F.
    from_strain : (n, 3) float64, mm, mm, N
        Those that strain alone shows.
    """

    motion: NDArray[np.float64]
    rest: NDArray[np.float64]
    touches: NDArray[np.float64]
    from_strain: NDArray[np.float64]


def at_rest(chain: Chain) -> State:
    """Nothing moved and nothing touches."""
    none = np.empty((0, 3))
    return State(chain.pattern.still(), np.zeros(chain.pattern.count), none, none)


@dataclass(frozen=True, eq=False)
class Sensed:
    """What one frame says.

    Attributes
    ----------
    estimate : Estimate
        From the whole pattern.
    sums : TileSums
        Of the last pass.
    strain : (T, 3) float64, or None where the scene wants none
    from_strain : Estimate or None
        None where a part of the strain map is lost in this frame, by a hand for instance.
    state : State
        To start the next frame from.
    """

    estimate: Estimate
    sums: TileSums
    strain: NDArray[np.float64] | None
    from_strain: Estimate | None
    state: State


def sense(
    chain: Chain, image: NDArray, state: State, watch: Stopwatch, settling: float = 0.0
) -> tuple[Estimate, TileSums, State]:
    """Find the touches in one frame.

    Parameters
    ----------
    settling : float
        Part of what the frame shows that becomes the state of rest if nothing touches, from
        `zero.share`; 0 leaves it as it is.

    Returns
    -------
    Estimate
    TileSums
        Of the last pass, for displacement and strain of the same frame.
    State
        To start the next frame from.
    """
    for _ in range(PASSES - 1):
        estimate, sums, after = _pass(chain, image, state, watch, settling)
        if chain.pattern.motions.farthest(after.motion - state.motion) <= STALE:
            return estimate, sums, after
        state = replace(after, rest=state.rest)
    return _pass(chain, image, state, watch, settling)


def _pass(
    chain: Chain, image: NDArray, state: State, watch: Stopwatch, settling: float
) -> tuple[Estimate, TileSums, State]:
    pattern, rest = chain.pattern, state.rest
    with watch.stage("correlate"):
        sums = tile_sums(chain.reference, image, pattern.motions.flow(state.motion))
    with watch.stage("estimate"):
        right = pattern.right_side(sums, state.motion) - pattern.normal[:, : len(rest)] @ rest
        measured = pattern.whiten(right, chain.noise)
        estimate = find(measured, chain.search, start=state.touches, most=chain.most)
        motion = pattern.amplitudes(estimate, right)
        motion[: len(rest)] += rest
        if settling and not estimate.count and fits(estimate):
            rest = settle(rest, pattern, measured, chain.noise, settling)
    return estimate, sums, replace(state, motion=motion, rest=rest, touches=_places(estimate))


def sense_strain(
    chain: StrainChain, sums: TileSums, start: NDArray, watch: Stopwatch
) -> tuple[NDArray[np.float64], Estimate | None]:
    """Strain of one frame, (T, 3), and the touches that it shows, begun from `start` (n, 3).

    The touches are None where a part of the map is lost in this frame, by a hand for instance.
    """
    with watch.stage("strain"):
        field = tile_displacement(chain.blocks, sums, chain.noise)
        strain = chain.map.strain(field)
    with watch.stage("from strain"):
        measured = chain.map.whiten(strain, chain.noise)
        if measured is None:
            return strain, None
        return strain, find(measured, chain.search, start=start, most=chain.most)


def with_strain(
    strain_chain: StrainChain | None,
    sensed: tuple[Estimate, TileSums, State],
    watch: Stopwatch,
    alignment: Alignment | None = None,
) -> Sensed:
    """Add what strain says, where it is wanted, to what `sense` found in a frame, and mend it.

    The state stays as it was found: the next frame starts from what this one shows.
    """
    estimate, sums, after = sensed
    if alignment:
        estimate = alignment.apply(estimate)
    if strain_chain is None:
        return Sensed(estimate, sums, None, None, after)
    strain, found = sense_strain(strain_chain, sums, after.from_strain, watch)
    start = np.empty((0, 3)) if found is None else _places(found)
    return Sensed(estimate, sums, strain, found, replace(after, from_strain=start))


def _places(estimate: Estimate) -> NDArray[np.float64]:
    """x, y, F of each touch, (n, 3)."""
    return np.column_stack([estimate.xy, estimate.force])
