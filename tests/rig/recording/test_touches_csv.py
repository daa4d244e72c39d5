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


def test_a_row_says_what_to_believe(rows):
    assert [row["result"] for row in rows] == ["FOUND", "FOUND", "NO_TOUCH"]
    assert {float(row["p_value"]) for row in rows} == {0.25}
    assert {float(row["chi2_per_dof"]) for row in rows} == {1.5}
    assert rows[2]["sentence"] == "no touch, but a hand"
    assert rows[2]["x_mm"] == ""
