"""Regions of a file: what is refused in a sentence, and large ones that take no memory."""

import numpy as np
import pytest

import dic
from rig.series.gauges import gauge_strain, off_the_points
from rig.series.regions import Extensometer, Gauge, Regions, read_regions

GRID = dic.Grid(np.arange(10, 90, 8), np.arange(10, 66, 8), 21, 8)
LENGTH = '[[extensometer]]\nname = "{}"\nstart = [20, 20]\nend = [60, 30]\n'
GAUGE = '[[gauge]]\nname = "{}"\npoints = [[20, 20], [60, 20], [60, 50]]\n'


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (LENGTH.format("a") * 2, "the column 'a' of the readings is taken"),
        (LENGTH.format("frame"), "the column 'frame' of the readings is taken"),
        (LENGTH.format("time_s"), "the column 'time_s' of the readings is taken"),
        (LENGTH.format("sigma_a") + LENGTH.format("a"), "'sigma_a'"),
        (LENGTH.format("g_exx") + GAUGE.format("g"), "'g_exx'"),
        (LENGTH.format(""), "extensometer.0.name"),
        ("[[roi]]\npoints = [[1, 1], [nan, 3], [9, 9]]", "roi.0.points.1.0"),
        ("[[roi]]\npoints = [[1, 1], [inf, 3], [9, 9]]", "finite"),
        (GAUGE.format("g").replace("60, 50", "1e9, 1e9"), "gauge.0.points.2.0"),
        (LENGTH.format("a").replace("end", "to"), "unknown key 'to' in [extensometer[0]]"),
        (LENGTH.format("a").replace("end", "to"), "known are name, start, end"),
        ('[[gauge]]\nname = "g"', "gauge[0].points is missing; add it to [gauge[0]]"),
    ],
)
def test_what_cannot_be_read_apart_is_refused_in_a_sentence(tmp_path, text, words):
    (tmp_path / "r.toml").write_text(text)
    with pytest.raises(ValueError, match="correct it there") as refusal:
        read_regions(tmp_path / "r.toml")
    assert words in str(refusal.value)
    assert "\n" not in str(refusal.value)


def test_a_gauge_that_reaches_far_beyond_the_image_reads_what_is_on_it():
    wide = Gauge(name="g", points=[(40, -2e4), (2e4, -2e4), (2e4, 2e4), (40, 2e4)])
    x, _ = np.meshgrid(GRID.xs, GRID.ys)
    table = {name: x.ravel() * 1e-4 for name in ("exx", "eyy", "exy")}
    table |= {f"sigma_{name}": np.full(x.size, 1e-5) for name in table}
    right = [n for n in GRID.xs if n >= 40]
    mean, sigma = gauge_strain(wide, GRID, table, 8.0)["exx"]
    assert mean == pytest.approx(np.mean(right) * 1e-4)
    assert sigma == pytest.approx(1e-5 / np.sqrt(len(right) * len(GRID.ys)))


def test_what_lies_off_the_points_is_named():
    regions = Regions(
        extensometer=[
            Extensometer(name="on", start=(12, 12), end=(80, 50)),
            Extensometer(name="off", start=(12, 12), end=(95, 50)),
        ],
        gauge=[
            Gauge(name="across", points=[(50, 30), (300, 30), (300, 300)]),
            Gauge(name="away", points=[(200, 30), (300, 30), (300, 300)]),
        ],
    )
    said = off_the_points(regions, GRID)
    assert [one.split(" lies")[0] for one in said] == ["extensometer 'off'", "gauge 'away'"]
    assert all("(10, 10) to (82, 58) px" in one for one in said)
