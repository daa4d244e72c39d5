"""Recording, replaying and exporting from the command line."""

import csv
import json
import shutil
from types import SimpleNamespace

import cv2
import h5py
import meshio
import numpy as np
import pytest
from typer.testing import CliRunner

from rig import cli
from rig.recording.film import HEAD, SIDE
from rig.recording.layout import frame_check
from rig.recording.recorder import RESERVE
from rig.recording.session import open_session


def touchplate(*arguments):
    arguments = [str(argument) for argument in arguments]
    return CliRunner().invoke(cli.application(arguments), arguments)


@pytest.fixture
def recorded(small_settings, live_cache, monkeypatch, tmp_path):
    """Record a session of the small twin by the command."""
    monkeypatch.setenv("TOUCHPLATE_CACHE", str(live_cache))
    done = touchplate(
        "record", "twin", "one", "--folder", tmp_path, "--frames=12", "--json",
        "--set=source.script=random", *small_settings,
    )  # fmt: skip
    assert done.exit_code == 0, done.output
    return tmp_path / "one.h5", json.loads(done.stdout)


def free_space(monkeypatch, *numbers):
    """Let the disk have so many bytes free, one number a question, the last one for ever."""
    left = list(numbers)

    def usage(path):
        return SimpleNamespace(free=left.pop(0) if len(left) > 1 else left[0])

    monkeypatch.setattr(shutil, "disk_usage", usage)


@pytest.mark.slow
def test_a_disk_that_fills_up_is_said_at_once_and_in_the_exit_code(
    small_settings, live_cache, monkeypatch, tmp_path
):
    monkeypatch.setenv("TOUCHPLATE_CACHE", str(live_cache))
    free_space(monkeypatch, *[2 * RESERVE] * 4, 0)
    path = tmp_path / "full.h5"
    done = touchplate(
        "run", "twin", "--headless", "--record", path, "--frames=12", "--json", *small_settings
    )
    assert done.exit_code == 1, done.output
    said = " ".join(done.stderr.split())
    assert said.count("has ended with 3 frames (less than 256 MB") == 1
    assert json.loads(done.stdout)["frames"] == 12
    with open_session(path) as session:
        assert session.frames == 3


def test_a_recording_without_room_does_not_begin(small_settings, monkeypatch, tmp_path):
    free_space(monkeypatch, RESERVE - 1)
    arguments = "run", "twin", "--headless", "--record", str(tmp_path / "x.h5"), *small_settings
    done = touchplate(*arguments)
    assert isinstance(done.exception, OSError)
    assert "has 255 MB free, of which a recording leaves 256 MB; free" in str(done.exception)
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
def test_a_replay_that_differs_says_so_in_its_exit_code(recorded):
    path, _ = recorded
    with h5py.File(path, "r+") as file:
        places = file["touches/place"]
        places[0] = 60.0
        row = {name: array[0] for name, array in datasets(file).items()}
        file["frames/check"][0] = frame_check(row)
    done = touchplate("replay", path, "--json")
    assert (done.exit_code, json.loads(done.stdout)["different"]) == (1, 1)


def datasets(file):
    found = {}
    file.visititems(
        lambda name, item: found.__setitem__(name, item) if hasattr(item, "shape") else None
    )
    return {
        name: array
        for name, array in found.items()
        if name != "reference" and not name.startswith("tares/")
    }


@pytest.mark.slow
def test_a_recorded_run_is_replayed_bit_for_bit_and_exported(recorded, tmp_path):
    path, said = recorded
    frames = said["recorded"]["frames"]
    assert frames + said["recorded"]["dropped"] + said["recorded"]["waiting"] == 12
    done = touchplate("replay", path, "--json")
    assert done.exit_code == 0, done.output
    again = json.loads(done.stdout)
    assert again["different"] == 0
    assert 0 < again["frames"] <= 12
    for way in ("tiff", "csv", "video"):
        done = touchplate("export", path, tmp_path / way, "--to", way, "--json")
        assert done.exit_code == 0, done.output
        assert json.loads(done.stdout)["frames"] == again["frames"]
    _check(path, tmp_path)


