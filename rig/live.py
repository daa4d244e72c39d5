"""The live chain: from a frame to touches, starting from what the last frame said."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

import fe
import synthetic
from dic.tile_field import TileBlocks, prepare_blocks, tile_displacement
from dic.tiles import TileReference, TileSums, prepare_tiles, tile_sums
from models.estimate import Estimate
from models.pattern import Pattern, see_pattern
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

    image: NDArray[np.float64]
    noise: float


def take_zero(frames: Sequence[NDArray]) -> Zero:
    """Average frames of the untouched plate, two or more, and measure their noise.

    The noise is that of a frame less the mean of N others, σ √(1 + 1/N), grey levels.
    """
    stack = np.stack(frames).astype(np.float32)
    spread = float(np.sqrt(stack.var(axis=0, ddof=1, dtype=np.float64).mean()))
    noise = max(spread * np.sqrt(1 + 1 / len(frames)), LEAST_NOISE)
    return Zero(stack.mean(axis=0, dtype=np.float64), noise)


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


def prepare_chain(
    zero: Zero, modes: fe.Modes, camera: synthetic.Camera, height: float, tile: int, most: int
) -> Chain:
    """Prepare the chain for a reference; `height` (mm) is that of the seen face."""
    reference = prepare_tiles(zero.image, size=tile)
    pattern = see_pattern(modes, camera, height, reference)
    return Chain(reference, pattern, prepare_search(pattern.forward(zero.noise)), zero.noise, most)


@dataclass(frozen=True, eq=False)
class StrainChain:
    """What estimates touches from the strain map of the same frames, and draws that map."""

    blocks: TileBlocks
    map: StrainMap
    search: Search
    noise: float
    most: int


def prepare_strain(
    chain: Chain, camera: synthetic.Camera, block: int, window: int
) -> StrainChain:
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
    pattern = chain.pattern
    for _ in range(PASSES):
        with watch.stage("correlate"):
            sums = tile_sums(chain.reference, image, pattern.flow(state.motion))
        with watch.stage("estimate"):
            right = pattern.right_side(sums, state.motion)
            measured = pattern.whiten(right, chain.noise)
            estimate = find(measured, chain.search, start=state.touches, most=chain.most)
            motion = pattern.motion(estimate, right)
        stale = pattern.change(motion - state.motion) > STALE
        state = State(motion, np.column_stack([estimate.xy, estimate.force]))
        if not stale:
            break
    return estimate, sums, state


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
