"""The live chain: from a frame to touches, starting from what the last frame said."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

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
from rig.stopwatch import Stopwatch

LEAST_NOISE = 0.05  # grey levels: less than the rounding of an 8-bit picture
STALE = 0.1  # px: a reference that was moved wrongly by more is moved again within the frame
PASSES = 3  # at most so often


@dataclass(frozen=True, eq=False)
class Zero:
    """The plate at rest: the mean of several frames, and the noise of a frame against it."""

    image: NDArray[np.float32]
    noise: float


def take_zero(frames: Sequence[NDArray]) -> Zero:
    """Average frames of the untouched plate, two or more, and measure their noise.

    The noise is that of a frame less the mean of N others, σ √(1 + 1/N), grey levels.

    Raises
    ------
    ValueError
        If there are fewer than two frames.
    """
    if len(frames) < 2:
        raise ValueError(
            f"reference needs 2 frames or more to know their noise, got {len(frames)}; set"
            " dic.reference_frames to 16"
        )
    mean = np.asarray(np.mean(frames, axis=0), dtype=np.float32)
    count = len(frames)
    squares = sum(float(np.square(frame - mean).sum(dtype=np.float64)) for frame in frames)
    variance = squares / (mean.size * (count - 1))
    return Zero(mean, max(float(np.sqrt(variance * (1 + 1 / count))), LEAST_NOISE))


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
    """What the next frame starts from: amplitudes of the motion, and x, y, F of the touches."""

    motion: NDArray[np.float64]
    touches: NDArray[np.float64]


def at_rest(chain: Chain) -> State:
    """Nothing moved and nothing touches."""
    return State(chain.pattern.still(), np.empty((0, 3)))


def sense(
    chain: Chain, image: NDArray, state: State, watch: Stopwatch
) -> tuple[Estimate, TileSums, State]:
    """Find the touches in one frame.

    Returns
    -------
    Estimate
    TileSums
        Of the last pass, for displacement and strain of the same frame.
    State
        To start the next frame from.
    """
    for _ in range(PASSES - 1):
        estimate, sums, after = _pass(chain, image, state, watch)
        if chain.pattern.motions.farthest(after.motion - state.motion) <= STALE:
            return estimate, sums, after
        state = after
    return _pass(chain, image, state, watch)


def _pass(
    chain: Chain, image: NDArray, state: State, watch: Stopwatch
) -> tuple[Estimate, TileSums, State]:
    pattern = chain.pattern
    with watch.stage("correlate"):
        sums = tile_sums(chain.reference, image, pattern.motions.flow(state.motion))
    with watch.stage("estimate"):
        right = pattern.right_side(sums, state.motion)
        measured = pattern.whiten(right, chain.noise)
        estimate = find(measured, chain.search, start=state.touches, most=chain.most)
        motion = pattern.amplitudes(estimate, right)
    return estimate, sums, State(motion, np.column_stack([estimate.xy, estimate.force]))


def sense_strain(
    chain: StrainChain, sums: TileSums, last: Estimate | None, watch: Stopwatch
) -> tuple[NDArray[np.float64], Estimate | None]:
    """Strain of one frame, (T, 3), and the touches that it shows.

    The touches are None where a part of the map is lost in this frame, by a hand for instance.
    """
    with watch.stage("strain"):
        field = tile_displacement(chain.blocks, sums, chain.noise)
        strain = chain.map.strain(field)
    with watch.stage("from strain"):
        measured = chain.map.whiten(strain, chain.noise)
        if measured is None:
            return strain, None
        start = np.empty((0, 3)) if last is None else np.column_stack([last.xy, last.force])
        return strain, find(measured, chain.search, start=start, most=chain.most)
