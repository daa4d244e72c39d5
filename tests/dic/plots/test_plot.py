"""Plots of fields: every colour where its value lies, and a scale for whatever comes."""

import numpy as np
import pytest
from PIL import Image

import dic
from dic.fields.displacement import DisplacementField
from dic.plots import plot

SIZE = (120, 190)  # px, rows and columns
STEP, PANEL = 10, 900 / 190  # px between points; px of the file to one of the image
LEFT, TOP = 75, 40  # px of the file before the image


@pytest.fixture(scope="module")
def field(pattern):
    still = pattern.draw((0.0, 0.0))[: SIZE[0], : SIZE[1]]
    return dic.correlate(dic.prepare(still, step=STEP), still)


def drawn(path, field: DisplacementField, name, values):
    """Colours (N, 3) at the points, on a black image."""
    plot.draw(path, np.zeros(SIZE), name, values, field)
    with Image.open(path) as file:
        pixels = np.asarray(file)
    x, y = np.rint((field.xy + 0.5) * PANEL + (LEFT, TOP)).astype(int).T
    return pixels[y, x].astype(int)


def test_every_status_has_a_colour_of_its_own(tmp_path, field):
    status = np.arange(len(field.xy)) % len(dic.Status)
    colours = drawn(tmp_path / "a.png", field, "status", status)
    seen = {tuple(colour) for colour in colours}
    assert len(seen) == len(dic.Status)
    assert all(len(np.unique(colours[status == s], axis=0)) == 1 for s in dic.Status)


def test_stretch_is_red_and_compression_blue_where_it_is(tmp_path, field):
    stretch = 1e-4 * (field.xy[:, 0] - 95) - 2e-4 * (field.xy[:, 1] - 60)
    red, _, blue = drawn(tmp_path / "a.png", field, "exx", stretch).T
    clear = np.abs(stretch) > 1e-3
    np.testing.assert_array_equal((red > blue)[clear], stretch[clear] > 0)


def test_points_that_were_lost_show_the_bare_image(tmp_path, field):
    u = field.xy[:, 0].copy()
    u[::3] = np.nan
    colours = drawn(tmp_path / "a.png", field, "u", u)
    np.testing.assert_array_equal(colours.any(axis=1), np.isfinite(u))


@pytest.mark.parametrize("values", [0.0, 100.4, -3e9, np.nan, np.inf])
@pytest.mark.parametrize("spread", [0.0, 1e-13, 1e-5, 7e8])
def test_any_range_of_values_can_be_drawn(tmp_path, field, values, spread):
    path = tmp_path / "a.png"
    drawn(path, field, "v", values + spread * np.linspace(-1, 1, len(field.xy)))
    assert path.stat().st_size > 0


def test_a_long_image_can_be_drawn(tmp_path, pattern):
    strip = pattern.draw((0.0, 0.0))[:31, :150].repeat(6, axis=1)
    field = dic.correlate(dic.prepare(strip), strip)
    dic.export.draw_overview(tmp_path / "a.png", strip, field, dic.strain(field, window=3))
    assert (tmp_path / "a.png").stat().st_size > 0
