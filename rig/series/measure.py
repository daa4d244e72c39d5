"""The displacement field of a frame, by the estimator that is asked for."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    import dic
    from models import FieldNet, ImageNet, NetField
    from rig.system.arrays import AnyArray, Mask

FieldKind = Literal["subset", "split", "adaptive", "net", "image-net"]
"""One subset for all points; that, or across a break its larger side; windows that the data choose;
or those, corrected by a net."""

if TYPE_CHECKING:
    FieldEstimator = FieldKind | FieldNet | ImageNet
    """A kind, whose net is that of the package, or a net that was read from a file."""

BY_NETS = ("net", "image-net")

BLOCK = 160  # px, side of the largest block of an adaptive field: errors farther apart are free


@dataclass(frozen=True, eq=False)
class FrameField:
    """The displacement of a frame, and what a net has said of it.

    Attributes
    ----------
    disp : dic.DisplacementField
    by_net : (N,) bool or None
        Points of the net; None where none is asked for.
    reason : str
        Whose the other points are and why, one sentence; empty where no net is asked for.
    """

    disp: dic.DisplacementField
    by_net: Mask | None = None
    reason: str = ""

    @property
    def fraction(self) -> float | None:
        """Fraction of the measured points that are those of the net; None without a net."""
        if self.by_net is None:
            return None
        return int(self.by_net.sum()) / max(int(self.disp.valid.sum()), 1)


def kind_of(estimator: FieldEstimator) -> FieldKind:
    """Name what measures a field."""
    if isinstance(estimator, str):
        return estimator
    from models import FieldNet

    return "net" if isinstance(estimator, FieldNet) else "image-net"


def fingerprint_of(estimator: FieldEstimator) -> str:
    """SHA-256 of the weights of a net that was read from a file; empty for a kind."""
    if isinstance(estimator, str):
        return ""
    digest = hashlib.sha256()
    for name, array in sorted(estimator.weights.items()):
        digest.update(name.encode() + array.tobytes())
    return digest.hexdigest()


def measure(
    ref: dic.Reference,
    image: AnyArray,
    estimator: FieldEstimator,
    guess: tuple[float, float] | None = None,
) -> FrameField:
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
    match estimator:
        case "subset":
            return FrameField(dic.correlate(ref, image, start))
        case "split":
            return FrameField(dic.correlate_split(ref, image, start))
        case "adaptive":
            return FrameField(dic.adaptive_field(ref, image, start))
        case _:
            found = _by_net(ref, image, estimator)
            return FrameField(found.field, found.by_net, found.reason)


def _by_net(
    ref: dic.Reference,
    image: AnyArray,
    estimator: Literal["net", "image-net"] | FieldNet | ImageNet,
) -> NetField:
    from models import FieldNet, image_net_field, net_field

    match estimator:
        case "net":
            return net_field(ref, image)
        case "image-net":
            return image_net_field(ref, image)
        case FieldNet():
            return net_field(ref, image, estimator)
        case _:
            return image_net_field(ref, image, estimator)


def unreadable_net(estimator: FieldEstimator) -> str:
    """Say why the net of the package cannot be read; empty where it can, or none is asked for."""
    if estimator not in BY_NETS:
        return ""
    from models import shipped_image_net, shipped_net

    try:
        shipped_net() if estimator == "net" else shipped_image_net()
    except (OSError, ValueError) as error:
        return str(error)
    return ""


def nothing_measured(found: dic.DisplacementField, image: AnyArray) -> str:
    """Say what is the matter with a frame in which no point was measured; empty otherwise."""
    if found.valid.any():
        return ""
    import dic

    clipped = dic.clipped_status(image)
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
