"""The score of a run: errors of matched touches, misses and false touches of a run."""

import json

import numpy as np
import pytest

import fe
from models.estimate import Estimate, Result
from rig.live import run_score as module
from rig.live.run_score import RunScore


def estimate(*touches):
    """Estimate of given (x, y, F), sorted as an estimator does."""
    array = np.array(sorted(touches), dtype=float).reshape(-1, 3)
    result = Result.FOUND if len(array) else Result.NO_TOUCH
    count = 3 * len(array)
    return Estimate(array[:, :2], array[:, 2], np.eye(count), 0.0, 1, 1.0, result)


def test_errors_are_distances_and_force_differences_of_matched_touches():
    score = RunScore(min_force=0.5)
    truth = (fe.Touch(200.0, 50.0, 2.0), fe.Touch(40.0, 60.0, 1.0))
    errors = score.add(estimate((43.0, 64.0, 0.9), (200.0, 51.0, 2.3)), truth)
    assert errors == pytest.approx(((5.0 + 1.0) / 2, (0.1 + 0.3) / 2))
    summary = score.summary()
    assert (summary["frames"], summary["scored"]) == (1, 2)
    assert summary["position_median_mm"] == pytest.approx(3.0)
    assert summary["position_rms_mm"] == pytest.approx(np.sqrt((25 + 1) / 2))
    assert summary["force_median_n"] == pytest.approx(0.2)
    assert summary["force_median_percent"] == pytest.approx((10.0 + 15.0) / 2)


def test_a_touch_that_is_not_found_is_a_miss_and_not_scored():
    score = RunScore(min_force=0.5)
    assert score.add(estimate(), (fe.Touch(100.0, 80.0, 2.0),)) is None
    summary = score.summary()
    assert (summary["misses"], summary["false_touches"], summary["scored"]) == (1, 0, 0)


def test_a_touch_that_is_not_there_is_false():
    score = RunScore(min_force=0.5)
    assert score.add(estimate((10.0, 10.0, 0.2)), ()) is None
    assert score.add(estimate((10.0, 10.0, 0.2), (99, 9, 1)), (fe.Touch(9.0, 9.0, 1.0),)) is None
    assert score.false == 2
    assert score.misses == 0


@pytest.mark.parametrize("found", [(), ((100.0, 80.0, 0.3),)])
def test_a_finger_that_just_lands_may_be_found_or_not(found):
    score = RunScore(min_force=0.5)
    assert score.add(estimate(*found), (fe.Touch(100.0, 80.0, 0.3),)) is None
    assert (score.misses, score.false, score.summary()["scored"]) == (0, 0, 0)


def test_nothing_scored_is_none_and_still_json():
    score = RunScore(min_force=0.5)
    score.add(estimate(), ())
    assert score.running() is None
    assert json.loads(json.dumps(score.summary(), allow_nan=False))["position_median_mm"] is None


def test_running_medians_forget_and_the_summary_does_not():
    score = RunScore(min_force=0.5)
    truth = (fe.Touch(100.0, 80.0, 2.0),)
    for _ in range(module.RECENT):
        score.add(estimate((110.0, 80.0, 3.0)), truth)
    for _ in range(module.RECENT):
        score.add(estimate((101.0, 80.0, 2.1)), truth)
    assert score.running() == pytest.approx((1.0, 0.1))
    assert score.summary()["position_p95_mm"] == pytest.approx(10.0)


def test_a_long_run_keeps_a_bounded_number_of_errors(monkeypatch):
    monkeypatch.setattr(module, "KEPT", 50)
    score = RunScore(min_force=0.5)
    for k in range(80):
        score.add(estimate((100.0 + k, 80.0, 2.0)), (fe.Touch(100.0, 80.0, 2.0),))
    summary = score.summary()
    assert (summary["frames"], summary["scored"]) == (80, 50)
    assert summary["position_median_mm"] == pytest.approx(54.5)  # of the last 50, 30 to 79 mm
