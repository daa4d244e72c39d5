"""Touches of a run as a table."""

import csv
from dataclasses import replace

import numpy as np
import pytest

import models
from rig.live.snapshot import Snapshot
from rig.live.view import marks
from rig.recording.touches_csv import COLUMNS, open_touches

SPREAD = np.array([[0.04, 0.01, 0.002], [0.01, 0.09, 0.003], [0.002, 0.003, 0.0025]])


def estimate(*touches, result=models.Result.FOUND):
    found = np.array(touches, dtype=float).reshape(-1, 3)
    covariance = np.kron(np.eye(len(found)), SPREAD)
    return models.Estimate(found[:, :2], found[:, 2], covariance, 150.0, 100, 0.25, result)


def snapshot(sequence, captured, found, status="one touch"):
    nothing = float("nan")
    return Snapshot(
        sequence=sequence,
        captured=captured,
        image=np.zeros((4, 6), np.uint8),
        plate_size=(150.0, 110.0),
        plate_outline=np.zeros((4, 2)),
        T_px_plate=np.eye(3),
        # What is shown is smoothed, and lies elsewhere.
        touches=tuple(
            replace(mark, identity=7 + k, x=mark.x + 3.0, force=mark.force + 1.0)
            for k, mark in enumerate(marks(found))
        ),
        from_strain=(),
        truth=None,
        strain=None,
        status=status,
        position_error=None,
        force_error=None,
        position_error_median=None,
        force_error_median=None,
        fps=nothing,
        dropped=0,
        stages=(),
        latency=(nothing, nothing),
        noise=2.0,
        estimate=found,
    )


@pytest.fixture
def rows(tmp_path):
    """Rows of two touches, of none, of no new frame and of one without an estimate."""
    path = tmp_path / "run/touches.csv"
    empty = estimate(result=models.Result.NO_TOUCH)
    with open_touches(path) as sink:
        sink(snapshot(16, 5.0, estimate((20.0, 30.0, 1.5), (90.0, 60.0, 2.5)), "2 touches"))
        sink(replace(snapshot(17, 5.04, empty, "no touch"), fresh=False))
        sink(replace(snapshot(17, 5.04, empty, "no touch"), estimate=None))
        sink(snapshot(18, 5.08, empty, "no touch, but a hand"))
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def test_a_row_for_each_touch_and_one_for_a_frame_without(rows):
    assert tuple(rows[0]) == COLUMNS
    assert [(row["frame"], row["touch"]) for row in rows] == [("16", "7"), ("16", "8"), ("18", "")]
    assert [float(row["time_s"]) for row in rows] == pytest.approx([0.0, 0.0, 0.08])


def test_a_row_holds_place_force_and_covariance(rows):
    second = {name: float(rows[1][name]) for name in COLUMNS[3:12]}
    assert list(second.values())[:3] == [90.0, 60.0, 2.5]
    assert list(second.values())[3:] == pytest.approx(list(SPREAD[np.triu_indices(3)]))


def test_bounds_of_a_force_and_a_tap_are_in_the_table(tmp_path):
    path, interval = tmp_path / "touches.csv", models.ForceInterval((1.2, 2.0), (1.0, np.inf))
    found = replace(estimate((20.0, 3.0, 1.5), (90.0, 60.0, 2.5)), force_intervals=(interval, None))
    taps = (
        models.Tap(10.0, 20.0, 4.5, 3.0, 5.25, (0.5, 0.25, 0.125)),
        models.Tap(30.0, 40.0, float("nan"), 1.5, 5.5, (1.0, 1.0, 9.0)),
    )
    with open_touches(path) as sink:
        sink(snapshot(16, 5.0, found))
        sink(replace(snapshot(17, 6.0, found), taps=taps))
    with path.open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert [(row["force_low_n"], row["force_high_n"]) for row in rows[:2]] == [
        ("1", "inf"),
        ("", ""),
    ]
    known, unknown = (row for row in rows if row["result"] == "TAP")
    assert (known["frame"], known["touch"], float(known["time_s"])) == ("17", "", 0.25)
    assert [float(known[name]) for name in ("x_mm", "y_mm", "force_n")] == [10.0, 20.0, 4.5]
    assert float(known["cov_ff"]) == pytest.approx(0.125**2, rel=1e-4)
    assert (unknown["force_n"], float(unknown["force_low_n"])) == ("", 1.5)


def test_a_row_says_what_to_believe(rows):
    assert [row["result"] for row in rows] == ["FOUND", "FOUND", "NO_TOUCH"]
    assert {float(row["p_value"]) for row in rows} == {0.25}
    assert {float(row["chi2_per_dof"]) for row in rows} == {1.5}
    assert rows[2]["sentence"] == "no touch, but a hand"
    assert rows[2]["x_mm"] == ""


def test_a_table_that_is_there_is_not_written_over(tmp_path):
    path = tmp_path / "touches.csv"
    path.write_text("what was measured")
    with (
        pytest.raises(OSError, match="is there already; choose another name"),
        open_touches(path),
    ):
        pass
    assert path.read_text() == "what was measured"