def _check(path, folder):
    with open_session(path) as session:
        images = session.arrays["frames/image"][: session.frames]
        columns = session.columns()
    for index, image in enumerate(images):
        kept = cv2.imread(str(folder / "tiff" / f"frame-{index:06d}.tiff"), cv2.IMREAD_UNCHANGED)
        np.testing.assert_array_equal(kept, image)
    rows = list(csv.DictReader((folder / "csv" / "touches.csv").open()))
    found = np.isfinite(columns["touches/place"][..., 0]).sum(axis=1)
    assert [int(row["frame"]) for row in rows] == np.repeat(
        np.arange(len(found)), np.maximum(found, 1)
    ).tolist()
    assert sum(row["x_mm"] != "" for row in rows) == found.sum()
    stated = [columns["touches/p_value"][int(row["frame"])] for row in rows]
    assert [float(row["p_value"]) for row in rows] == pytest.approx(stated, rel=1e-5)
    video = cv2.VideoCapture(str(folder / "video" / "session.avi"))
    shown = [video.read()[1][..., 0] for _ in images]
    np.testing.assert_array_equal(shown[-1], images[-1])


def test_a_film_shows_where_was_pressed_and_what_was_found(session, tmp_path):
    path = tmp_path / "session.h5"
    session(path, [20, 60, 61])  # nobody, then one finger
    done = touchplate("export", path, tmp_path / "film", "--to", "film", "--json")
    assert done.exit_code == 0, done.output
    film = cv2.VideoCapture(str(tmp_path / "film" / "film.mp4"))
    frames = [film.read()[1] for _ in range(3)]
    empty, _, last = (frame[HEAD:, 2 * SIDE :].astype(int) for frame in frames)
    assert empty.max() < 60  # nothing lit
    blue, red = (last[..., k] - last[..., 2 - k] > 80 for k in (0, 2))
    with open_session(path) as kept:
        x, y = kept.row(2)["frames/truth"][0][:2]
        sides = kept.scene.plate.size
    scale = SIDE / max(sides)
    for lit in (blue, red):  # the dot, and the ring about it
        rows, columns = np.nonzero(lit)
        off = np.array([columns.mean() - x * scale, SIDE - y * scale - rows.mean()])
        assert np.abs(off).max() < 8.0, off  # px of 480


def test_bent_plates_are_exported_for_paraview(session, tmp_path):
    path = tmp_path / "session.h5"
    _, shots, _ = session(path, [20, 60, 61])  # nobody, then one finger
    done = touchplate("export", path, tmp_path / "vtu", "--to", "vtu", "--json")
    assert done.exit_code == 0, done.output
    assert json.loads(done.stdout)["files"] == 3
    still, bent, _ = (meshio.read(tmp_path / "vtu" / f"frame-{k:06d}.vtu") for k in range(3))
    assert np.abs(still.point_data["displacement"]).max() == 0
    (mark,) = shots[1].touches
    pressed = int(np.argmax(bent.point_data["force"]))
    assert bent.point_data["force"][pressed] == pytest.approx(mark.force)
    flat = bent.points - bent.point_data["displacement"]
    np.testing.assert_allclose(flat[pressed], (mark.x, mark.y, 1.0), atol=1e-9)
    sag = bent.point_data["displacement"][:, 2]
    assert sag.min() == pytest.approx(sag[pressed], rel=0.01)
    assert -0.5 < sag.min() < -0.2  # mm under 2 N


def test_a_cut_recording_is_exported_as_far_as_it_goes(session, tmp_path):
    path = tmp_path / "session.h5"
    session(path, range(20, 40))
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    done = touchplate("export", path, tmp_path / "csv", "--to", "csv", "--json")
    assert 0 < json.loads(done.stdout)["frames"] < 20
    assert "lacks its end" in " ".join(done.stderr.split())  # wrapped at any width


def test_a_name_that_leads_out_of_the_folder_is_refused(tmp_path):
    done = touchplate("record", "twin", "../out", "--folder", tmp_path)
    assert isinstance(done.exception, ValueError)
    assert "recording cannot be called '../out'" in str(done.exception)
    assert not list(tmp_path.iterdir())


def test_a_recording_that_is_there_is_not_replaced(tmp_path):
    (tmp_path / "one.h5").write_bytes(b"mine")
    done = touchplate("run", "twin", "--headless", "--record", tmp_path / "one.h5")
    assert "is there already" in str(done.exception)
    assert (tmp_path / "one.h5").read_bytes() == b"mine"
