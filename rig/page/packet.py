"""A snapshot as it goes over the wire: one JSON text and the binary parts that it announces.

Parts are made when a page first asks for them and shared by all pages, in the server's thread.
"""

import json
import math
from collections.abc import Iterable
from dataclasses import asdict
from functools import cached_property
from typing import Any, Protocol, cast

import cv2
import numpy as np
from numpy.typing import NDArray

from rig.live.snapshot import Mark, Snapshot, StrainOverlay
from rig.page.controls import PageControls
from rig.projector.content import Content, draw
from rig.projector.markers import Screen, project

JPEG_QUALITY = 80
NOTHING = PageControls()
STEP = 128  # px: widths are rounded up to whole steps, so that pages of like width get the same
BRIGHTENED = 3  # the projector is dim on purpose, and a page that is watched by day need not be


class Wire(Protocol):
    """What goes to the pages: a text, and the binary parts that it announces."""

    def parts(self, wanted: str) -> dict[str, bytes]:
        """Binary parts among those that are wanted and exist."""
        ...

    def header(self, parts: dict[str, bytes], controls: bool) -> str:
        """JSON text that goes before the given parts."""
        ...


class CameraImage:
    """An image as pages get it: no larger than they show it, made once for all of like width."""

    def __init__(self, image: NDArray[np.uint8]):
        self._image = image
        self._made: dict[int, bytes] = {}

    def jpeg(self, across: str) -> bytes:
        """JPEG of the image, as many px wide as `across` says, rounded up; whole if it is empty."""
        height, width = self._image.shape
        wide = -(-int(across) // STEP) * STEP if across.isdecimal() else width
        wide = max(min(wide, width), 1)
        if wide not in self._made:
            size = wide, max(round(height * wide / width), 1)
            self._made[wide] = _jpeg(_resized(self._image, size))
        return self._made[wide]


class Packet:
    """The wire form of one snapshot.

    Parameters
    ----------
    snapshot : Snapshot
        What the loop published.
    screen : Screen or None
        The projector's image, where the scene has a projector.
    page_controls : PageControls
        What stands beside the frame.
    shown : Content or None
        What the projector shows; None if that is the touches.
    """

    def __init__(
        self,
        snapshot: Snapshot,
        screen: Screen | None,
        page_controls: PageControls = NOTHING,
        shown: Content | None = None,
    ):
        self.snapshot = snapshot
        self.screen = screen
        self.page_controls = page_controls
        self.shown: Content = snapshot.touches if shown is None else shown
        self._image = CameraImage(snapshot.image)

    def parts(self, wanted: str) -> dict[str, bytes]:
        """Binary parts among ``camera``, ``strain`` and ``projector`` that are wanted and exist.

        ``camera`` and ``projector`` (brightened) are JPEG images; ``strain`` is exx, eyy and
        exy one after the other, (3, R, C) little-endian float32.

        Parameters
        ----------
        wanted : str
            Names; ``camera:600`` is content with an image of 600 px or more across.
        """
        words = (word.partition(":") for word in wanted.split())
        asked = {name: across for name, _, across in words}
        parts: dict[str, bytes] = {}
        if "camera" in asked:
            parts["camera"] = self._image.jpeg(asked["camera"])
        if "projector" in asked and self.screen is not None:
            parts["projector"] = self._projector
        if "strain" in asked and self.snapshot.strain is not None:
            parts["strain"] = self._strain
        return parts

    def header(self, parts: dict[str, bytes], controls: bool) -> str:
        """JSON text that goes before the given parts and names them in order.

        It says too whether who gets it may act.
        """
        added = f', "controls": {json.dumps(controls)}, "parts": {json.dumps(list(parts))}}}'
        return self.described[:-1] + added

    @cached_property
    def described(self) -> str:
        """JSON text of all that is no image and no map."""
        return json.dumps(
            plain(_describe(self.snapshot, self.screen) | asdict(self.page_controls)),
            allow_nan=False,
        )

    @cached_property
    def _projector(self) -> bytes:
        if self.screen is None:
            return b""
        drawn = draw(self.shown, self.screen)[..., ::-1]
        return _jpeg(np.minimum(drawn, 255 // BRIGHTENED) * BRIGHTENED)

    @cached_property
    def _strain(self) -> bytes:
        strain = self.snapshot.strain
        if strain is None:
            return b""
        return np.stack([strain.exx, strain.eyy, strain.exy]).astype("<f4").tobytes()


def _resized(image: NDArray[np.uint8], size: tuple[int, int]) -> NDArray[np.uint8]:
    if image.shape == size[::-1]:
        return image
    return np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_AREA), np.uint8)


def _jpeg(image: NDArray[np.uint8]) -> bytes:
    return cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])[1].tobytes()


def _describe(shot: Snapshot, screen: Screen | None) -> dict[str, Any]:
    """All of the snapshot that is text or a few numbers."""
    height, width = shot.image.shape
    return {
        "sequence": shot.sequence,
        "captured": shot.captured,
        "size": (width, height),
        "plate": shot.plate_size,
        "outline": shot.plate_outline,
        "T_px_plate": shot.T_px_plate,
        "touches": _marks(shot.touches),
        "from_strain": None if shot.from_strain is None else _marks(shot.from_strain),
        "truth": None if shot.truth is None else _marks(shot.truth),
        "strain": None if shot.strain is None else _grid(shot.strain),
        "strain_reason": shot.strain_reason,
        "projector": None if screen is None else _projection(shot.plate_size, screen),
        "status": shot.status,
        "fresh": shot.fresh,
        "position_error": (shot.position_error, shot.position_error_median),
        "force_error": (shot.force_error, shot.force_error_median),
        "fps": shot.fps,
        "dropped": shot.dropped,
        "stages": shot.stages,
        "latency": shot.latency,
        "noise": shot.noise,
        "signs": [asdict(sign) for sign in shot.signs],
        "learned": shot.learned.summary if shot.learned else None,
        "base": asdict(shot.base) if shot.base else None,
        "gestures": [asdict(gesture) for gesture in shot.gestures],
        "taps": [asdict(tap) for tap in shot.recent_taps],
        "alarms": [asdict(alarm) for alarm in shot.alarms],
    }


def _marks(marks: tuple[Mark, ...]) -> list[dict[str, Any]]:
    return [asdict(mark) for mark in marks]


def _grid(strain: StrainOverlay) -> dict[str, Any]:
    return {
        "x": (strain.xs[0], strain.xs[-1]),
        "y": (strain.ys[0], strain.ys[-1]),
        "shape": strain.exx.shape,
        "sigma": strain.sigma,
    }


def _projection(plate_size: tuple[float, float], screen: Screen) -> dict[str, Any]:
    a, b = plate_size
    corners = np.array([[0.0, 0.0], [a, 0.0], [a, b], [0.0, b]])
    return {"size": screen.size, "outline": project(screen.T_px_plate, corners)}


def plain(value: Any) -> Any:
    """Return numbers as JSON knows them: what is not finite becomes null."""
    match value:
        case dict():
            named = cast("dict[str, Any]", value)
            return {name: plain(part) for name, part in named.items()}
        case list() | tuple():
            return [plain(part) for part in cast("Iterable[Any]", value)]
        case np.ndarray() | np.generic():
            return plain(value.tolist())
        case float() if not math.isfinite(value):
            return None
        case _:
            return value
