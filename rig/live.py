"""The live chain: from a frame to touches, starting from what the last frame said."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

import fe
import synthetic
from dic.tiles import TileReference, TileSums, prepare_tiles, tile_sums
from models.estimate import Estimate
from models.pattern import Pattern, see_pattern
from models.search import Search, prepare_search
from models.solve import find

STALE = 0.2  # px: a reference moved wrongly by more is moved again within the frame
PASSES = 3  # at most so often


@dataclass(frozen=True, eq=False)
class Zero:
    """The plate at rest: the mean of several frames and the noise of one."""

    image: NDArray[np.float64]
    noise: float
    frames: int


def take_zero(frames: Sequence[NDArray]) -> Zero:
    """Average frames of the untouched plate, two or more, and measure their noise.

    Returns
    -------
    Zero
        The noise is that of a frame less the mean: σ √(1 + 1/N), grey levels.
    """
    stack = np.stack(frames).astype(np.float32)
    spread = float(np.sqrt(stack.var(axis=0, ddof=1, dtype=np.float64).mean()))
    return Zero(
        stack.mean(axis=0, dtype=np.float64), spread * np.sqrt(1 + 1 / len(frames)), len(frames)
    )


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
    zero: Zero,
    modes: fe.Modes,
    camera: synthetic.Camera,
    height: float,
    tile: int,
    most: int,
) -> Chain:
    """Prepare the chain for a reference; `height` (mm) is that of the seen face."""
    reference = prepare_tiles(zero.image, size=tile)
    pattern = see_pattern(modes, camera, height, reference)
    noise = max(zero.noise, 1e-3)
    return Chain(reference, pattern, prepare_search(pattern.forward(noise)), noise, most)


@dataclass(frozen=True, eq=False)
class State:
    """What the next frame starts from: amplitudes of the motion, and the touches."""

    motion: NDArray[np.float64]
    flow: NDArray[np.float64]
    touches: tuple[tuple[float, float, float], ...]


def at_rest(chain: Chain) -> State:
    """Nothing moved and nothing touches."""
    still = chain.pattern.still()
    return State(still, chain.pattern.flow(still), ())


def sense(chain: Chain, image: NDArray, state: State) -> tuple[Estimate, TileSums, State]:
    """Find the touches in one frame.

    Returns
    -------
    Estimate
    TileSums
        Of the last pass, for strain and displacement of the same frame.
    State
        To start the next frame from.
    """
    for _ in range(PASSES):
        sums = tile_sums(chain.reference, image, state.flow)
        measured = chain.pattern.whiten(sums, state.motion, chain.noise)
        estimate = find(measured, chain.search, start=state.touches, most=chain.most)
        before = state.flow
        state = _next(chain, estimate, sums, state)
        if np.abs(state.flow - before).max() <= STALE:
            break
    return estimate, sums, state


def _next(chain: Chain, estimate: Estimate, sums: TileSums, state: State) -> State:
    motion = chain.pattern.motion(estimate, sums, state.motion)
    touches = tuple(
        (float(x), float(y), float(force))
        for (x, y), force in zip(estimate.xy, estimate.force, strict=True)
    )
    return State(motion, chain.pattern.flow(motion), touches)
