"""Brightness out of the bytes that cameras send."""

import cv2
import numpy as np
import pytest

from rig.camera.pixels import brightness

SIZE = (6, 4)  # width, height


@pytest.fixture
def grey(rng):
    return rng.integers(0, 256, SIZE[::-1], dtype=np.uint8)


def padded(rows, line):
    """Lines that the driver has made longer."""
    raw = np.full((len(rows), line), 99, np.uint8)
    raw[:, : rows.shape[1]] = rows
    return raw


@pytest.mark.parametrize("padding", [0, 5])
def test_brightness_is_every_byte_of_grey_and_the_first_of_each_pair_of_yuyv(grey, rng, padding):
    colour = rng.integers(0, 256, grey.shape, dtype=np.uint8)
    pairs = np.stack([grey, colour], axis=-1).reshape(len(grey), -1)
    for code, rows in (("GREY", grey), ("YUYV", pairs)):
        line = rows.shape[1] + padding
        found = brightness(padded(rows, line), code, SIZE, line if padding else None)
        np.testing.assert_array_equal(found, grey)


def test_what_is_cut_off_is_no_image(grey):
    assert brightness(grey.ravel()[:-1], "GREY", SIZE) is None
    jpeg = cv2.imencode(".jpg", grey)[1].ravel()
    assert brightness(jpeg[:-2], "MJPG", SIZE) is None
    assert brightness(np.append(jpeg, np.zeros(7, np.uint8)), "MJPG", SIZE).shape == grey.shape


def test_the_brightness_is_a_copy(grey):
    found = brightness(grey, "GREY", SIZE)
    before = found.copy()
    grey[:] = 0
    np.testing.assert_array_equal(found, before)
