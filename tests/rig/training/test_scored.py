"""Recordings scored against what their source knew."""

import json
import subprocess
import sys

import pytest

from rig.training.model_score import is_recording, score_recording


@pytest.fixture
def recorded(session, tmp_path):
    """Path of a short recording of the twin's tour, and the snapshots that it was made from."""
    path = tmp_path / "session.h5"
    _, shots, _ = session(path, range(40, 160, 8))
    return path, shots


def test_what_was_found_is_scored_as_it_was_shown(recorded):
    path, shots = recorded
    assert is_recording(path)
    scored = score_recording(path)
    firm = [shot for shot in shots if all(mark.force >= 0.5 for mark in shot.truth)]
    assert scored.touches.touches == sum(len(shot.truth) for shot in firm) > 5
    assert scored.touches.false == sum(max(0, len(shot.touches) - len(shot.truth)) for shot in firm)
    errors = [shot.position_error for shot in firm if shot.position_error and len(shot.truth) == 1]
    assert min(abs(scored.error - errors[0])) < 1e-9
    assert scored.touches.bound is None
    assert scored.map().count.sum() == scored.touches.touches


@pytest.mark.slow
def test_the_command_scores_a_recording_too(recorded):
    path, _ = recorded
    command = [sys.executable, "-c", "from rig.cli import main; main()", "score", str(path)]
    done = subprocess.run([*command, "--json"], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["touches"]["misses"] == 0
    shown = subprocess.run(command, capture_output=True, text=True, check=False).stdout
    assert "inside 1" in shown
    assert "false touches" in shown


def test_a_file_that_is_none_is_no_recording(tmp_path):
    (tmp_path / "text.h5").write_text("no HDF5")
    assert not is_recording(tmp_path / "text.h5")
    assert not is_recording(tmp_path / "none.h5")
