"""Two cameras: frames that were taken at the same moment, ``for pair in rig.frame_pairs(a, b)``."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import dataclass

from rig.scene import Scene
from rig.sources.open_source import open_input
from rig.system.frame import Frame, Source

LOG = logging.getLogger("touchplate")
WITHIN = 1e-3  # s
SILENCE = 2.0  # s that a camera may give nothing
PATIENCE = 100  # frames in a row that may be without a partner


@dataclass(frozen=True)
class FramePair:
    """Two frames that were taken at the same moment.

    Attributes
    ----------
    first, second : rig.system.frame.Frame
    alone : int
        Frames of either camera without a partner since the last pair.
    """

    first: Frame
    second: Frame
    alone: int

    @property
    def apart(self) -> float:
        """How much later the second was taken, s."""
        return self.second.captured - self.first.captured


def frame_pairs(first: Scene, second: Scene, within: float = WITHIN) -> Iterator[FramePair]:
    """Open the sources of two scenes, and give the frames of both that belong together.

    Cameras that one pulse triggers do: set `source.trigger` in both scenes, and the board that
    sends the pulses in the first. The sources are closed when the iteration ends in any way.

    Parameters
    ----------
    first, second : Scene
        Of each the source alone is opened.
    within : float, s
        Times of capture of a pair differ by no more. They are those of the cameras, on the clock of
        this machine.

    Yields
    ------
    FramePair

    Raises
    ------
    OSError
        A camera is missing or falls silent, or no two frames are within `within`.
    ValueError
        `within` is not positive, or a scene has no source.
    """
    if not within > 0:
        raise ValueError(f"within must be more than 0 s, got {within:g} s; 0.001 is usual")
    with ExitStack() as opened:
        sources = [
            opened.enter_context(open_input(scene, LOG.warning))[0] for scene in (first, second)
        ]
        yield from matched(sources[0], sources[1], within)


def matched(first: Source, second: Source, within: float) -> Iterator[FramePair]:
    """Give the frames of two sources that were taken within `within` s, until one of them ends.

    Raises
    ------
    OSError
        As `frame_pairs`.
    """
    alone, nearest = 0, float("inf")
    try:
        one, other = _next(first), _next(second)
        while True:
            pair = FramePair(one, other, alone)
            if abs(pair.apart) <= within:
                yield pair
                alone, nearest = 0, float("inf")
                one, other = _next(first), _next(second)
                continue
            alone, nearest = alone + 1, min(nearest, abs(pair.apart))
            if alone > PATIENCE:
                raise OSError(
                    f"no two of the last {PATIENCE} frames are within {1e3 * within:g} ms, the"
                    f" nearest {1e3 * nearest:.3g} ms; trigger both cameras by one pulse"
                    " (source.trigger), or allow more (within)"
                )
            if pair.apart > 0:
                one = _next(first)
            else:
                other = _next(second)
    except EOFError:
        return


def _next(source: Source) -> Frame:
    frame = source.grab(SILENCE)
    if frame is None:
        raise OSError(f"no frame came in {SILENCE:g} s: {source.status}")
    return frame
