"""The displacement field of a frame, by the estimator that is asked for."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    import dic
    from rig.system.arrays import AnyArray

FieldKind = Literal["subset", "split", "adaptive", "net", "image-net"]
"""One subset for all points; that, or across a break its larger side; windows that the data choose;
or those, corrected by a net."""

BLOCK = 160  # px, side of the largest block of an adaptive field: errors farther apart are free


def measure(ref: dic.Reference, image: AnyArray, kind: FieldKind) -> dic.DisplacementField:
    """Measure the displacement of every point of a reference in a frame.

    Raises
    ------
    ValueError
        As `dic.correlate`; or there is no torch, which the nets need.
    """
    import dic

    match kind:
        case "subset":
            return dic.correlate(ref, image)
        case "split":
            return dic.correlate_split(ref, image)
        case "adaptive":
            return dic.adaptive_field(ref, image)
        case "net":
            from models import net_field

            return net_field(ref, image).field
        case "image-net":
            from models import image_net_field

            return image_net_field(ref, image).field


def nothing_measured(found: dic.DisplacementField) -> str:
    """Say what is the matter with a frame in which no point was measured; empty otherwise."""
    import numpy as np

    import dic

    if found.valid.any():
        return ""
    asked = found.status[found.status != dic.Status.EXCLUDED]
    names, counts = np.unique(asked, return_counts=True)
    usual = dic.Status(names[counts.argmax()]) if len(names) else dic.Status.EXCLUDED
    return f"no point was measured, most are {usual.name}: {usual.sentence}"
