"""Calibrate the twin of a real bench by nine presses, as a lab does: `bench-real.calibration.json`.

`python -m rig.studies.real_bench.shipped FOLDER` presses the twin of the scene at nine places with
1, 2 and 4 N, photographs each press twelve times, and writes the images with a list of places that
err by 0.2 mm and forces that err by 0.3 %. Then it does what
`touchplate calibrate bench bench-real --presses FOLDER/presses.csv --images FOLDER/presses` does,
and puts the result beside the scene.
"""

from __future__ import annotations

import sys
from pathlib import Path

import rig
from rig.calibration import store
from rig.studies.real_bench.as_it_is import identified
from rig.studies.real_bench.session import write_presses
from rig.studies.real_bench.twin_truth import SCENE, twin_truth

PRESSES, SEED = 9, 11


def ship(folder: Path) -> Path:
    """Press the twin, find its bench, and write the calibration beside the scene; its path."""
    listed = write_presses(twin_truth(SEED, "empty"), folder / "presses", PRESSES)
    path = store.shipped(SCENE)
    path.unlink(missing_ok=True)
    found = identified(Path(SCENE), listed, listed.with_suffix(""))
    store.keep(path, found, rig.load(SCENE))
    return path


if __name__ == "__main__":
    ship(Path(sys.argv[1]))
