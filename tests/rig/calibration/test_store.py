"""Calibrations on disk: what was measured comes back, what is old or of another bench is said."""

import json
import re
from dataclasses import replace
from datetime import UTC, datetime, timedelta

import numpy as np
import pytest

import models
import rig
import synthetic
from rig.calibration import store
from rig.calibration.latency import Latency
from rig.calibration.lens import Lens
from rig.calibration.photon import Photon
from rig.calibration.pose import Pose
from rig.calibration.projector import ProjectorLight
from rig.calibration.ringing_plate import Ringing
from rig.live import bench as live_bench
from rig.live.alignment import Alignment
from rig.projector.markers import Screen

BENT = synthetic.Distortion(-0.1, 0.05, 1e-3, -2e-3, 0.01)
LENS = Lens((1024, 1024), 1970.2, (510.1, 513.7), BENT, 0.4, 0.08, 0.02, ())
POSE = Pose(
    LENS.camera(synthetic.look_at((127, 120, 500), (127, 127, 0))), np.eye(6) * 1e-4, 0.1, 0.03
)
SCREEN = Screen((1280, 800), np.array([[3.0, 0.1, 250], [0.0, -3.1, 780], [1e-5, 0, 1]]))
CORRECTED = Alignment(np.array([[1.01, 0, -0.5], [0, 0.99, 0.4]]), 1.1, 0.3, 0.02, 0.004, (3,))
NUMBERS = len(models.BENCH)
BENCH = models.BenchEstimate(
    np.linspace(-1, 1, NUMBERS),
    np.diag(np.linspace(1, 2, NUMBERS)),
    0.004,
    np.full(NUMBERS, 3.0),
    0.03,
    models.HeldOut(0.2, 0.005, 9),
)
PARTS = (
    LENS, POSE, ProjectorLight(SCREEN, 0.5, 0.2, 0.9), Photon(0.03, 1.5, 1e-4, 0.01, 0.02),
    Latency(0.05, 0.07, 1e-3, 20, 1), CORRECTED, BENCH, Ringing(1390.0, 0.018, 0.001),
    models.LearnedCreep(models.Creep((0.02, 0.04), (6.0, 55.0)), 0.003),
)  # fmt: skip


def test_every_part_comes_back_as_it_was(tmp_path):
    path = tmp_path / "bench.calibration.json"
    for part in PARTS:
        store.keep(path, part, rig.load("twin"))
    kept = store.read_calibration(path)
    camera = kept.camera()
    points = np.array([[10.0, 20.0, 1.0], [200.0, 150.0, 1.0]])
    np.testing.assert_array_equal(camera.project(points), POSE.camera.project(points))
    np.testing.assert_array_equal(kept.screen().T_px_plate, SCREEN.T_px_plate)
    np.testing.assert_array_equal(kept.alignment().matrix, CORRECTED.matrix)
    assert kept.alignment().gain == 1.1
    np.testing.assert_array_equal(kept.known_bench().covariance, BENCH.covariance)
    assert (kept.noise.gain, kept.latency.median) == (0.03, 0.05)
    assert (kept.damping.density, kept.damping.damping) == (1390.0, 0.018)
    assert kept.known_creep() == models.Creep((0.02, 0.04), (6.0, 55.0))
    assert all(getattr(kept, name).error > 0 for name in type(kept).model_fields)
    assert kept.warnings(rig.load("twin"), datetime.now(UTC)) == []
    assert [file.name for file in tmp_path.iterdir()] == [path.name]


def test_a_calibration_grows_old(tmp_path):
    kept = store.keep(tmp_path / "x.json", CORRECTED)
    later = datetime.now(UTC) + timedelta(days=45)
    (said,) = kept.warnings(rig.load("twin"), later)
    assert said == "calibration of presses is 45 days old; repeat it"


def test_presses_that_are_older_than_the_pose_are_doubted(tmp_path):
    for part in (LENS, POSE, CORRECTED):
        kept = store.keep(tmp_path / "x.json", part)
    before = kept.pose.date - timedelta(hours=1)
    old = kept.model_copy(update={"presses": kept.presses.model_copy(update={"date": before})})
    (said,) = old.warnings(rig.load("twin"), datetime.now(UTC))
    assert said == "known presses are older than the pose they stand on; collect them again"


def kept_bench(path, *parts):
    """Keep parts, then a bench of the twin; the calibration."""
    for part in parts:
        store.keep(path, part)
    return store.keep(path, BENCH, rig.load("twin"))


def anew(calibration, name):
    """Calibrate a part once more, an hour later."""
    part = getattr(calibration, name)
    later = part.model_copy(update={"date": part.date + timedelta(hours=1)})
    return calibration.model_copy(update={name: later})


