"""Every kind of source that needs no camera, opened as a scene names it, through the whole loop."""

import json

import cv2
import numpy as np
import pytest

import fe
import rig
from rig.calibration.store import Calibration
from rig.camera.controls import Controls
from rig.commands.run import known
from rig.live.bench import build_bench
from rig.live.loop import Loop
from rig.scene import SceneError
from rig.scene.account import account
from rig.sources.open_source import open_input
from rig.sources.twin import build_twin
from tests.rig.conftest import SMALL

EXACT = {"estimator.bench": "exact"}  # the images are those of a twin
REAL = {"source": {"kind": "folder", "path": "there"}, "comparison": None}
TOUCH = fe.Touch(100.0, 120.0, 2.5)


def shots(scene, said=None):
    with open_input(scene, (said if said is not None else []).append) as (source, zero):
        bench = build_bench(scene, lambda done, total: None)
        return list(Loop(bench, source, reference=zero))


@pytest.fixture
def images(small):
    """Images of a plate at rest, then pressed."""
    twin = build_twin(small())
    return [twin.frame(k, () if k < 18 else (TOUCH,)) for k in range(22)]


def assert_pressed(found):
    *rest, last = found
    assert [len(shot.touches) for shot in rest] == [0, 0, 1, 1, 1]
    (mark,) = last.touches
    assert np.hypot(mark.x - TOUCH.x, mark.y - TOUCH.y) < 4
    assert mark.force == pytest.approx(TOUCH.force, rel=0.1)
    assert last.truth is None


def test_a_folder_is_run_to_its_last_image(small, images, tmp_path):
    for k, image in enumerate(images):
        cv2.imwrite(str(tmp_path / f"{k}.png"), image)
    source = {"kind": "folder", "path": str(tmp_path)}
    assert_pressed(shots(small(EXACT | {"source": source, "camera.rate": 200})))


def test_a_video_is_run_to_its_last_image(small, images, tmp_path):
    path = tmp_path / "film.avi"
    size = images[0].shape[::-1]
    video = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"FFV1"), 25, size, isColor=False)
    for image in images:
        video.write(image)
    video.release()
    source = {"kind": "video", "path": str(path)}
    assert_pressed(shots(small(EXACT | {"source": source, "camera.rate": 200})))


def test_a_recording_is_run_with_its_own_reference_and_truth(small, session, tmp_path):
    path = tmp_path / "session.h5"
    _, recorded, _ = session(path, [60, 61, 62, 63])  # pressed from the first frame on
    found = shots(small(EXACT | {"source": {"kind": "recording", "path": str(path)}}))
    assert [shot.sequence for shot in found] == [shot.sequence for shot in recorded]
    assert [shot.truth for shot in found] == [shot.truth for shot in recorded]
    for shot, then in zip(found, recorded, strict=True):
        ((mark,), (before,)) = shot.touches, then.touches
        assert (mark.x, mark.y) == pytest.approx((before.x, before.y), abs=0.3)


def test_images_of_another_size_are_one_sentence(small, images, tmp_path):
    for k, image in enumerate(images[:16]):
        cv2.imwrite(str(tmp_path / f"{k}.png"), image[:-20])
    scene = small(EXACT | {"source": {"kind": "folder", "path": str(tmp_path)}})
    with pytest.raises(ValueError, match=r"images are 384 × 300 px .* to \[384, 300\]"):
        shots(scene)


def test_a_camera_that_is_not_there_is_one_sentence(small):
    scene = small({"source": {"kind": "opencv", "device": "/dev/video99"}})
    with pytest.raises(OSError, match="no camera at /dev/video99"), open_input(scene, print):
        pass


def test_a_real_source_needs_neither_pattern_nor_sensor(tmp_path):
    scene = rig.load("twin", SMALL | REAL)
    bare = scene.model_dump(exclude_none=True)
    del bare["pattern"], bare["sensor"]
    assert rig.Scene.model_validate(bare).source.kind == "folder"
    with pytest.raises(SceneError, match=r"\[source\] needs \[sensor\]"):
        rig.load("twin", {"sensor": None})


def test_the_controls_are_those_of_the_file():
    source = {"kind": "v4l2", "exposure": "8 ms", "gain": 12, "white_balance": "5600 K"}
    scene = rig.load("twin", {"source": source})
    assert scene.source.controls() == Controls(0.008, 12, None, 5600)
    with pytest.raises(SceneError, match=r"source\.exposure is 0 s; give more than 0 s"):
        rig.load("twin", {"source": source | {"exposure": 0}})
    with pytest.raises(SceneError, match="'film'; give one of 'twin', 'opencv', 'v4l2'"):
        rig.load("twin", {"source": {"kind": "film"}})


@pytest.mark.parametrize(
    ("source", "what", "imports"),
    [
        ({"kind": "opencv"}, "camera at /dev/video0", "cv2"),
        ({"kind": "v4l2", "device": "/dev/video2"}, "camera at /dev/video2", "linuxpy"),
        ({"kind": "basler", "serial": "22"}, "basler camera 22", "pypylon"),
        ({"kind": "genicam", "serial": "7", "producer": "a.cti"}, "genicam camera 7", "harvesters"),
        ({"kind": "folder", "path": "x"}, "folder x", "cv2"),
        ({"kind": "recording", "path": "x.h5"}, "recording x.h5", "h5py"),
    ],
)
def test_the_account_names_the_source(source, what, imports):
    said = account(rig.load("twin", {"source": source}))
    (part,) = [part for part in said.parts if part.name == "source"]
    assert (part.what, part.imports) == (what, (imports,))
    assert "camera device" not in {left.name for left in said.left_out}


def test_a_camera_without_lens_and_pose_is_reported(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    known("bench", rig.load("bench"))
    said = " ".join(capsys.readouterr().err.split())
    assert "calibration holds no lens and pose" in said
    assert "straight down from 500 mm; run `touchplate calibrate camera`" in said
    known("twin", rig.load("twin"))
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize("size", [(384, 320), (640, 480)])
def test_a_calibrated_camera_is_taken_if_its_images_have_the_size(small, size):
    scene = small()
    lens = {"size": size, "focal": 700.0, "sigma_focal": 1.0, "centre": (190.0, 160.0)}
    pose = scene.camera.build(scene.plate).T_cam_plate.tolist()
    made = {"date": "2026-11-01T00:00:00Z", "error": 0.1}
    parts = {
        "lens": made | lens | {"distortion": (0.0,) * 5},
        "pose": made | {"T_cam_plate": pose, "covariance": np.eye(6).tolist()},
    }
    calibration = Calibration.model_validate_json(json.dumps(parts))
    bench = build_bench(scene, lambda done, total: None, calibration)
    assert bench.camera.size == (384, 320)
    assert (bench.camera.focal == 700.0) == (size == (384, 320))


def test_images_that_end_while_something_moves_say_so(small, images, tmp_path):
    for k in range(20):
        image = images[k % 2].copy()
        if k > 6:
            image[100:160, 100:180] = 90  # a hand that stays
        cv2.imwrite(str(tmp_path / f"{k:02d}.png"), image)
    scene = small(EXACT | {"source": {"kind": "folder", "path": str(tmp_path)}})
    with pytest.raises(OSError, match="after something moved in 1 series of 16 frames; give more"):
        shots(scene)
