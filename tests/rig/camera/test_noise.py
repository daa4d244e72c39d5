"""The noise test against images of known noise, flicker and contrast."""

import numpy as np
import pytest

from rig.camera import InOrder
from rig.camera.files import ImageSequence
from rig.camera.noise import measure_noise

SHAPE = (60, 90)


class Still(InOrder):
    """A camera that is drawn: speckle of contrast 40 and noise of 2 grey levels."""

    dropped, status = 0, "drawn"

    def __init__(self, rng, flicker=0.0, frames=40):
        speckle = 128 + 40 * np.sign(rng.standard_normal(SHAPE))
        levels = 1 + flicker * rng.standard_normal(frames)
        noise = rng.normal(0, 2, (frames, *SHAPE))
        images = np.rint(speckle * levels[:, None, None] + noise).clip(0, 255).astype(np.uint8)
        super().__init__(ImageSequence("drawn", iter(images), rate=None))


def test_noise_and_contrast_of_a_still_camera_are_found(rng):
    noise = measure_noise(Still(rng), 40)
    assert noise.frames == 40
    assert noise.sigma == pytest.approx(np.sqrt(4 + 1 / 12), rel=0.01)  # rounding adds 1/12
    assert noise.contrast == pytest.approx(40, rel=0.01)
    assert noise.flicker < 0.0005
    assert noise.clipped == 0
    assert noise.mean == pytest.approx(128, abs=2)


def test_flickering_light_is_no_noise_of_the_pixels(rng):
    noise = measure_noise(Still(rng, flicker=0.01), 40)
    assert noise.flicker == pytest.approx(0.01, rel=0.4)
    # what is left of 1 % of light is the speckle's own brightening, 0.4 grey levels of 40
    assert noise.sigma == pytest.approx(np.hypot(2.02, 0.4), rel=0.05)


def test_a_camera_that_gives_nothing_is_one_sentence(rng):
    camera = Still(rng, frames=3)
    camera.grab = lambda timeout: None
    with pytest.raises(OSError, match="no images; no image came for 2 s"):
        measure_noise(camera, 5)
    with pytest.raises(ValueError, match="noise needs 2 frames or more, got 1"):
        measure_noise(Still(rng), 1)
