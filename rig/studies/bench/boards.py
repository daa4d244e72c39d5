"""Lens and pose of a camera from views of boards that were rendered where it is known.

A camera of 640×512 with a distorting lens, photographed ray by ray (the room of the tests, which
knows nothing of the code that finds boards): a lens from eight views of a board, then a plate from
two patches of board on it, its face 1 mm over the middle plane. The camera stands elsewhere in each
of the rooms; *error* is how far a point of the face is from where the found camera sees it.
"""

from __future__ import annotations

import importlib
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

import synthetic
from rig.calibration.board import on_plate
from rig.calibration.lens import calibrate_lens
from rig.calibration.pose import find_pose
from rig.report.figure import Figure, at_most
from rig.studies.study import line, part, run

ROOT = Path(__file__).parents[3]
TABLE = "Boards before a camera"
CASE = "plate found from rendered views of boards"
ROOMS, HEIGHT = 6, 1.0
LAID = np.array([[1.0, 0, 5.0], [0, -1.0, 185.0]])
"""How the board lies on the plate."""

PLACES = np.stack(np.meshgrid([10.0, 127.0, 240.0], [10.0, 100.0, 190.0]), -1).reshape(-1, 2)


def boards() -> Iterator[Figure]:
    """Find the plate in some rooms."""
    sys.path.insert(0, str(ROOT))
    room: Any = importlib.import_module("tests.rig.calibration.conftest")
    views: Any = importlib.import_module("tests.rig.calibration.test_camera")
    made = room.make_room()
    away, lens_off, stated = list[float](), list[float](), list[float]()
    for seed in range(ROOMS):
        rng = np.random.default_rng(seed)
        stands = [np.array(stand) + rng.uniform(-15, 15, 3) for stand in views.STANDS]
        shown = [views.render_board(made, made.camera_at(stand), rng) for stand in stands]
        lens = calibrate_lens([part(views.BOARD.find(image)) for image in shown], made.size)
        stand = np.array([150.0, 60.0, 470.0]) + rng.uniform(-30, 30, 3)
        true: synthetic.Camera = made.camera_at(stand)
        image = views.render_board(made, true, rng, T=LAID, height=HEIGHT)
        pose = find_pose(lens, on_plate([(part(views.BOARD.find(image)), LAID)], height=HEIGHT))
        px = true.project(np.column_stack([PLACES, np.full(len(PLACES), HEIGHT)]))
        away += np.linalg.norm(pose.camera.on_plate(px, HEIGHT) - PLACES, axis=1).tolist()
        lens_off.append(abs(lens.focal - made.focal) / made.focal)
        stated.append(pose.error)
    cells = {
        "largest error": (max(away), "mm", at_most(0.15), len(away)),
        "median": (float(np.median(away)), "mm", None, len(away)),
        "stated": (float(np.median(stated)), "mm", None, len(stated)),
        "focal length off, largest": (100.0 * max(lens_off), "%", None, len(lens_off)),
    }
    yield from line(TABLE, CASE, **cells)


if __name__ == "__main__":
    run({"boards": boards}, __doc__)
