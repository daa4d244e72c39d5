"""Lines and extensometers of a result, against closed forms and drawn noise."""

import csv
import json
import sys
from dataclasses import replace

import numpy as np
import pytest

import dic
from rig import cli
from rig.series.between import lay
from rig.series.profile import profiles
from rig.series.read import open_result
from tests.rig.series.conftest import RATE, SIGMA


@pytest.fixture
def profile(result, monkeypatch, capsys):
    def run(*arguments):
        given = ["touchplate", "profile", str(result), "--json", *map(str, arguments)]
        monkeypatch.setattr(sys, "argv", given)
        with pytest.raises(SystemExit) as ended:
            cli.main()
        return ended.value.code, capsys.readouterr(), result.parent / "profile"

    return run


def rows_of(path):
    with path.open() as file:
        return list(csv.DictReader(file))


def test_a_line_reads_what_the_field_is_between_its_points(profile):
    code, said, out = profile("--line", "20,30,100.5,61", "--field", "u", "--field", "exx")
    assert code == 0, said.err
    files = ["line-1-exx.png", "line-1-u.png", "line-1.csv"]
    assert json.loads(said.out)["files"] == sorted(p.name for p in out.iterdir()) == files
    rows = rows_of(out / "line-1.csv")
    assert {row["frame"] for row in rows} == {"a.tif", "b.tif", "c.tif", "d.tif"}
    length = np.hypot(80.5, 31)
    assert float(rows[-1]["distance_px"]) == pytest.approx(length)
    for row in rows:
        x, number = float(row["x"]), int(row["number"])
        if number == 2:
            assert row["u"] == row["sigma_u"] == "nan"
            continue
        assert float(row["u"]) == pytest.approx(RATE * number * x, abs=1e-5)
        assert float(row["sigma_u"]) == pytest.approx(SIGMA)
        assert float(row["exx"]) == pytest.approx(RATE * number, abs=1e-8)


def test_an_extensometer_reads_the_stretch_over_time(profile):
    code, said, out = profile(
        "--extensometer", "20,30,110,30", "--extensometer", "20,20,20,70", "--interval", "0.5"
    )
    assert code == 0, said.err
    rows = rows_of(out / "readings.csv")
    assert [float(row["time_s"]) for row in rows] == [0, 0.5, 1, 1.5]
    for number in (0, 1, 3):
        row = {name: float(value) for name, value in rows[number].items() if name != "frame"}
        assert row["extensometer-1"] == pytest.approx(RATE * number, abs=1e-7)
        assert row["sigma_extensometer-1"] == pytest.approx(SIGMA * 2**0.5 / 90, rel=1e-3)
        assert row["extensometer-2"] == pytest.approx(0, abs=1e-7)
        assert row["sigma_extensometer-2"] == pytest.approx(2 * SIGMA * 2**0.5 / 50, rel=1e-3)
    assert rows[2]["extensometer-1"] == "nan"
    assert (out / "readings.png").stat().st_size > 5000


def test_regions_by_name_are_read_as_correlate_reads_them(profile, result):
    (result.parent / "r.toml").write_text(
        '[[extensometer]]\nname = "long"\nstart = [20, 40]\nend = [100, 40]\n'
        '[[gauge]]\nname = "mid"\npoints = [[30, 20], [90, 20], [90, 70], [30, 70]]\n'
    )
    code, said, out = profile("--regions", result.parent / "r.toml")
    assert code == 0, said.err
    row = rows_of(out / "readings.csv")[3]
    assert float(row["long"]) == pytest.approx(3 * RATE, abs=1e-7)
    assert float(row["mid_exx"]) == pytest.approx(3 * RATE, abs=1e-7)
    assert float(row["sigma_mid_exx"]) == pytest.approx(
        1e-5 * 53 / (7 * 8), rel=1e-3
    )  # 7 x 7 points a step of 8 apart, and a gauge length of 53


def test_a_gauge_reads_the_invariants_of_its_mean_strain(profile, result):
    (result.parent / "r.toml").write_text(
        '[[gauge]]\nname = "mid"\npoints = [[30, 20], [90, 20], [90, 70], [30, 70]]\n'
    )
    code, said, out = profile("--regions", result.parent / "r.toml")
    assert code == 0, said.err
    row = {n: float(x) for n, x in rows_of(out / "readings.csv")[3].items() if n != "frame"}
    true = {"principal_1": 1, "principal_2": 0, "max_shear": 1, "von_mises": 2 / 3**0.5}
    for name, times in true.items():
        assert row[f"mid_{name}"] == pytest.approx(times * 3 * RATE, abs=1e-7)
    assert row["mid_principal_angle"] == pytest.approx(0, abs=1e-6)
    one = row["sigma_mid_exx"]
    assert row["sigma_mid_max_shear"] == pytest.approx(one * 2**0.5, rel=1e-3)


