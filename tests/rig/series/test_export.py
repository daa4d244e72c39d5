"""A whole test for other programs, read back by those programs' own readers."""

import csv
import json
import sys
from xml.etree import ElementTree as ET

import cv2
import h5py
import meshio
import numpy as np
import pytest
from scipy.io import loadmat

from rig import cli
from rig.series.read import open_result
from tests.rig.series.conftest import RATE, SHAPE


@pytest.fixture
def export(result, monkeypatch, capsys):
    def run(*arguments, path=result):
        out = result.parent / "out"
        given = ["touchplate", "export", str(path), str(out), "--json", *map(str, arguments)]
        monkeypatch.setattr(sys, "argv", given)
        with pytest.raises(SystemExit) as ended:
            cli.main()
        return ended.value.code, capsys.readouterr(), out

    return run


def written(run):
    code, said, out = run
    assert code == 0, said.err
    count = json.loads(said.out)
    assert count["frames"] == 4
    assert count["files"] == len(list(out.iterdir()))
    return out


def test_csv_holds_a_line_a_point(export, ref):
    out = written(export("--to", "csv"))
    with (out / "frame-000003.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == len(ref.xy)
    for row, (x, y) in zip(rows, ref.xy, strict=True):
        assert (float(row["x"]), float(row["y"])) == (x, y)
        assert float(row["u"]) == pytest.approx(3 * RATE * x, rel=1e-6)
        assert row["status"] == "0"
    with (out / "frames.csv").open() as file:
        frames = list(csv.DictReader(file))
    assert [frame["frame"] for frame in frames] == ["a.tif", "b.tif", "c.tif", "d.tif"]
    assert frames[2]["error"] == 'no "image", cut short'


def test_npz_and_mat_hold_the_same_arrays(export, ref):
    out = written(export("--to", "npz"))
    npz = dict(np.load(out / "fields.npz", allow_pickle=False))
    files = export("--to", "mat", "--force")[2]
    mat = loadmat(files / "fields.mat", simplify_cells=True)
    rows, columns = ref.grid.shape
    for arrays in (npz, mat):
        assert arrays["u"].shape == (4, rows, columns)
        np.testing.assert_allclose(arrays["u"][3], 3 * RATE * arrays["x"], rtol=1e-6)
        assert np.isnan(arrays["u"][2]).all()
        assert list(arrays["frame"]) == ["a.tif", "b.tif", "c.tif", "d.tif"]
        assert arrays["error"][2].startswith("no ")
    assert mat["settings"]["subset"] == 21


def test_vtu_is_a_surface_a_frame_that_the_pvd_names(export, ref):
    out = written(export("--to", "vtu"))
    sets = ET.parse(out / "frames.pvd").getroot().findall(".//DataSet")
    assert [one.get("timestep") for one in sets] == ["0", "1", "2", "3"]
    mesh = meshio.read(out / sets[3].get("file"))
    rows, columns = ref.grid.shape
    assert len(mesh.cells_dict["quad"]) == (rows - 1) * (columns - 1)
    np.testing.assert_allclose(mesh.points[:, :2], ref.xy)
    np.testing.assert_allclose(mesh.point_data["displacement"][:, 0], 3 * RATE * ref.xy[:, 0])
    np.testing.assert_allclose(mesh.point_data["exx"], 3 * RATE, rtol=1e-6)


def test_plots_of_all_frames_have_one_scale(export):
    out = written(export("--to", "png", "--field", "u"))
    plots = [cv2.imread(str(path)) for path in sorted(out.iterdir())]
    assert len(plots) == 4
    height, width = plots[0].shape[:2]
    bar = [plot[60 : height - 80, width - 170 : width - 60] for plot in plots]
    for one in bar[1:]:
        np.testing.assert_array_equal(one, bar[0])
    inner = [plot[height // 2 - 20 : height // 2, width // 2 - 20 : width // 2] for plot in plots]
    assert np.ptp(inner[2], axis=2).max() == 0  # nothing measured: grey
    assert np.abs(inner[3].astype(int) - inner[0]).mean() > 20


def test_the_video_has_every_frame(export):
    out = written(export("--to", "mp4", "--field", "exx"))
    video = cv2.VideoCapture(str(out / "exx.mp4"))
    frames = [video.read()[0] for _ in range(5)]
    assert frames == [True] * 4 + [False]


def test_invariants_that_the_file_does_not_hold_follow_from_its_strain(export):
    out = written(export("--to", "npz"))
    npz = np.load(out / "fields.npz", allow_pickle=False)
    np.testing.assert_allclose(npz["von_mises"][3], 2 / 3**0.5 * 3 * RATE, rtol=1e-5)
    np.testing.assert_allclose(npz["sigma_principal_1"][3], 1e-5, rtol=1e-5)
    assert np.isnan(npz["max_shear"][2]).all()
    files = export("--to", "png", "--field", "von_mises", "--force")[2]
    assert len(list(files.glob("von_mises-*.png"))) == 4


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--to", "png", "--field", "nosuch"), "no field 'nosuch'; name one of u, v, "),
        (("--to", "tiff"), "which is not exported to tiff; use csv, npz"),
    ],
)
def test_what_it_does_not_hold_is_one_sentence(export, arguments, words):
    refused(export(*arguments), words)


def test_a_result_cut_short_is_one_sentence(export, result):
    short = result.with_name("short.h5")
    short.write_bytes(result.read_bytes()[:-700])
    refused(export("--to", "csv", path=short), "cut short")


def test_a_result_of_another_version_is_one_sentence(export, result):
    with h5py.File(result, "a") as file:
        file.attrs["version"] = 99
    refused(export("--to", "npz"), "has version 99 and this program reads 2")


def test_a_result_whose_bytes_changed_is_one_sentence(export, result):
    with h5py.File(result, "a") as file:
        del file["u"]
        file["u"] = np.zeros((3, 2, 2))
    refused(export("--to", "npz"), "damaged")


def test_a_file_of_one_pair_is_no_result(result):
    other = result.with_name("other.h5")
    with h5py.File(other, "w") as file:
        file["u"] = np.zeros(SHAPE)
    with pytest.raises(OSError, match="no result of a whole test"), open_result(other):
        pass


def refused(done, words):
    code, said, out = done
    assert code == 2
    assert said.err.count("\n") == 1
    assert words in said.err
    assert not out.exists()
