"""The verdict: every figure that was measured, and what to do about those that are not good."""

from dataclasses import replace
from datetime import UTC, datetime

import numpy as np
import pytest

import models
from rig.calibration.latency import Latency
from rig.calibration.photon import Photon
from rig.calibration.results import entry_of
from rig.calibration.store import Calibration
from rig.scene import load
from rig.setup.answers import NOTHING_SAID
from rig.setup.figures import measured_rows
from rig.setup.verdict import as_measured


def calibrated(*parts):
    entries = {}
    for part in parts:
        entries |= entry_of(part, datetime.now(UTC))
    return Calibration(**entries)


def bench(place, force):
    count = len(models.BENCH)
    found = models.BenchEstimate(np.zeros(count), np.eye(count), 0.01, np.ones(count))
    return replace(found, held_out=models.HeldOut(place, force, 9))


@pytest.mark.parametrize(("place", "force", "good"), [(0.4, 0.012, True), (1.7, 0.034, False)])
def test_presses_are_judged_in_mm_and_newton(place, force, good):
    rows = measured_rows(calibrated(bench(place, force)), NOTHING_SAID)
    weight = 0.2 * 9.80665
    assert [row.what for row in rows] == ["place of 2.0 N", "force of 2.0 N"]
    assert rows[0].figure == f"{place:.3g} mm"
    assert rows[1].figure == f"{force * weight:.2g} N, {100 * force:.2g} %"
    assert [row.good for row in rows] == [good, good]
    assert [bool(row.advice) for row in rows] == [not good, not good]


def test_what_was_not_measured_has_no_row():
    assert measured_rows(Calibration(), NOTHING_SAID) == ()
    late = calibrated(Latency(0.4, 0.5, 0.01, 15, 0))
    (row,) = measured_rows(late, NOTHING_SAID)
    assert (row.figure, row.good) == ("400 ms", False)
    assert "game mode" in row.advice


def test_the_scene_is_judged_with_the_noise_that_was_measured():
    scene = load("twin")
    noisy = calibrated(Photon(gain=0.05, read=1.2, sigma_gain=1e-3, sigma_read=0.1, residual=0.1))
    assert as_measured(scene, Calibration()).sensor.noise == 2.0
    assert as_measured(scene, noisy).sensor.noise == pytest.approx(np.sqrt(1.2**2 + 0.05 * 128))
