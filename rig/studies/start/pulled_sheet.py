"""Photographs of a sheet with a round hole that is pulled step by step, and its exact lengths."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

import synthetic
from rig.system.arrays import F64
from synthetic.closed_forms import Hole

SIZE, PIXELS = (120.0, 90.0), (800, 600)  # mm, px
RADIUS, CENTRE = 9.0, (60.0, 45.0)  # mm
PULL = 5e-3  # strain along x in the last image, far from the hole
NOISE = 2.0  # grey levels
_FINER = 4  # the rim is drawn so many times finer than the pixels
_ROOM = 20  # grey level of what is seen through the hole


@dataclass(frozen=True)
class PulledSheet:
    """The sheet under its camera.

    Attributes
    ----------
    camera : synthetic.Camera
    steps : tuple of float
        Pull of each image, strain.
    """

    camera: synthetic.Camera
    steps: tuple[float, ...]

    def lengths(self, start: tuple[float, float], end: tuple[float, float]) -> F64:
        """Exact change of length over length between two px of the first image, (F - 1,)."""
        ends = self.camera.on_plate(np.array([start, end]))
        seen = [self.camera.project(_moved(ends, pull)) for pull in self.steps]
        apart = [float(np.linalg.norm(one[1] - one[0])) for one in seen]
        return np.array(apart[1:]) / apart[0] - 1

    def circle(self, radius: float, corners: int) -> F64:
        """Corners (K, 2) px of a polygon about the hole, `radius` mm from its middle."""
        turn = 2 * np.pi * np.arange(corners) / corners
        points = np.array(CENTRE) + radius * np.column_stack([np.cos(turn), np.sin(turn)])
        return self.camera.project(np.column_stack([points, np.zeros(corners)]))


def draw_sheet(folder: Path, frames: int) -> PulledSheet:
    """Write a reference and `frames` images into a folder."""
    camera = synthetic.pinhole_above(SIZE, stand_off=500.0, pixels=PIXELS)
    sheet = PulledSheet(camera, tuple(np.linspace(0, PULL, frames + 1).tolist()))
    pattern = synthetic.speckle(SIZE, diameter=0.75, softness=0.6)
    sensor, rng = synthetic.Sensor(noise=NOISE), np.random.default_rng(9)
    folder.mkdir(parents=True, exist_ok=True)
    for number, pull in enumerate(sheet.steps):
        motion = Hole(radius=RADIUS, centre=CENTRE, strain=pull)
        image = Image.fromarray(synthetic.render(pattern, camera, motion, sensor, rng))
        image.paste(Image.new("L", PIXELS, _ROOM), mask=_hole(camera, pull))
        image.save(folder / f"pull-{number:02d}.png")
    return sheet


def _moved(points: F64, pull: float) -> F64:
    """Places (K, 3) mm of points (K, 2) of the sheet."""
    motion = Hole(radius=RADIUS, centre=CENTRE, strain=pull)
    return np.column_stack([points, np.zeros(len(points))]) + motion(points)


def _hole(camera: synthetic.Camera, pull: float) -> Image.Image:
    turn = np.linspace(0, 2 * np.pi, 361)
    rim = np.array(CENTRE) + RADIUS * np.column_stack([np.cos(turn), np.sin(turn)])
    drawn = Image.new("L", [_FINER * side for side in PIXELS])
    outline = _FINER * (camera.project(_moved(rim, pull)) + 0.5)
    ImageDraw.Draw(drawn).polygon([tuple(xy) for xy in outline.tolist()], fill=255)
    return drawn.resize(PIXELS, Image.Resampling.BOX)
