"""Leads through a guided calibration: frames in, images for the projector and words out."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from time import monotonic

from rig.calibration.guide import Guide, Progress
from rig.calibration.results import Part
from rig.projector.content import Content
from rig.system.frame import Frame, Source

SLICE = 0.004  # s; so late does the projector get something new, whatever the rate of the frames
PATIENCE = 5.0  # s without a frame


def lead(
    guide: Guide,
    source: Source,
    show: Callable[[Content], object],
    progress: Callable[[Progress, Frame], object],
    dropped: Callable[[], Iterable[int]],
) -> Part:
    """Run a guide on a source until it has its result.

    Parameters
    ----------
    guide : Guide
    source : Source
    show : callable
        Takes what the projector is to show.
    progress : callable
        Takes the progress after each frame, and the frame.
    dropped : callable
        Gives the views that the user took out since it was last called.

    Raises
    ------
    OSError
        If no frame comes for `PATIENCE` s.
    ValueError
        If what was taken determines nothing, or the source ends too early.
    """
    heard = monotonic()
    while (part := guide.result()) is None:
        show(guide.shows)
        for view in dropped():
            guide.drop(view)
        try:
            frame = source.grab(SLICE)
        except EOFError as end:
            raise ValueError(f"{end}; the calibration needs more images") from None
        if frame:
            heard = monotonic()
            guide.add_frame(frame)
            progress(guide.progress, frame)
        elif monotonic() - heard > PATIENCE:
            raise OSError(f"no frame came for {PATIENCE:g} s; {source.status}")
    return part
