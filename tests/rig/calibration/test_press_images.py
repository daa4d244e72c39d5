"""Images of presses, out of a folder or a video."""

import cv2
import numpy as np
import pytest

from rig.calibration.press_images import read_press_images

GREYS = [40, 42, 80, 90, 100, 110, 200]
PRESSES = [(2, 4), (4, 6)]


@pytest.fixture
def images(rng):
    texture = rng.integers(0, 20, (48, 64))
    return [np.asarray(texture + grey, np.uint8) for grey in GREYS]


def folder_of(images, path):
    path.mkdir()
    for number, image in enumerate(images):
        cv2.imwrite(str(path / f"frame{number}.png"), image)
    return path


def video_of(images, path):
    """Write a video that loses nothing."""
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter_fourcc(*"FFV1"), 30, (64, 48), isColor=True)
    for image in images:
        writer.write(cv2.cvtColor(image, cv2.COLOR_GRAY2BGR))
    writer.release()
    return path


@pytest.mark.parametrize("made", [folder_of, video_of])
def test_presses_are_the_means_of_their_frames(images, tmp_path, made):
    source = made(images, tmp_path / "presses.avi")
    found = read_press_images(source, 2, PRESSES)
    for seen, written in zip(found.reference, images[:2], strict=True):
        assert np.abs(seen.astype(int) - written).max() <= 1  # colours and back
    for mean, (first, last) in zip(found.means, PRESSES, strict=True):
        assert mean.dtype == np.float32
        np.testing.assert_allclose(mean, np.mean(images[first : last + 1], axis=0), atol=1.0)


@pytest.mark.parametrize("made", [folder_of, video_of])
def test_a_list_that_names_more_than_there_is_is_refused(images, tmp_path, made):
    source = made(images, tmp_path / "presses.avi")
    with pytest.raises(
        OSError, match=r"holds 7 images, counted from 0, and the list names frame 9"
    ):
        read_press_images(source, 2, [(2, 4), (5, 9)])


def test_what_is_not_there_is_called_neither(tmp_path):
    with pytest.raises(OSError, match=r"there is no folder or video '.*none\.avi'; check the path"):
        read_press_images(tmp_path / "none.avi", 2, PRESSES)
