"""Lists of presses, and the bench that is kept of them."""

from dataclasses import replace
from datetime import UTC, datetime

import numpy as np
import pytest

import models
import rig
from rig.calibration.bench_presses import Listed, identify_bench, read_list
from rig.calibration.results import entry_of
from rig.calibration.store import Calibration, keep, read_calibration

HEAD = "press,first_frame,last_frame,x_mm,y_mm,force_n\n"


def listed(tmp_path, text):
    path = tmp_path / "presses.csv"
    path.write_text(text, encoding="utf-8")
    return read_list(path)


def test_a_list_says_what_is_known(tmp_path):
    found = listed(tmp_path, HEAD + "a,16,20,60.5,45,2\nb,30,34,,,1.5\nc,40,40,,,\n")
    assert found == [
        Listed("a", (16, 20), (60.5, 45.0), 2.0),
        Listed("b", (30, 34), None, 1.5),
        Listed("c", (40, 40), None, None),
    ]


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("press,first_frame\n", "lacks the column last_frame"),
        (HEAD, "lists no press"),
        (HEAD + "a,20,16,,,\n", "line 2: frames must run from first_frame to last_frame"),
        (HEAD + "a,,16,,,\n", "line 2: first_frame must be the number of an image, from 0, got ''"),
        (HEAD + "a,1,20.7,,,\n", "line 2: last_frame must be the number .* got '20.7'"),
        (HEAD + "a,-1,2,,,\n", "line 2: first_frame must be the number .* got '-1'"),
        (HEAD + "a,1,1e300,,,\n", "line 2: last_frame must be a number of at most 1e"),
        (HEAD + "a,1,2,,,\nb,3,4,50,,1\n", "line 3: x_mm and y_mm must both be given"),
        (HEAD + "a,1,2,5,5,-1\n", "line 2: force_n must be positive, got -1 N"),
        (HEAD + "a,1,2,x,5,1\n", "line 2: x_mm must be a number of .* got 'x'"),
        (HEAD + "a,1,2,nan,5,1\n", "line 2: x_mm must be a number of .* got 'nan'"),
        (HEAD + "a,1,2,5,1e300,1\n", "line 2: y_mm must be a number of at most 1e"),
        (HEAD + "a,1,2,5,5,1e300\n", "line 2: force_n must be a number of at most 1e"),
        (HEAD + "a,1,2,5,5,1e-300\n", "line 2: force_n must be positive, got 1e-300 N"),
    ],
)
def test_a_list_that_says_too_little_is_refused(tmp_path, text, says):
    with pytest.raises(ValueError, match=says):
        listed(tmp_path, text)


@pytest.mark.parametrize("content", [b"\xe4", b'"' + 200_000 * b"x"])
def test_a_list_that_is_no_text_is_refused_in_a_sentence(tmp_path, content):
    path = tmp_path / "presses.csv"
    path.write_bytes(HEAD.encode() + content)
    with pytest.raises(ValueError, match=r"presses.csv' is no CSV in UTF-8 .*; save it as such"):
        read_list(path)


def test_a_press_in_the_images_of_the_plate_at_rest_is_refused(tmp_path):
    early = [Listed("a", (16, 20), None, 2.0), Listed("b", (15, 24), None, 2.0)]
    given = rig.load("bench-real"), Calibration(), early, tmp_path, (), lambda done, total: None
    with pytest.raises(ValueError, match="press b begins with frame 15, and the first 16 images"):
        identify_bench(*given)


def bench():
    rng, count = np.random.default_rng(1), len(models.BENCH)
    spread = rng.standard_normal((count, count))
    held = models.HeldOut(0.21, 0.004, 9)
    values, prior = rng.standard_normal(count), rng.uniform(1, 2, count)
    return models.BenchEstimate(values, spread @ spread.T, 0.004, prior, 0.02, held)


def test_a_calibration_holds_the_bench(tmp_path):
    made = replace(bench(), fixed_pattern=(8.7, 0.3))
    keep(tmp_path / "my.calibration.json", made)
    kept = read_calibration(tmp_path / "my.calibration.json")
    assert (kept.bench.error, kept.bench.error_force) == (0.21, 0.004)
    again = kept.known_bench()
    for name in ("values", "covariance", "prior", "discrepancy", "memory", "fixed_pattern"):
        assert np.array_equal(getattr(again, name), getattr(made, name))


def test_a_bench_of_presses_at_unknown_places_is_kept_without_an_error(tmp_path):
    keep(tmp_path / "my.calibration.json", replace(bench(), held_out=None))
    kept = read_calibration(tmp_path / "my.calibration.json")
    assert (kept.bench.error, kept.bench.error_force) == (None, None)
    assert np.array_equal(kept.known_bench().values, bench().values)
    assert kept.known_bench().fixed_pattern == bench().fixed_pattern


def test_a_bench_of_other_numbers_is_refused():
    entry = entry_of(bench(), datetime.now(UTC))["bench"]
    fewer = entry.model_copy(update={"names": entry.names[:-1]})
    said = f"other numbers than the {len(models.BENCH)} of today; run"
    with pytest.raises(ValueError, match=said):
        Calibration(bench=fewer).known_bench()
    assert Calibration().known_bench() is None
