"""What may be other than the scene says, and which numbers of a bench it is made of."""

from __future__ import annotations

import fe
from models.forward.camera_change import CAMERA

_LENS, _FOCAL, _STAND_OFF = ("k1", "k2"), ("focal",), ("shift_z",)
_POSE = tuple(name for name, _ in CAMERA if name not in (*_LENS, *_FOCAL, *_STAND_OFF))


def _starting(*starts: str) -> tuple[str, ...]:
    return tuple(name for name, _ in fe.BENCH_PARAMETERS if name.startswith(starts))


CAUSES: dict[str, tuple[str, ...]] = {
    "clamps that give": _starting("rotation", "membrane"),
    "a plate that is not flat": _starting("sag"),
    "tension in the plate": _starting("tension"),
    "the thickness": ("thickness",),
    "uneven thickness": _starting("thickness_"),
    "the camera's pose": _POSE,
    "the stand-off": _STAND_OFF,
    "the focal length": _FOCAL,
    "the lens": _LENS,
}
"""Numbers of the bench by what they are; not Young's modulus, of which touches of unknown force
tell nothing."""
