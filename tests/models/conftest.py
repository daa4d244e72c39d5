"""A small bench: a plate that is not square, seen by a camera of 320x256 px, and its images."""

from dataclasses import dataclass

import numpy as np
import pytest

import fe
import models
import synthetic
from dic.tiles.preparation import prepare_tiles
from dic.tiles.tiles import TileReference, tile_sums

PLATE = fe.Plate((150.0, 110.0), 1.0, 3000.0, 0.38)
NOISE = 2.0  # grey levels
TOP = PLATE.thickness / 2
SENSOR = synthetic.Sensor(noise=0.0, bits=16)  # 16 bits as 0 … 255: images without rounding


@dataclass(frozen=True, eq=False, repr=False)
class SmallBench:
    """What a test needs to press the plate, take an image and find the touches in it."""

    camera: synthetic.Camera
    modes: fe.Modes
    solver: fe.Linear
    warper: synthetic.Warper
    reference: TileReference
    pattern: models.TilePattern
    search: models.CandidateGrid

    @property
    def height(self):
        """Height of the touched face over the middle plane, mm."""
        return TOP

    def image(self, touches=(), shift=(0.0, 0.0), turn=0.0, grow=0.0):
        """Image without noise, (H, W) float64, grey levels.

        Touches are (x, y, F); the image is shifted in px, turned in rad and grown by a fraction.
        """
        points = self.warper.points
        moved = np.zeros((len(points), 3))
        if len(touches):
            pressed = [fe.Touch(*touch) for touch in touches]
            moved = self.solver.deflect(pressed).displacement(points, "top")
        from_middle = points - np.array(PLATE.size) / 2
        moved[:, :2] += from_middle @ [[grow, turn], [-turn, grow]]
        return self.warper.render(moved, SENSOR, None, shift=shift) / 257.0

    def sense(self, frame, start=(), count=None, passes=3):
        """Touches in a frame; the reference is moved by what each pass finds."""
        motions, motion = self.pattern.motions, self.pattern.still()
        for _ in range(passes):
            sums = tile_sums(self.reference, frame, motions.flow(motion))
            right = self.pattern.gradient(sums, motion)
            measured = self.pattern.whiten(right, NOISE)
            estimate = models.find(measured, self.search, start=start, count=count, max_touches=3)
            start = np.column_stack([estimate.xy, estimate.force])
            motion = self.pattern.amplitudes(estimate, right)
        return estimate


@pytest.fixture(scope="session")
def bench():
    camera = synthetic.pinhole_above(PLATE.size, 260.0, (320, 256))
    modes = fe.modes(PLATE, 120)
    speckle = synthetic.speckle(PLATE.size, diameter=2.3, softness=0.6)
    warper = synthetic.prepare_warp(speckle, camera, TOP)
    still = warper.render(np.zeros((len(warper.points), 3)), SENSOR, None) / 257.0
    reference = prepare_tiles(still, size=8)
    motions = models.prepare_motions(modes, camera, TOP, reference.tiles)
    pattern = models.prepare_pattern(motions, reference)
    search = models.prepare_candidates(pattern.forward(NOISE))
    solver = fe.Linear(PLATE, modes.mesh)
    return SmallBench(camera, modes, solver, warper, reference, pattern, search)
