"""The guided command: images in, a calibration beside the scene out."""

import json

import cv2
import numpy as np
import pytest
from typer.testing import CliRunner

from rig import cli
from rig.calibration import store
from rig.calibration.board import CharucoBoard

SCENE = """
title = "a bench"
[plate]
size = [254, 203]
thickness = 2
young = 3000
poisson = 0.38
edges.kind = "clamped"
[camera]
kind = "pinhole"
pixels = [640, 512]
stand_off = 460
[projector]
size = [64, 40]
"""
BOARD = CharucoBoard((11, 9), 20.0, 15.0)
STANDS = [(127, 100, 430), (330, 100, 380), (-90, 120, 370), (127, 320, 360), (130, -130, 380)]


@pytest.fixture
def bench(tmp_path):
    (tmp_path / "bench.toml").write_text(SCENE)
    return tmp_path


def touchplate(*arguments):
    arguments = [str(argument) for argument in arguments]
    return CliRunner().invoke(cli.application(arguments), arguments)


def calibrate(what, bench, *arguments):
    done = touchplate("calibrate", what, bench / "bench.toml", "--json", *arguments)
    assert done.exit_code == 0, done.output or done.exception
    return json.loads(done.stdout)


@pytest.mark.slow
def test_camera_then_pose_from_images_and_corners(room, bench):
    rng = np.random.default_rng(4)
    folder = bench / "views"
    folder.mkdir()
    drawn = 40 + BOARD.draw(6.0) * (170 / 255)
    for index, stand in enumerate(STANDS):
        mm = (room.places_seen(room.camera_at(stand), 0.0) - (10.0, 190.0)) * (1.0, -1.0)
        image = room.photograph(room.look_up(drawn, 6.0 * mm - 0.5).mean(axis=2), rng)
        cv2.imwrite(str(folder / f"{index}.png"), image)
    cv2.imwrite(str(folder / "9.png"), np.full((512, 640), 90, np.uint8))  # shows no board
    said = calibrate("camera", bench, "--images", folder, "--squares", 11, 9)
    assert said["focal"] == pytest.approx(room.focal, rel=0.01)
    assert said["error"] < 0.1  # mm
    assert said["left_out"] == [5]
    camera = room.camera_at((127.0, 101.0, 460.0), (127.0, 101.0, 0.0))
    corners = camera.project([(0, 0, 1), (254, 0, 1), (254, 203, 1), (0, 203, 1)])
    given = [f"--corner={x:.3f},{y:.3f}" for x, y in corners]
    assert calibrate("pose", bench, *given)["error"] < 0.5
    kept = store.read_calibration(bench / "bench.calibration.json")
    px = camera.project([(60.0, 50.0, 1.0)])
    assert np.abs(kept.camera().on_plate(px, 1.0) - (60.0, 50.0)).max() < 0.15  # mm


def test_stripes_are_written_as_they_must_be_projected(bench):
    assert calibrate("stripes", bench, "--images", bench / "stripes") == {"images": 26}
    sizes = {cv2.imread(str(path)).shape for path in (bench / "stripes").iterdir()}
    assert sizes == {(40, 64, 3)}


def test_noise_from_a_folder_for_each_exposure(bench, rng):
    for exposure, level in enumerate((60, 120, 200)):
        folder = bench / "stills" / str(exposure)
        folder.mkdir(parents=True)
        for k in range(5):
            clean = np.linspace(0.6, 1.0, 160) * np.full((120, 160), level)
            noisy = clean + rng.normal(0, np.sqrt(1.5**2 + 0.03 * clean))
            cv2.imwrite(str(folder / f"{k}.png"), np.rint(noisy).astype(np.uint8))
    said = calibrate("noise", bench, "--images", bench / "stills")
    assert said["gain"] == pytest.approx(0.03, rel=0.1)


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (("pose", "--corner=1,2"), "plate has 4 corners, got 1; give --corner four times"),
        (("pose", "--corner=here"), "corner must be written as x,y in px, got 'here'"),
        (("camera", "--images=nowhere"), "folder 'nowhere' of images does not exist"),
        (("projector", "--images=nowhere"), "found through a calibrated camera"),
    ],
)
def test_what_the_user_can_correct_is_one_sentence(bench, arguments, sentence):
    what, *others = arguments
    done = touchplate("calibrate", what, bench / "bench.toml", *others)
    assert sentence in str(done.exception)


def test_noise_live_on_a_folder_of_images_that_stands_for_a_camera(bench, rng):
    stills = bench / "stills"
    stills.mkdir()
    levels = [level for level in (60, 120, 200) for _ in range(14)]
    for number, level in enumerate(levels):
        clean = np.linspace(0.6, 1.0, 640) * np.full((512, 640), level)
        noisy = clean + rng.normal(0, np.sqrt(1.5**2 + 0.03 * clean))
        cv2.imwrite(str(stills / f"{number:03d}.png"), np.rint(noisy).astype(np.uint8))
    source = ["--set=source.kind=folder", f"--set=source.path={stills}"]
    said = calibrate("noise", bench, *source)
    assert said["gain"] == pytest.approx(0.03, rel=0.1)
    assert store.read_calibration(bench / "bench.calibration.json").noise.read == pytest.approx(
        1.5, rel=0.1
    )


@pytest.mark.parametrize(
    ("what", "sentence"),
    [
        ("camera", "has ended after 1 images; the calibration needs more"),
        ("pose", "the lens is not calibrated"),
        ("projector", "found through a calibrated camera"),
    ],
)
def test_live_without_what_it_needs_is_one_sentence(bench, what, sentence):
    stills = bench / "stills"
    stills.mkdir()
    cv2.imwrite(str(stills / "0.png"), np.full((512, 640), 90, np.uint8))
    source = ["--set=source.kind=folder", f"--set=source.path={stills}"]
    done = touchplate("calibrate", what, bench / "bench.toml", *source)
    assert sentence in str(done.exception)
