"""A step of the setup as it goes over the wire: one JSON text, and the camera's image."""

from __future__ import annotations

import json
from dataclasses import asdict
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from rig.page.packet import CameraImage, plain
from rig.page.setup_view import StepLine, StepView


class SetupPacket:
    """The wire form of a step; see `Wire`.

    Parameters
    ----------
    view : StepView
    steps : tuple of StepLine
        All of them.
    image : (H, W) uint8 or None
        What the camera sees, where it is open.
    """

    def __init__(
        self, view: StepView, steps: tuple[StepLine, ...], image: NDArray[np.uint8] | None
    ):
        self.view, self.steps = view, steps
        self._size = None if image is None else image.shape[::-1]
        self._image = None if image is None else CameraImage(image)

    def parts(self, wanted: str) -> dict[str, bytes]:
        """See `Wire`; of its parts there is ``camera``, ``camera:600`` where 600 px are enough."""
        name, _, across = wanted.partition(":")
        if self._image is None or name != "camera":
            return {}
        return {"camera": self._image.jpeg(across)}

    def header(self, parts: dict[str, bytes], controls: bool) -> str:
        """See `Wire`."""
        added = f', "controls": {json.dumps(controls)}, "parts": {json.dumps(list(parts))}}}'
        return self._described[:-1] + added

    @cached_property
    def _described(self) -> str:
        said = {
            "view": asdict(self.view),
            "steps": [asdict(step) for step in self.steps],
            "size": self._size,
        }
        return json.dumps(plain(said), allow_nan=False)
