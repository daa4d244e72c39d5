"""The frames that a loop begins with: the plate at rest, and how fast they come."""

from __future__ import annotations

from rig.live.baseline import ReferenceFrame, average_reference, moved_during_reference
from rig.system.frame import Frame, Source

PATIENCE = 5.0  # s without a frame after which a source is given up before the reference is there
ATTEMPTS = 30  # series of reference frames that are thrown away because something moved


def take_reference(source: Source, count: int) -> tuple[ReferenceFrame, float]:
    """Average the first frames of a source in which nothing moves.

    Returns
    -------
    ReferenceFrame
    pace : float, s
        From one of these frames to the next.

    Raises
    ------
    OSError
        If no frame comes for `PATIENCE` seconds.
    ValueError
        If something touched the plate or moved in every series of frames.
    """
    for moved in range(ATTEMPTS):
        frames = [_next(source, moved, count) for _ in range(count)]
        if any(frame.truth for frame in frames):
            raise ValueError(
                "plate was touched while the reference was taken; let nothing touch it in the"
                f" first {count} frames"
            )
        images = [frame.image for frame in frames]
        if not moved_during_reference(images):
            pace = (frames[-1].captured - frames[0].captured) / (len(frames) - 1)
            return average_reference(images), pace
    raise ValueError(
        f"something moved in the image in each of {ATTEMPTS} series of reference frames;"
        " leave the plate alone, or set camera exposure longer if its light flickers"
    )


def _next(source: Source, moved: int, count: int) -> Frame:
    """Give the next frame, after something moved in so many series of `count` frames."""
    try:
        frame = source.grab(PATIENCE)
    except EOFError as end:
        why = f", after something moved in {moved} series of {count} frames" if moved else ""
        raise OSError(f"{end}, and the reference takes more{why}; give more images") from None
    if frame is None:
        raise OSError(f"{source.status}; none came for {PATIENCE:g} s, look after it")
    return frame
