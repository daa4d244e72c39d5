"""A touch that is held still for some frames, of which a bench is learned."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import hypot

import numpy as np
from scipy.linalg import solve_triangular

from models import Result, Traces
from rig.live.baseline import is_consistent
from rig.live.chain import Chain
from rig.live.frame_estimate import FrameEstimate
from rig.system.arrays import F64, Mask

ELSEWHERE = 15.0
"""Distance from the touch before, mm, from which on a touch says something new."""
_STILL, _STEADY = 1.5, 0.1  # mm and fraction of the force between frames of one touch


@dataclass(frozen=True, eq=False)
class HeldTouch:
    """A touch that is held: its first place and force, and what frames have shown so far.

    Attributes
    ----------
    touch : (3,) float64, mm, mm, N
    shown : tuple of (m,) float64
        What each frame has shown, whitened as of the whole pattern.
    moved : (R,) float64 or None
        What the camera has moved by in the last of them, see `TilePattern.uncorrected`.
    left : Traces
        What the plate showed of touches before.
    came_alone : bool
        Whether the frame before showed no touch beside it.
    """

    touch: F64
    shown: tuple[F64, ...]
    moved: F64 | None
    left: Traces
    came_alone: bool


def steady_touch(found: FrameEstimate) -> F64 | None:
    """Return the only touch of a frame (3,), in mm and N; None if it is not clear and fitted."""
    estimate = found.estimate
    if (
        estimate.result is not Result.FOUND
        or estimate.count != 1
        or not found.whole_and_clear
        or not is_consistent(estimate)
    ):
        return None
    return np.array([*estimate.xy[0], estimate.force[0]])


def hold(
    held: HeldTouch | None, touch: F64, found: FrameEstimate, chain: Chain, before: F64 | None
) -> HeldTouch | None:
    """Add a frame with one touch (3,) to what is held, or begin with it where it is another touch.

    `before` are the places (n, 2) of the frame before, where they are known. None where the frame
    shows nothing that was measured.
    """
    if found.measured is None:
        return None
    shown = _of_whole_pattern(found.measured, found.hidden, chain)
    moved = chain.pattern.uncorrected(found.state.motion)
    if held is None or not _same(held.touch, touch):
        alone = before is not None and is_apart(touch, before)
        return HeldTouch(touch, (shown,), moved, found.state.memory.left, alone)
    return replace(held, shown=(*held.shown, shown), moved=moved)


def is_apart(touch: F64, places: F64) -> bool:
    """Whether none of some places (n, 2) is near a touch."""
    return bool((np.hypot(*(places - touch[:2]).T) > ELSEWHERE).all())


def _of_whole_pattern(measured: F64, hidden: Mask, chain: Chain) -> F64:
    """Whiten what a frame with a few hidden tiles shows as if these had shown the same."""
    if not hidden.any():
        return measured
    visible = chain.masked_models.pattern_for(hidden).factor
    amplitudes = solve_triangular(visible, measured, lower=True, trans=1, check_finite=False)
    return np.asarray(chain.pattern.factor.T @ amplitudes, dtype=np.float64)


def _same(before: F64, touch: F64) -> bool:
    """Whether a touch is the one before, held still."""
    moved = hypot(*(touch[:2] - before[:2]))
    return moved < _STILL and abs(touch[2] - before[2]) < _STEADY * before[2]
