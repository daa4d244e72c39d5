"""What runs learn of a bench is kept beside its calibration, and is less sure the older it is."""

import json
from datetime import UTC, datetime, timedelta
from types import SimpleNamespace

import numpy as np
import pytest

import fe
import models
import rig
from rig.calibration import store
from rig.calibration.learned import (
    EVERY,
    forget_learned,
    known_now,
    learned_beside,
    read_learned,
)
from rig.live.learned import Learned

PLATE = fe.Plate((254.0, 203.0), 1.0, 3000.0, 0.38)
NOW = datetime(2026, 3, 1, 12, tzinfo=UTC)
TENSION = [name for name, _ in models.BENCH].index("tension_xx")

SCENE = """
title = "a bench"
[plate]
size = [254, 203]
thickness = 1
young = 3000
poisson = 0.38
edges.kind = "clamped"
[camera]
pixels = [384, 320]
stand_off = 500
[dic]
tile = 16
[estimator]
kind = "pattern"
bench = "usual"
[source]
"""


@pytest.fixture
def scene(tmp_path):
    """Give the path of a scene with a calibrated bench, whose source is the one named."""

    def write(source='kind = "opencv"'):
        path = tmp_path / "my.toml"
        path.write_text(SCENE + source, encoding="utf-8")
        return path

    path = tmp_path / "my.calibration.json"
    store.keep(path, known(0.02))
    text = json.loads(path.read_text())
    text["bench"]["date"] = NOW.isoformat()
    path.write_text(json.dumps(text))
    return write


def known(part, young=0.0):
    """Give a bench that is known to a part of its prior."""
    prior = models.bench_before(PLATE)
    values = prior.values.copy()
    values[0] = young
    return models.BenchEstimate(values, part**2 * prior.covariance, 1e-3, prior.prior)


def loop_that_learned(touches, young):
    return SimpleNamespace(learned=Learned(touches=touches, weights=1), known=known(0.01, young))


def test_the_next_run_goes_on_from_what_was_learned(scene):
    path = scene()
    first = known_now(path, rig.load(path), NOW)
    assert first.calibration.known_bench()["young"][0] == 0.0
    before = (path.parent / "my.calibration.json").read_bytes()
    first.keeper.write(loop_that_learned(4, -0.07))
    second = known_now(path, rig.load(path), datetime.now(UTC))
    assert second.calibration.known_bench()["young"][0] == -0.07
    assert any("4 touches of earlier runs, 1 known weights" in note for note in second.notes)
    second.keeper.write(loop_that_learned(3, -0.08))
    assert read_learned(learned_beside(path)).touches == 7
    assert (path.parent / "my.calibration.json").read_bytes() == before
    assert forget_learned(path)
    assert not forget_learned(path)
    assert known_now(path, rig.load(path), NOW).calibration.known_bench()["young"][0] == 0.0


def test_a_run_that_learned_nothing_writes_nothing_and_others_now_and_then(scene):
    path = scene()
    keeper = known_now(path, rig.load(path), NOW).keeper
    keeper.follow(loop_that_learned(0, 0.0), 10.0)
    keeper.write(loop_that_learned(0, 0.0))
    assert not learned_beside(path).exists()
    keeper.follow(loop_that_learned(1, 0.1), 10.0 + 0.9 * EVERY)
    assert not learned_beside(path).exists()
    keeper.follow(loop_that_learned(1, 0.1), 10.0 + EVERY)
    assert read_learned(learned_beside(path)).bench.values[0] == 0.1
    assert list(path.parent.glob("*.partial")) == []


def test_new_presses_or_another_scene_leave_it_aside(scene):
    path = scene()
    known_now(path, rig.load(path), NOW).keeper.write(loop_that_learned(4, -0.07))
    other = rig.load(path, {"plate.thickness": 2})
    found = known_now(path, other, NOW)
    assert found.calibration.known_bench()["young"][0] == 0.0
    assert any("left aside" in note for note in found.notes)
    store.keep(path.parent / "my.calibration.json", known(0.02, 0.01))
    found = known_now(path, rig.load(path), datetime.now(UTC))
    assert found.calibration.known_bench()["young"][0] == 0.01


def test_a_calibration_is_less_sure_the_older_it_is(scene):
    path = scene()
    bench = rig.load(path)
    fresh, later = (
        known_now(path, bench, NOW + timedelta(hours=hours)).calibration.known_bench()
        for hours in (0, 2)
    )
    np.testing.assert_allclose(fresh.sigma, 0.02 * fresh.prior)
    assert later.sigma[TENSION] > 0.9 * later.prior[TENSION]  # a plate warms in minutes
    stiff = later.sigma[0] / later.prior[0]
    assert stiff == pytest.approx(np.hypot(0.02, 0.1 * np.sqrt(2)), rel=0.01)
    np.testing.assert_array_equal(later.values, fresh.values)


@pytest.mark.parametrize("kind", ["folder", "video", "recording"])
def test_a_run_over_kept_images_neither_ages_nor_keeps(scene, kind):
    path = scene(f'kind = "{kind}"\npath = "there"')
    found = known_now(path, rig.load(path), NOW + timedelta(days=3))
    np.testing.assert_allclose(found.calibration.known_bench().sigma, known(0.02).sigma)
    assert found.keeper is None


def test_a_damaged_file_is_refused_with_what_to_do(scene):
    path = scene()
    learned_beside(path).write_text('{"date": 1}', encoding="utf-8")
    with pytest.raises(ValueError, match="holds no learned bench; delete it"):
        known_now(path, rig.load(path), NOW)