@pytest.mark.parametrize(
    ("changed", "says"),
    [
        ({"plate.thickness": 3.5}, "found with plate.thickness = 2 mm, and the scene has 3.5 mm"),
        ({"plate.size": [254, 190]}, r"plate.size = 254 × 254 mm, and the scene has 254 × 190 mm"),
        ({"plate.young": 70000}, "plate.young = 3000 MPa, and the scene has 70000 MPa"),
        ({"plate.edges.kind": "supported"}, "plate.edges = .*clamped.*, and .* has .*supported"),
        ({"plate.tension": [0.1, 0, 0]}, "plate.tension = 0, 0, 0 N/mm, and .* has 0.1, 0, 0 N/mm"),
        ({"plate.taper": [0.05, 0]}, "plate.taper = 0, 0, and the scene has 0.05, 0"),
        ({"plate.sag": "0.2 mm"}, "plate.sag = 0 mm, and the scene has 0.2 mm"),
        ({"camera.pixels": [640, 480]}, "camera.pixels = .* px, and the scene has 640 × 480 px"),
        ({"camera.kind": "telecentric"}, "camera.kind = pinhole, and the scene has telecentric"),
        ({"camera.stand_off": 333}, "camera.stand_off = .* mm, and the scene has 333 mm"),
    ],
)
def test_a_bench_of_another_plate_or_camera_is_said_and_left_aside(tmp_path, changed, says):
    kept, scene = kept_bench(tmp_path / "x.json"), rig.load("twin", changed)
    (said,) = kept.warnings(scene, datetime.now(UTC))
    assert re.search(says, said)
    assert said.endswith("it is left aside: run `touchplate calibrate bench` again")
    assert kept.for_scene(scene).bench is None
    assert kept.for_scene(rig.load("twin")).bench == kept.bench


@pytest.mark.parametrize("name", ["lens", "pose"])
def test_a_lens_or_pose_that_is_calibrated_anew_makes_it_another_bench(tmp_path, name):
    kept, scene = kept_bench(tmp_path / "x.json", LENS, POSE), rig.load("twin")
    assert kept.for_scene(scene).bench is not None
    other = anew(kept, name)
    assert other.for_scene(scene).bench is None
    said = other.warnings(scene, datetime.now(UTC))
    assert any(
        f"bench is not of the {name} that is calibrated now; it is left" in one for one in said
    )
    before = kept_bench(tmp_path / "y.json")
    assert store.keep(tmp_path / "y.json", LENS).for_scene(scene).bench == before.bench
    assert store.keep(tmp_path / "y.json", POSE).for_scene(scene).bench is None


def test_a_bench_of_an_older_file_is_taken_with_a_note_unless_the_pose_is_newer(tmp_path):
    for part in (LENS, POSE, BENCH):
        kept = store.keep(tmp_path / "x.json", part)
    scene = rig.load("twin")
    assert kept.for_scene(scene).bench == kept.bench
    (said,) = kept.warnings(scene, datetime.now(UTC))
    assert said.startswith("calibration of the bench does not say of which plate it is")
    other = anew(kept, "pose")
    assert other.for_scene(scene).bench is None
    said = other.warnings(scene, datetime.now(UTC))
    assert any("bench is older than the pose it stands on; it is left aside" in one for one in said)


def test_the_live_loop_leaves_a_bench_of_another_plate_aside(tmp_path, monkeypatch):
    def known(flat, view, estimator, calibration):
        raise ValueError(f"taken: {calibration.bench}")

    monkeypatch.setattr(live_bench, "_known", known)  # before the modes of a plate are computed
    kept = kept_bench(tmp_path / "x.json")
    with pytest.raises(ValueError, match="taken: date="):
        live_bench.build_bench(rig.load("twin"), None, kept)
    with pytest.raises(ValueError, match="taken: None"):
        live_bench.build_bench(rig.load("twin", {"plate.thickness": 3.0}), None, kept)


def test_what_presses_have_shown_of_a_bench_stays_with_what_is_learned_after(tmp_path):
    found = replace(BENCH, converged=False, outliers=(1, 4))
    kept = store.keep(tmp_path / "x.json", found, rig.load("twin"))
    later = kept.on_bench(replace(BENCH, held_out=None))
    for name in ("found_on", "converged", "outliers", "error", "error_force"):
        assert getattr(later.bench, name) == getattr(kept.bench, name)
    said = later.warnings(rig.load("twin"), datetime.now(UTC))
    assert any("bench did not converge" in one for one in said)
    assert any("2 of the presses that show the bench contradict the others" in one for one in said)


