"""Exported images, read by other programs."""

from types import SimpleNamespace

import numpy as np
import pytest
import tifffile
from PIL import Image

from rig.recording.export import to_tiff

SHAPE = 48, 80


@pytest.fixture
def images():
    """Draw images as noisy as a camera's, which nothing makes smaller."""
    return np.random.default_rng(4).integers(0, 256, (2, *SHAPE), np.uint8)


@pytest.mark.parametrize("read", [tifffile.imread, Image.open])
def test_a_tiff_is_as_large_as_its_pixels_and_others_read_it(images, read, tmp_path):
    session = SimpleNamespace(frames=2, row=lambda index: {"frames/image": images[index]})
    paths = to_tiff(session, tmp_path, lambda done, total: None)
    assert [path.name for path in paths] == ["frame-000000.tiff", "frame-000001.tiff"]
    for path, image in zip(paths, images, strict=True):
        np.testing.assert_array_equal(np.asarray(read(path)), image)
        assert path.stat().st_size < image.nbytes + 1000
