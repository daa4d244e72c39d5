"""Calibrations, changed."""

from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

import models
import rig
import synthetic
from rig.calibration import store
from rig.calibration.latency import Latency
from rig.calibration.lens import Lens
from rig.calibration.photon import Photon
from rig.calibration.pose import Pose
from rig.calibration.projector import ProjectorLight
from rig.live.alignment import Alignment
from rig.live.view import plate_view
from rig.projector.markers import Screen
from rig.studies.files.kind import Kind, Wrong
from rig.studies.files.limits import out_of_range
from rig.studies.files.mutation import mutate_text
from rig.studies.study import part


def make_calibration(path: Path) -> None:
    """Write a calibration with every part that there is."""
    bent = synthetic.Distortion(-0.1, 0.05, 1e-3, -2e-3, 0.01)
    lens = Lens((1024, 1024), 1970.2, (510.1, 513.7), bent, 0.4, 0.08, 0.02, ())
    camera = lens.camera(synthetic.look_at((127, 120, 500), (127, 127, 0)))
    light = Screen((1280, 800), np.array([[3.0, 0.1, 250], [0.0, -3.1, 780], [1e-5, 0, 1]]))
    count = len(models.BENCH)
    values, spread = np.linspace(-1, 1, count), np.diag(np.linspace(1, 2, count))
    presses = np.array([[1.01, 0, -0.5], [0, 0.99, 0.4]])
    for result in (
        lens,
        Pose(camera, np.eye(6) * 1e-4, 0.1, 0.03),
        ProjectorLight(light, 0.5, 0.2, 0.9),
        Photon(0.03, 1.5, 1e-4, 0.01, 0.02),
        Latency(0.05, 0.07, 1e-3, 20, 1),
        Alignment(presses, 1.1, 0.3, 0.02, 0.004, (3,)),
        models.BenchEstimate(values, spread, 0.004, np.full(count, 3.0)),
    ):
        store.keep(path, result)


def read_calibration(path: Path) -> Wrong:
    """Read a calibration and use every part of it."""
    kept = store.read_calibration(path)
    yield from out_of_range(kept.model_dump())
    for name, shape in (("pose", (4, 4)), ("projector", (3, 3)), ("presses", (2, 3))):
        entry: Any = getattr(kept, name)
        matrix = {"pose": "T_cam_plate", "projector": "T_px_plate", "presses": "matrix"}[name]
        if entry is not None and np.shape(getattr(entry, matrix)) != shape:
            yield f"{name}.{matrix} has shape {np.shape(getattr(entry, matrix))}"
    if kept.pose is not None:
        turn = np.array(kept.pose.T_cam_plate)[:3, :3]
        if abs(np.linalg.det(turn) - 1) > 1e-4:
            yield f"determinant of the pose is {np.linalg.det(turn):g}"
    kept.warnings(rig.load("twin"), datetime.now(UTC))
    kept.alignment()
    kept.known_bench()
    camera = kept.camera()
    if camera is not None and kept.projector is not None:
        view = plate_view(part(rig.load("twin").plate).build(), camera)
        kept.light(view.T_px_plate, (64, 48))


CALIBRATION = Kind(".json", make_calibration, mutate_text, read_calibration)
