"""Causes named from a folder of images, on a bench as it was calibrated."""

import json
import shutil
from dataclasses import replace
from pathlib import Path

import cv2
import pytest
from typer.testing import CliRunner

import fe
import models
import rig
from rig import cli
from rig.calibration.store import keep
from rig.sources.twin import build_twin

PLACES = [(50, 50), (125, 60), (200, 50), (60, 100), (130, 110), (200, 150), (60, 155), (130, 160)]


@pytest.fixture
def calibrated(small, small_settings, tmp_path):
    """Write a scene, its calibration and images of touches; gives the arguments of a command."""
    scene = small({"estimator.bench": "usual", "comparison": None})
    twin, images = build_twin(scene), tmp_path / "images"
    images.mkdir()
    pressed = [()] * 16 + [(fe.Touch(x, y, 2.0),) for x, y in PLACES]
    for number, touches in enumerate(pressed):
        cv2.imwrite(str(images / f"{number:02d}.png"), twin.frame(number, touches))
    shutil.copy(Path(rig.__file__).parent / "scenes/twin.toml", tmp_path / "my.toml")
    before = models.bench_before(scene.plate.build())

    def argue(**values):
        found = before.values.copy()
        for name, value in values.items():
            found[[each for each, _ in models.BENCH].index(name)] = value
        known = replace(before, values=found, covariance=1e-4 * before.covariance)
        keep(tmp_path / "my.calibration.json", known)
        settings = [*small_settings, "--set=estimator.bench=usual"]
        return ["diagnose", str(tmp_path / "my.toml"), f"--images={images}", *settings, "--json"]

    return argue


def diagnosed(arguments):
    done = CliRunner().invoke(cli.application(arguments), arguments)
    assert done.exit_code == 0, done.output
    return json.loads(done.stdout)


@pytest.mark.slow
def test_a_diagnosis_begins_at_what_a_calibration_has_found(calibrated):
    found = diagnosed(calibrated(tension_xx=4.0, tension_yy=4.0))
    assert "as calibrated" in found["sentence"]
    (tension,) = (one for one in found["causes"] if one["name"] == "tension in the plate")
    assert tension["numbers"]["tension_xx"] == pytest.approx(4.0, abs=1.0)
