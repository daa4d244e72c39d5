"""Images from files."""

import numpy as np
import pytest
from PIL import Image

import dic


@pytest.fixture
def grey():
    return np.random.default_rng(0).integers(0, 255, (40, 60), dtype=np.uint8)


@pytest.mark.parametrize("suffix", ["png", "tif", "bmp"])
def test_eight_bit_grey_comes_back_unchanged(tmp_path, grey, suffix):
    Image.fromarray(grey).save(tmp_path / f"a.{suffix}")
    np.testing.assert_array_equal(dic.read_image(tmp_path / f"a.{suffix}"), grey)


@pytest.mark.parametrize("suffix", ["png", "tif"])
def test_sixteen_bit_grey_comes_back_unchanged(tmp_path, grey, suffix):
    deep = grey.astype(np.uint16) * 200
    Image.fromarray(deep).save(tmp_path / f"a.{suffix}")
    found = dic.read_image(tmp_path / f"a.{suffix}")
    assert found.dtype == np.uint16
    np.testing.assert_array_equal(found, deep)


def test_grey_stored_as_colour_is_accepted(tmp_path, grey):
    Image.fromarray(np.stack([grey] * 3, axis=-1)).save(tmp_path / "a.png")
    np.testing.assert_array_equal(dic.read_image(tmp_path / "a.png"), grey)


def test_colour_is_refused(tmp_path, grey):
    Image.fromarray(np.stack([grey, 255 - grey, grey], axis=-1)).save(tmp_path / "a.png")
    with pytest.raises(ValueError, match=r"is not grey .*; convert it"):
        dic.read_image(tmp_path / "a.png")


@pytest.mark.parametrize("suffix", ["png", "bmp", "jpg", "tif"])
@pytest.mark.parametrize("fraction", [0.5, 0.9])
def test_truncated_file_is_damaged(tmp_path, grey, suffix, fraction):
    path = tmp_path / f"a.{suffix}"
    Image.fromarray(grey).save(path)
    path.write_bytes(path.read_bytes()[: int(fraction * path.stat().st_size)])
    with pytest.raises(OSError, match=r"damaged|not an image"):
        dic.read_image(path)


def test_missing_file_and_other_files_are_named(tmp_path):
    with pytest.raises(FileNotFoundError, match="does not exist"):
        dic.read_image(tmp_path / "none.png")
    (tmp_path / "a.png").write_text("no image")
    with pytest.raises(OSError, match="not an image"):
        dic.read_image(tmp_path / "a.png")
