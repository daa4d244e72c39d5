"""What `calibrate bench`, `collect` and `diagnose` take and say, without a bench that is found."""

from types import SimpleNamespace

import fe
from models.bench.diagnosis import Cause, Diagnosis
from rig.calibration import bench_presses
from rig.calibration.collect import Taken
from rig.commands import collect, diagnose

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


def test_a_p_value_that_is_too_small_for_a_number_is_not_none():
    causes = tuple(
        Cause(name, 40.0, {"sag": 0.2}, p_value)
        for name, p_value in (("one", 0.0), ("other", 3e-7))
    )
    table = diagnose._table(Diagnosis(90.0, 30, causes))
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
