"""What a bench was found on, and whether a scene with its calibration is that bench still.

The numbers of a bench are what it differs by from a plate and a camera as they are described. Where
these are described otherwise, or lens and pose were calibrated anew, they say nothing.
"""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Annotated, Literal

from pydantic import AwareDatetime, ConfigDict, Field

from rig.scene import Scene
from rig.scene.quantity import Count
from rig.scene.section import Section

if TYPE_CHECKING:
    from rig.calibration.store import Calibration

Positive = Annotated[float, Field(gt=0)]

_UNITS = {
    "size": " mm",
    "thickness": " mm",
    "young": " MPa",
    "tension": " N/mm",
    "sag": " mm",
    "pixels": " px",
    "stand_off": " mm",
}
_PLATE = (
    *("size", "thickness", "young", "poisson", "edges", "patches"),
    *("tension", "sag", "warp", "taper"),
)
_CAMERA = ("kind", "pixels", "side", "stand_off", "margin")


class FoundOn(Section):
    """Plate and camera from which the numbers of a bench count."""

    model_config = ConfigDict(strict=True)

    size: tuple[Positive, Positive] = Field(description="sides of the plate, mm")
    thickness: Positive = Field(description="of the plate, mm")
    young: Positive = Field(description="its modulus as described, MPa")
    poisson: float = Field(description="its ratio")
    edges: str = Field(description="how it is held, as JSON")
    patches: str = Field(description="its patches, as JSON")
    tension: tuple[float, float, float] = Field(
        (0.0, 0.0, 0.0), description="as described, along x, along y and in shear, N/mm"
    )
    sag: float = Field(0.0, description="as described, mm")
    warp: str = Field("[]", description="the rest of its shape, as JSON")
    taper: tuple[float, float] = Field((0.0, 0.0), description="of its thickness, fraction")
    kind: Literal["pinhole", "telecentric"] = Field(description="projection of the camera")
    pixels: tuple[Count, Count] = Field(description="width and height of the image, px")
    side: Literal["above", "below"] = Field(description="of the plate that the camera looks at")
    stand_off: Positive | None = Field(
        None, description="of the camera, mm; None where lens and pose are calibrated"
    )
    margin: float | None = Field(None, description="of its image, likewise")
    lens: AwareDatetime | None = Field(None, description="when the lens was calibrated")
    pose: AwareDatetime | None = Field(None, description="when the pose was calibrated")

    def difference(self, now: FoundOn) -> str | None:
        """Say in what a scene, with its calibration, is another bench; None where it is this one.

        Parameters
        ----------
        now : FoundOn
            What a bench of that scene would be found on.
        """
        for name in _PLATE + _CAMERA:
            before, after = getattr(self, name), getattr(now, name)
            if None not in (before, after) and before != after:
                key = f"{'plate' if name in _PLATE else 'camera'}.{name}"
                return _other(key, _text(name, before), _text(name, after))
        if (self.lens, self.pose) != (now.lens, now.pose):
            part = "lens" if self.lens != now.lens else "pose"
            return f"is not of the {part} that is calibrated now"
        return None


def found_on(scene: Scene, calibration: Calibration) -> FoundOn | None:
    """Return what a bench of a scene is found on; None of a scene without plate or camera."""
    plate, camera = scene.plate, scene.camera
    if plate is None or camera is None:
        return None
    lens, pose = calibration.lens, calibration.pose
    calibrated = lens is not None and pose is not None and lens.size == camera.pixels
    return FoundOn(
        size=plate.size,
        thickness=plate.thickness,
        young=plate.young,
        poisson=plate.poisson,
        edges=plate.edges.model_dump_json(exclude_defaults=True),
        patches=json.dumps([patch.model_dump(exclude_defaults=True) for patch in plate.patches]),
        tension=plate.tension_at_rest,
        sag=plate.sag,
        warp=json.dumps(plate.warp),
        taper=plate.taper,
        kind=camera.kind,
        pixels=camera.pixels,
        side=camera.side,
        stand_off=None if calibrated else camera.stand_off,
        margin=None if calibrated else camera.margin,
        lens=lens.date if lens and calibrated else None,
        pose=pose.date if pose and calibrated else None,
    )


def _other(key: str, before: str, after: str) -> str:
    return f"was found with {key} = {before}, and the scene has {after}"


def _text(name: str, value: str | float | tuple[float, ...]) -> str:
    if isinstance(value, str):
        return value
    numbers = value if isinstance(value, tuple) else (value,)
    between = " × " if name in ("size", "pixels") else ", "
    return between.join(f"{number:g}" for number in numbers) + _UNITS.get(name, "")
