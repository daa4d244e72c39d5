"""What `calibrate bench`, `collect` and `diagnose` take and say, without a bench that is found."""

import json
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import fe
import models
import rig
from models.bench.diagnosis import Cause, Diagnosis
from rig.calibration import bench_presses, store
from rig.calibration.bench_causes import SeenCauses
from rig.calibration.collect import Taken
from rig.commands import collect, diagnose
from rig.commands.bench_table import described, table

LIST = "press,first_frame,last_frame,x_mm,y_mm,force_n\na,16,20,60.5,45,2\n"


def test_names_to_find_are_split_at_commas_and_may_be_given_one_by_one(
    in_process, tmp_path, monkeypatch
):
    def ask(scene, known, listed, images, free, report):
        asked.append(free)
        raise ValueError("enough")

    asked = []
    monkeypatch.setattr(bench_presses, "identify_bench", ask)
    (tmp_path / "p.csv").write_text(LIST)
    call = ["calibrate", "bench", "twin", "--presses", "p.csv", "--images", "frames"]
    for given in (["--free", "young,sag, focal"], ["--free", "young,sag", "--free", "focal"]):
        in_process(tmp_path, *call, *given)
    in_process(tmp_path, *call)
    assert asked == [("young", "sag", "focal")] * 2 + [()]


SIZE = (254.0, 203.0)


def found(touches):
    """Give a bench that presses at these places have shown well."""
    prior = models.bench_before(fe.Plate(SIZE, 1.0, 3000.0, 0.38))
    held = models.HeldOut(0.4, 0.006, len(touches))
    known = replace(prior, covariance=0.04 * prior.covariance, held_out=held)
    return replace(known, touches=np.array(touches, dtype=float), label_sigma=(0.3, 0.02))


SPREAD = [(x, y, 2.0) for x in (50, 127, 200) for y in (40, 100, 160)]


@pytest.mark.parametrize(
    ("bench", "says"),
    [
        (found(SPREAD), []),
        (found(SPREAD[::4]), ["3 presses leave most numbers as uncertain as before; press at 9"]),
        (
            found([(40 + 0.3 * x, 30 + 0.2 * y, force) for x, y, force in SPREAD]),
            ["cover 45 mm of 254 mm along x; spread", "cover 24 mm of 203 mm along y; spread"],
        ),
        (
            replace(found(SPREAD), label_sigma=(0.4, 0.41)),
            ["the listed forces contradict each other: they scatter by 41%"],
        ),
        (replace(found(SPREAD), label_sigma=(7.0, np.nan)), ["listed places scatter by 7.0 mm"]),
        (
            replace(found(SPREAD), outliers=(1, 4)),
            ["do not agree with the others, and are not among the held-out: press p1, p4"],
        ),
        (
            replace(found(SPREAD), fixed_pattern=(9.0, 0.2)),
            ["the sensor has a fixed pattern of 3.0 grey levels, which is taken out"],
        ),
    ],
)
def test_what_makes_a_bench_unsure_is_said(bench, says):
    said = described(bench, [f"p{k}" for k in range(len(bench.touches))], SIZE)
    assert len(said["cautions"]) == len(says)
    assert all(text in caution for text, caution in zip(says, said["cautions"], strict=True))
    json.dumps(said, allow_nan=False)


def test_the_table_has_the_errors_of_held_out_presses_and_of_the_list():
    said = described(found(SPREAD), [str(k) for k in range(9)], SIZE) | {"path": "x.json"}
    assert table(said).title == (
        "bench, in x.json; held-out presses 0.40 mm, force 0.6%; σ of the list 0.30 mm, force 2.0%"
    )


@pytest.mark.parametrize("kept", [True, False])
def test_a_bench_that_cannot_be_leaves_the_calibration_as_it_was(
    in_process, tmp_path, monkeypatch, kept
):
    right = found(SPREAD)
    bench = right if kept else replace(right, values=right.values + right.prior * 9.0)
    monkeypatch.setattr(bench_presses, "identify_bench", lambda *given: bench)
    (tmp_path / "p.csv").write_text(LIST + "".join(f"{k},1,2,,,\n" for k in range(8)))
    before = store.keep(tmp_path / "twin.calibration.json", right, rig.load("twin"))
    text = (tmp_path / "twin.calibration.json").read_text()
    call = ["calibrate", "bench", "twin", "--presses", "p.csv", "--images", "frames"]
    done = in_process(tmp_path, *call)
    after = store.read_calibration(tmp_path / "twin.calibration.json")
    if kept:
        assert done.returncode == 0
        assert after.bench.found_on == before.bench.found_on
    else:
        assert done.returncode
        assert "the calibration stays as it was" in done.stderr
        assert (tmp_path / "twin.calibration.json").read_text() == text


def test_a_p_value_that_is_too_small_for_a_number_is_not_none():
    causes = tuple(
        Cause(name, 40.0, {"sag": 0.2}, p_value)
        for name, p_value in (("one", 0.0), ("other", 3e-7))
    )
    plate = fe.Plate((254.0, 180.0), 1.0, 3000.0, 0.38)
    found = Diagnosis(90.0, 30, causes, models.bench_before(plate), plate)
    worn = SeenCauses(found, "the pattern is worn over 20 × 10 mm about (30, 40) mm")
    table = diagnose._table(worn)
    assert worn.sentence.endswith(". The pattern is worn over 20 × 10 mm about (30, 40) mm.")
    assert table.caption == worn.sentence
    assert list(table.columns[2].cells) == ["< 2e-308", "3e-07"]


def test_a_collection_that_goes_on_counts_the_presses_before(tmp_path, monkeypatch, capfd):
    """Two of three lie in the folder: the third is the third, and not one of one."""
    targets = [fe.Touch(60.0 + 20.0 * k, 50.0, 1.0 + k) for k in range(5)]
    folder = SimpleNamespace(
        path=tmp_path, listed=[1, 2], left=lambda asked: asked[2:], keep=lambda *given: None,
        has_reference=True, keep_still=None,
    )  # fmt: skip

    def ask(scene, calibration, wanted, record, open_parts, see):
        taken = Taken(wanted.target, None, None, 1)
        wanted.taken.append(taken)
        see(SimpleNamespace(fresh=True, captured=1.0, image=None), taken)

    monkeypatch.setattr(collect, "_ask", ask)
    monkeypatch.setattr("rig.calibration.collect.targets", lambda scene: targets)
    collect._collected(None, None, 3, None, folder)
    assert "3 of 3 presses are taken" in capfd.readouterr().err
