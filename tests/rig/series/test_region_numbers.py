"""Numbers in a file of regions that no image has."""

import pytest

from rig.series.regions import read_regions


def gauge(tmp_path, number):
    path = tmp_path / "regions.toml"
    path.write_text(
        f'[[gauge]]\nname = "a"\npoints = [[10, 20], [90, {number}], [90, 70]]\n', encoding="utf-8"
    )
    return path


def test_a_point_beside_the_image_is_one(tmp_path):
    read = read_regions(gauge(tmp_path, -4.5))
    assert read.gauge[0].points == [(10, 20), (90, -4.5), (90, 70)]


@pytest.mark.parametrize("number", ["nan", "inf", "-inf", "1e300", "-20001"])
def test_a_number_that_no_image_has_is_refused_with_its_place(number, tmp_path):
    with pytest.raises(ValueError, match=r"gauge\.0\.points\.1\.1: input should .*; correct it"):
        read_regions(gauge(tmp_path, number))
