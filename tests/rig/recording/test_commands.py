"""Recording, replaying and exporting from the command line."""

import csv
import json

import cv2
import numpy as np
import pytest
from typer.testing import CliRunner

from rig import cli
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
        images = session.column("frames/image")
        found = np.isfinite(session.column("touches/place")[..., 0]).sum()
    for index, image in enumerate(images):
        kept = cv2.imread(str(folder / "tiff" / f"frame-{index:06d}.tiff"), cv2.IMREAD_UNCHANGED)
        np.testing.assert_array_equal(kept, image)
    rows = list(csv.DictReader((folder / "csv" / "touches.csv").open()))
    assert len(rows) == found
    video = cv2.VideoCapture(str(folder / "video" / "session.avi"))
    shown = [video.read()[1][..., 0] for _ in images]
    np.testing.assert_array_equal(shown[-1], images[-1])


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
