"""Names of recordings: those that others give never lead out of the folder."""

import os
import time
from datetime import datetime
from pathlib import Path

import pytest
from hypothesis import given, strategies as st

import rig
from rig.calibration.store import Calibration
from rig.recording.paths import FOLDER, named, recordings, recordings_at, require_new
from rig.recording.recorder import new_recorder


@pytest.mark.parametrize(
    "name",
    ["../x", "/etc/x", "a/b", "..", ".hidden", "", "a\\b", "a\0b", "a..h5", "x" * 101, "a\n"],
)
def test_a_name_that_leads_elsewhere_is_refused(name):
    with pytest.raises(ValueError, match="recording cannot be called"):
        named(Path("recordings"), name)


@given(st.text(max_size=30))
def test_every_name_that_is_taken_lies_in_the_folder(name):
    folder = Path("/data/recordings")
    try:
        path = named(folder, name)
    except ValueError:
        return
    assert path.parent == folder
    assert path.resolve().parent == folder.resolve()
    assert path.suffix == ".h5"


def test_a_recording_replaces_nothing(tmp_path):
    (tmp_path / "there.h5").write_bytes(b"")
    with pytest.raises(OSError, match="is there already; choose another name"):
        require_new(tmp_path / "there.h5")
    with pytest.raises(OSError, match="does not exist; make it first"):
        require_new(tmp_path / "no" / "new.h5")
    with pytest.raises(ValueError, match=r"must be a file \*\.h5"):
        require_new(tmp_path / "new.mat")
    assert require_new(tmp_path / "new.h5") == tmp_path / "new.h5"


@pytest.fixture
def far_east(monkeypatch):
    """Let the machine stand nine hours east of Greenwich."""
    monkeypatch.setenv("TZ", "JST-9")
    time.tzset()
    yield
    monkeypatch.undo()
    time.tzset()


def test_a_recording_is_called_by_the_time_of_day_as_stills_and_tables_are(
    far_east, tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    before = f"session-{datetime.now():%Y%m%d-%H%M%S}.h5"
    called = new_recorder(None, rig.load("twin"), Calibration()).summary()["path"]
    assert before <= called <= f"session-{datetime.now():%Y%m%d-%H%M%S}.h5"


def test_what_record_writes_beside_a_run_is_listed_too(tmp_path):
    (tmp_path / FOLDER).mkdir()
    for age, name in enumerate(("new.h5", f"{FOLDER}/press.h5", "old.h5")):
        (tmp_path / name).write_bytes(b"")
        os.utime(tmp_path / name, (1000 - age, 1000 - age))
    assert recordings_at(tmp_path) == ("new.h5", f"{FOLDER}/press.h5", "old.h5")
    assert recordings(tmp_path) == ("new.h5", "old.h5")