def test_another_camera_or_window_is_said(tmp_path):
    path = tmp_path / "x.json"
    store.keep(path, LENS)
    scene = rig.load("twin", {"camera.pixels": [640, 480]})
    (said,) = store.read_calibration(path).warnings(scene, datetime.now(UTC))
    assert "lens is for 1024 × 1024 px and the camera has 640 × 480 px; repeat it" in said


def test_nothing_there_is_an_empty_calibration_and_rubbish_is_refused(tmp_path):
    path = tmp_path / "x.json"
    empty = store.read_calibration(path)
    assert empty.camera() is empty.screen() is empty.alignment() is None
    with pytest.raises(ValueError, match="run `touchplate calibrate camera` first"):
        empty.known_lens()
    path.write_text('{"lens": {"focal": 3}}')
    with pytest.raises(ValueError, match=r"is damaged: lens\.date is missing; add it"):
        store.read_calibration(path)
    path.write_text('{"lens": ')
    with pytest.raises(ValueError, match="is damaged: it is no JSON; correct it there, or delete"):
        store.read_calibration(path)
    path.write_bytes(b"\xff\xfe")
    with pytest.raises(ValueError, match="no text in UTF-8; delete the file and calibrate again"):
        store.read_calibration(path)


def part_of(numbers, place):
    *names, last = place
    for name in names:
        numbers = numbers[name]
    return numbers, last


def shifted(x, z):
    return [[1.0, 0, 0, x], [0, 1, 0, 0], [0, 0, 1, z], [0, 0, 0, 1]]


BEYOND = shifted(0.0, 1e9), shifted(0.0, 0.0), shifted(0.0, -500.0), shifted(1e6, 500.0)
MIRRORED = [[-1.0, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 500], [0, 0, 0, 1]]
DAMAGED = {
    ("presses", "gain"): (-1, 0, 1e300, "1.1", None, True),
    ("presses", "matrix"): ([[1.0, 0, 0]], [[1, 0], [0, 1]], [[-1, 0, 0], [0, 1, 0]], [], 3.0),
    ("noise", "gain"): (-0.1, 0, 1e300),
    ("noise", "read"): (-1.0, 1e300),
    ("latency", "median"): (-5, 1e5),
    ("lens", "focal"): (-2000.0, 0, 1e300),
    ("lens", "size"): ([0, 10], [-5, 5], [1024], [1024.5, 1024], [10**9, 10]),
    ("lens", "distortion"): ([0.0] * 4, [0.0] * 6, [1e6, 0.0, 0.0, 0.0, 0.0]),
    ("lens", "sigma_focal"): (-1.0, 1e9),
    ("latency", "p95"): (0.0, 1e3),
    ("lens", "date"): ("2026-01-01T00:00:00", "0001-01-01T00:00:00Z", "yesterday", 1e300),
    ("pose", "T_cam_plate"): (np.eye(3).tolist(), MIRRORED, (2 * np.eye(4)).tolist(), *BEYOND),
    ("pose", "covariance"): ((-np.eye(6)).tolist(), np.eye(5).tolist(), (1e9 * np.eye(6)).tolist()),
    ("projector", "T_px_plate"): (np.zeros((3, 3)).tolist(), np.ones((3, 3)).tolist()),
    ("projector", "strength"): (-1, 1e300),
    ("bench", "prior"): ([1.0], [-1.0] * NUMBERS),
    ("bench", "covariance"): (np.eye(NUMBERS - 1).tolist(), (-np.eye(NUMBERS)).tolist()),
}


@pytest.mark.parametrize("place", DAMAGED, ids=".".join)
def test_a_number_that_no_bench_has_is_refused_in_one_sentence(tmp_path, place):
    path = tmp_path / "x.json"
    for part in PARTS:
        store.keep(path, part)
    for value in DAMAGED[place]:
        numbers = json.loads(path.read_text())
        owner, last = part_of(numbers, place)
        owner[last] = value
        with pytest.raises(ValueError, match=rf"in the test is damaged: {place[0]}\.") as refusal:
            store.parse(json.dumps(numbers), "in the test")
        assert len(str(refusal.value)) < 300
        assert "\n" not in str(refusal.value)


def test_a_clock_that_was_wrong_is_said(tmp_path):
    kept = store.keep(tmp_path / "x.json", CORRECTED)
    (said,) = kept.warnings(rig.load("twin"), datetime.now(UTC) - timedelta(days=9))
    assert said == "calibration of presses is of a day 8 days ahead; set the clock"


def test_a_calibration_lies_beside_its_scene(tmp_path):
    scene = tmp_path / "bench.toml"
    scene.write_text("")
    assert store.beside(scene) == tmp_path / "bench.calibration.json"
    assert str(store.beside("twin")) == "twin.calibration.json"
