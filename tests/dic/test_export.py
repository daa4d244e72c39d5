"""Fields to files: whole or not at all."""

import csv

import h5py
import numpy as np
import pytest
from PIL import Image

import dic


@pytest.fixture(scope="module")
def measured(pattern, reference):
    roi = np.ones(reference.shape, dtype=bool)
    roi[60:90, 70:110] = False
    ref = dic.prepare(reference, step=9, roi=roi, prefilter=0.5)
    disp = dic.correlate(ref, pattern.draw((0.4, 0.2)))
    return disp, dic.strain(disp)


def test_hdf5_holds_every_field_as_an_image_with_its_unit(tmp_path, measured):
    disp, eps = measured
    dic.export.write_hdf5(tmp_path / "field.h5", disp, eps)
    with h5py.File(tmp_path / "field.h5") as file:
        np.testing.assert_array_equal(file["u"][()].ravel(), disp.u)
        assert file["exx"].shape == disp.grid.shape
        assert file["sigma_u"].attrs["unit"] == "px"
        assert file["status"].attrs["LOW_CORRELATION"] == dic.Status.LOW_CORRELATION
        assert dict(file.attrs) == {
            "subset": 21, "order": 1, "prefilter": 0.5, "step": 9,
            "strain_kind": "small", "strain_window": 5, "vsg": 57,
        }  # fmt: skip


def test_csv_can_be_read_back(tmp_path, measured):
    disp, eps = measured
    dic.export.write_csv(tmp_path / "field.csv", disp, eps)
    with (tmp_path / "field.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == len(disp.u)
    fields = {
        "x": disp.xy[:, 0], "y": disp.xy[:, 1], "u": disp.u, "v": disp.v,
        "sigma_u": disp.sigma_u, "sigma_v": disp.sigma_v, "zncc": disp.zncc,
        "iterations": disp.iterations, "valid_fraction": disp.valid_fraction,
        "status": disp.status, "exx": eps.exx, "eyy": eps.eyy, "exy": eps.exy,
        "sigma_exx": eps.sigma[:, 0], "sigma_eyy": eps.sigma[:, 1], "sigma_exy": eps.sigma[:, 2],
        "strain_valid": eps.valid,
    }  # fmt: skip
    assert list(rows[0]) == list(fields)
    for name, values in fields.items():
        np.testing.assert_allclose([float(r[name]) for r in rows], values, rtol=1e-8)
    assert {r["status"] for r in rows} == {"0", "1"}


def test_plots_show_every_field(tmp_path, measured, reference):
    paths = dic.export.draw_fields(tmp_path / "plots", reference, *measured)
    names = {p.stem for p in paths}
    assert names >= {"u", "v", "exx", "eyy", "exy", "sigma_u", "zncc", "status"}
    for path in paths:
        assert path.stat().st_size > 5000
    assert len(list((tmp_path / "plots").iterdir())) == len(paths)


def test_one_plot_shows_them_together(tmp_path, measured, reference):
    dic.export.draw_overview(tmp_path / "fields.png", reference, *measured)
    alone = dic.export.draw_fields(tmp_path, reference, *measured)[0]
    with Image.open(tmp_path / "fields.png") as sheet, Image.open(alone) as one:
        assert sheet.width > 1.5 * one.width


def test_scattered_points_can_be_written_too(tmp_path, pattern, reference):
    disp = dic.correlate(dic.prepare(reference, points=[[60, 50], [120, 90]]), pattern.draw((1, 2)))
    eps = dic.strain(disp)
    dic.export.write_hdf5(tmp_path / "a.h5", disp, eps)
    dic.export.write_csv(tmp_path / "a.csv", disp, eps)
    assert len(dic.export.draw_fields(tmp_path, reference, disp, eps)) >= 8
    dic.export.draw_overview(tmp_path / "all.png", reference, disp, eps)


def test_failed_write_leaves_the_old_file_and_no_other(tmp_path):
    path = tmp_path / "a.txt"
    path.write_text("old")

    def fail_half_way():
        with dic.export.aside(path) as draft:
            draft.write_text("half")
            raise RuntimeError

    with pytest.raises(RuntimeError):
        fail_half_way()
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


def test_missing_folder_is_one_sentence(tmp_path, measured):
    with pytest.raises(OSError, match="does not exist; create it first"):
        dic.export.write_csv(tmp_path / "none" / "a.csv", *measured)
