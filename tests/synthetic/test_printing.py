"""The printed pattern: true to scale, every spot in its place."""

import re
import zlib

import numpy as np
import pytest
from PIL import Image
from scipy import ndimage

import synthetic
from synthetic.printing import MARGIN

SPECKLE = synthetic.Speckle((60.0, 36.0), diameter=2.0, density=0.3, seed=2)
PATTERN = SPECKLE.draw()
DPI = 508.0  # 20 dots a millimetre


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    home = tmp_path_factory.mktemp("print")
    synthetic.print_pattern(home / "plate.png", PATTERN, dpi=DPI)
    synthetic.print_pattern(home / "plate.pdf", PATTERN)
    return home


def test_a_png_has_the_size_of_the_plate_and_its_margin_at_the_stated_resolution(folder):
    with Image.open(folder / "plate.png") as image:
        assert image.size == (20 * (60 + 30), 20 * (36 + 30))
        assert image.info["dpi"] == pytest.approx((DPI, DPI), rel=1e-4)


def test_a_png_has_its_spots_where_the_pattern_has_them(folder):
    with Image.open(folder / "plate.png") as image:
        dark = 1 - np.asarray(image.convert("L")) / 255
    y, x = (part / 20 - MARGIN for part in np.indices(dark.shape) + 0.5)
    y = 36 - y
    from_others = np.linalg.norm(PATTERN.centres[:, None] - PATTERN.centres, axis=2)
    np.fill_diagonal(from_others, np.inf)
    alone = np.flatnonzero((from_others - PATTERN.radii).min(axis=1) > PATTERN.radii + 0.3)
    assert len(alone) > 5
    for spot in alone:
        near = np.hypot(x - PATTERN.centres[spot, 0], y - PATTERN.centres[spot, 1])
        ink = np.where(near < PATTERN.radii[spot] + 0.15, dark, 0)
        middle = np.array([(ink * x).sum(), (ink * y).sum()]) / ink.sum()
        # Measured 0.01 mm.
        assert np.abs(middle - PATTERN.centres[spot]).max() < 0.03
        assert ink.sum() / 400 == pytest.approx(np.pi * PATTERN.radii[spot] ** 2, rel=0.03)


def test_the_corner_marks_measure_the_plate(folder):
    with Image.open(folder / "plate.png") as image:
        dark = np.asarray(image.convert("L")) < 128
    below = dark[-int(20 * (MARGIN - 2)) :, :][: 20 * 3]  # rows of the lower marks alone
    columns = np.flatnonzero(below.all(axis=0))
    groups = ndimage.label(np.isin(np.arange(dark.shape[1]), columns))[0]
    marks = [np.flatnonzero(groups == n).mean() for n in range(1, groups.max() + 1)]
    assert len(marks) == 2
    assert (marks[1] - marks[0]) / 20 == pytest.approx(60.0, abs=0.06)


def test_a_pdf_is_a_page_of_curves_at_true_scale(folder):
    raw = (folder / "plate.pdf").read_bytes()
    box = re.search(rb"/MediaBox \[ 0 0 ([\d.]+) ([\d.]+) \]", raw)
    assert np.array(box.groups(), float) == pytest.approx(np.array([90, 66]) * 72 / 25.4, rel=1e-6)
    streams = re.findall(rb"stream\r?\n(.*?)\r?\nendstream", raw, re.DOTALL)
    drawn = b"".join(zlib.decompress(part) for part in streams if part[:1] == b"x")
    # A circle of matplotlib is eight Bézier curves.
    assert len(re.findall(rb"^\S+ \S+ \S+ \S+ \S+ \S+ c$", drawn, re.MULTILINE)) >= 8 * len(
        PATTERN.centres
    )
    assert b"/Subtype /Image" not in raw


@pytest.mark.parametrize(
    ("name", "dpi", "sentence"),
    [
        ("plate.svg", 600.0, r"to \.pdf or \.png, got 'plate\.svg'"),
        ("plate.png", 30.0, "at least 51 for spots of 2 mm, got 30"),
        ("plate.png", np.nan, "dots per inch"),
    ],
)
def test_bad_input_is_named_in_one_sentence(tmp_path, name, dpi, sentence):
    with pytest.raises(ValueError, match=sentence):
        synthetic.print_pattern(tmp_path / name, PATTERN, dpi)


def test_a_file_that_cannot_be_written_is_an_error_of_the_system(tmp_path):
    with pytest.raises(OSError, match=r"absent does not exist; create it first"):
        synthetic.print_pattern(tmp_path / "absent" / "plate.pdf", PATTERN)
