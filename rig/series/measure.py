"""The displacement field of a frame, by the estimator that is asked for."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    import dic
    from rig.system.arrays import AnyArray

FieldKind = Literal["subset", "split", "adaptive", "net", "image-net"]
"""One subset for all points; that, or across a break its larger side; windows that the data choose;
or those, corrected by a net."""

_MOSTLY = 2 / 3  # fraction of a frame at black or at white, as of a subset
_WHITE = tuple(2**bits - 1 for bits in (8, 10, 12, 14, 16))  # where cameras clip

BLOCK = 160  # px, side of the largest block of an adaptive field: errors farther apart are free


def measure(
    ref: dic.Reference,
    image: AnyArray,
    kind: FieldKind,
    guess: tuple[float, float] | None = None,
) -> dic.DisplacementField:
    """Measure the displacement of every point of a reference in a frame.

    `guess` is the motion (u, v) px that all points start from, which the nets do not take; without
    it they are searched for.

    Raises
    ------
    ValueError
        As `dic.correlate`; or there is no torch, which the nets need.
    """
    import numpy as np

    import dic

    start = None if guess is None else np.tile(np.array(guess), (len(ref.xy), 1))
    match kind:
        case "subset":
            return dic.correlate(ref, image, start)
        case "split":
            return dic.correlate_split(ref, image, start)
        case "adaptive":
            return dic.adaptive_field(ref, image, start)
        case "net":
            from models import net_field

            return net_field(ref, image).field
        case "image-net":
            from models import image_net_field

            return image_net_field(ref, image).field


def nothing_measured(found: dic.DisplacementField, image: AnyArray) -> str:
    """Say what is the matter with a frame in which no point was measured; empty otherwise."""
    if found.valid.any():
        return ""
    clipped = _clipped(image)
    if clipped is not None:
        return f"no point was measured, the frame is {clipped.name}: {clipped.sentence}"
    usual = _usual(found.status)
    return f"no point was measured, most are {usual.name}: {usual.sentence}"


def require_points(ref: dic.Reference) -> None:
    """Refuse a reference of which no point can be measured, whatever the frame.

    Raises
    ------
    ValueError
        One sentence on what most of its points are.
    """
    import dic

    if not (ref.status == dic.Status.OK).any():
        usual = _usual(ref.status)
        raise ValueError(f"no point can be measured, most are {usual.name}: {usual.sentence}")


def _usual(status: AnyArray) -> dic.Status:
    """Most frequent status of those that the ROI leaves in; EXCLUDED if it leaves none."""
    import numpy as np

    import dic

    names, counts = np.unique(status[status != dic.Status.EXCLUDED], return_counts=True)
    return dic.Status(names[counts.argmax()]) if len(names) else dic.Status.EXCLUDED


def _clipped(image: AnyArray) -> dic.Status | None:
    """Whether a frame is black or white for the most part; None of one whose range is unknown."""
    import numpy as np

    import dic

    if not np.issubdtype(image.dtype, np.integer):
        return None
    if np.mean(image == 0) > _MOSTLY:
        return dic.Status.DARK
    brightest = int(image.max())
    if brightest in _WHITE and np.mean(image == brightest) > _MOSTLY:
        return dic.Status.SATURATED
    return None