def test_a_line_reads_invariants_that_the_file_does_not_hold(profile):
    code, said, out = profile("--line", "20,30,100,60", "--field", "max_shear")
    assert code == 0, said.err
    rows = [row for row in rows_of(out / "line-1.csv") if row["number"] == "3"]
    for row in rows:
        assert float(row["max_shear"]) == pytest.approx(3 * RATE, rel=1e-5)
        assert float(row["sigma_max_shear"]) == pytest.approx(1e-5 * 2**0.5, rel=1e-3)


@pytest.mark.parametrize(
    ("text", "what"),
    [
        ('[[extensometer]]\nname = "e"\nstart = [2, 2]\nend = [90, 40]', "extensometer 'e'"),
        ('[[gauge]]\nname = "g"\npoints = [[1e4, 9], [2e4, 9], [2e4, 99]]', "gauge 'g'"),
    ],
)
def test_what_lies_off_the_points_is_said_and_reads_nothing(profile, result, text, what):
    (result.parent / "r.toml").write_text(text)
    code, said, out = profile("--regions", result.parent / "r.toml")
    assert code == 0
    assert f"{what} lies off the points" in " ".join(said.err.split())
    for row in rows_of(out / "readings.csv"):
        assert {v for n, v in row.items() if n not in ("number", "frame")} == {"nan"}


def test_numbers_of_extensometers_pass_over_names_that_are_taken(profile, result):
    (result.parent / "r.toml").write_text(
        '[[extensometer]]\nname = "extensometer-1"\nstart = [20, 40]\nend = [20, 70]'
    )
    line = "--extensometer", "20,30,110,30"
    code, said, out = profile("--regions", result.parent / "r.toml", *line)
    assert code == 0, said.err
    row = rows_of(out / "readings.csv")[3]
    assert float(row["extensometer-1"]) == pytest.approx(0, abs=1e-7)
    assert float(row["extensometer-2"]) == pytest.approx(3 * RATE, abs=1e-7)


def test_sigma_between_points_is_an_upper_bound_of_the_scatter():
    grid = dic.Grid(np.arange(10, 90, 8), np.arange(10, 66, 8), 21, 8)
    rng = np.random.default_rng(4)
    places = rng.uniform((10, 10), (82, 58), (40, 2))
    between = lay(grid, places)
    drawn = [between.read(rng.normal(0, 1, grid.shape)) for _ in range(400)]
    ratio = np.std(drawn, axis=0) / between.read(np.ones(grid.shape))
    assert (ratio < 1.12).all()  # white noise; four standard deviations of the scatter
    alike = [between.read(np.full(grid.shape, n)) for n in rng.normal(0, 1, 400)]
    assert np.std(alike, axis=0).mean() == pytest.approx(1, abs=0.12)


class HalfOfANet:
    """A field that says of every other point that it is of a net."""

    attrs = {}  # noqa: RUF012

    def __init__(self, ref):
        self._values = np.arange(len(ref.xy)).reshape(ref.grid.shape) % 2

    def __getitem__(self, number):
        return self._values


def test_what_jumps_is_read_at_the_nearest_point(result, ref):
    with open_result(result) as opened:
        (status,) = profiles(opened, (12, 12, 100, 70), ("status",))
        x, y = ref.grid.xs[2], ref.grid.ys[3]
        ((first, *_),) = [one.values[1] for one in profiles(opened, (x + 3, y, x + 90, y), ("u",))]
    assert set(status.values[2][np.isfinite(status.values[2])]) == {-1}
    assert first == pytest.approx(RATE * (x + 3), abs=1e-6)
    nets = replace(opened, arrays={**opened.arrays, "by_net": HalfOfANet(ref)})
    (by_net,) = profiles(nets, (12, 12, 100, 70), ("by_net",))
    assert set(by_net.values[1]) == {0, 1}
    near = lay(ref.grid, np.array([[x + 3.0, y - 1.0], [0.0, 0.0]])).nearest()
    np.testing.assert_array_equal(near.read(ref.xy[:, 0]), [x, np.nan])


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ((), "name a --line"),
        (("--line", "1,2,3"), "two points in px"),
        (("--line", "1,2,3,nan"), "two points in px"),
        (("--line", "5,5,5,5"), "give it a length"),
        (("--line", "500,500,600,600"), "misses all points"),
        (("--line", "20,20,90,60", "--field", "nosuch"), "no field 'nosuch'"),
        (("--extensometer", "20,20,20,20"), "extensometer has both ends at (20, 20) px"),
        (("--line", "20,20,90,60", "--interval", "0"), "interval must be positive"),
    ],
)
def test_what_cannot_be_read_is_one_sentence(profile, arguments, words):
    code, said, out = profile(*arguments)
    assert code == 2
    assert said.err.count("\n") == 1
    assert words in said.err
    assert not out.exists()
