"""`touchplate calibrate bench`: from a folder of images of another plate to touches that are right.

Truth is the whole plate of von Kármán on a mesh of its own, between clamps that give and under a
camera that stands otherwise than the scene says.
"""

import json
import os
import subprocess
import sys

import numpy as np
import pytest

import rig
from rig.calibration.store import Calibration, calibration_beside
from rig.studies.real_bench.departure import ALL
from rig.studies.real_bench.score import score
from rig.studies.real_bench.session import write_presses, write_scene, write_touches
from rig.studies.real_bench.truth import Truth

COMMAND = [sys.executable, "-c", "from rig.cli import main; main()", "calibrate", "bench"]
pytestmark = pytest.mark.slow
TOUCHES, ALONE = 67, 20  # of a run, and those before its touches have shown the bench


@pytest.fixture(scope="module")
def session(tmp_path_factory):
    """Scene, list and images of presses, and the touches in the images of the scene."""
    folder, truth = tmp_path_factory.mktemp("bench"), Truth(ALL, 5)
    listed = write_presses(truth, folder / "presses", 9)
    made = write_touches(truth, folder / "touches", TOUCHES)
    return write_scene(folder, folder / "touches"), listed, folder / "presses", made


@pytest.fixture(scope="module")
def answer(session):
    scene, listed, images, _ = session
    call = [*COMMAND, str(scene), "--presses", str(listed), "--images", str(images), "--json"]
    done = subprocess.run(call, capture_output=True, text=True, check=False, env=os.environ)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def test_it_finds_the_bench_and_says_how_well(answer):
    numbers = {each["name"]: each for each in answer["parameters"]}
    assert answer["converged"]
    assert answer["outliers"] == []
    assert answer["held_out"]["place_mm"] < 0.5  # of which 0.28 is how the list errs
    for name, true in (("turn_x", ALL.camera[0]), ("turn_y", ALL.camera[1]), ("tension_xx", 0.06)):
        assert numbers[name]["determined"]
        assert abs(numbers[name]["value"] - true) < 5 * numbers[name]["sigma"]


def test_touches_are_right_after_it_and_not_before(session, answer):
    scene, _, _, made = session
    assert answer["path"] == str(scene.with_name("scene.calibration.json"))
    before = score(scene, Calibration(), made)
    after = score(scene, calibration_beside(scene), made)
    assert np.median(after.place) < 0.25 < 0.5 < np.median(before.place[:ALONE])
    assert np.quantile(after.place, 0.95) < 0.6
    assert np.median(np.abs(after.force)) < 0.015
    # 201 numbers within 1 and 2 σ: 68 and 95 %, four of their standard deviations beside it.
    assert 0.55 < np.mean(np.abs(after.within) < 1.0) < 0.81
    assert np.mean(np.abs(after.within) < 2.0) > 0.88
    assert (before.false, after.false, after.missed, after.phantoms) == (0, 0, 0, 0)


def test_touches_that_nobody_labels_show_a_bench_from_the_twenty_fourth_on(tmp_path):
    """Until then places are off by what may be wrong; after it by less than half of that."""
    truth = Truth(ALL, 6)
    made = write_touches(truth, tmp_path / "touches", 42)
    seen = score(rig.load(write_scene(tmp_path, tmp_path / "touches")), Calibration(), made)
    before, after = np.split(seen.place, [20])
    assert np.median(after[12:]) < min(0.3, 0.5 * np.median(before))
    assert np.mean(np.abs(seen.within[-12:, :2]) < 2.0) > 0.8
