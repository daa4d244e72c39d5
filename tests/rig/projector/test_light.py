"""The projector's light: seen by the camera, and divided out."""

import numpy as np
import pytest

from rig.calibration.projector import brightness
from rig.live.snapshot import Mark
from rig.projector.display_log import DisplayLog
from rig.projector.light_correction import LightCorrected
from rig.projector.light_map import divided, prepare_light_map
from rig.projector.markers import Screen, draw_marks, fit_plate
from rig.system.frame import Frame

SCREEN = fit_plate((640, 400), (254.0, 180.0))
CAMERA = (500, 380)
SLANT = np.array([[1.7, 0.05, 22.0], [0.03, -1.8, 350.0], [1e-4, -2e-4, 1.0]])
DARK = 51.0


def grey(rng, size=CAMERA):
    return rng.uniform(60, 180, size[::-1])


def test_light_falls_where_the_homographies_put_it():
    light = prepare_light_map(SCREEN, SLANT, CAMERA, 1.0).on_camera(
        draw_marks([Mark(80.0, 60.0, 1.0)], SCREEN)
    )
    rows, columns = np.indices(light.shape)
    column, row = (np.average(axis, weights=light - 1) for axis in (columns, rows))
    x, y, w = SLANT @ (80.0, 60.0, 1.0)
    assert np.hypot(column - x / w, row - y / w) < 0.5
    assert light.min() == 1.0
    assert not (
        prepare_light_map(SCREEN, SLANT, CAMERA, 1.0).on_camera(draw_marks([], SCREEN)) != 1.0
    ).any()


def test_an_image_divided_by_its_light_is_the_image_without(rng):
    sharp = grey(rng)
    light = prepare_light_map(SCREEN, SLANT, CAMERA, 0.8, 20.0).on_camera(
        draw_marks([Mark(80.0, 60.0, 3.0, (5.0, 3.0, 0.3)), Mark(200.0, 30.0, 1.0)], SCREEN)
    )
    seen = np.rint(20 + (sharp - 20) * light).astype(np.uint8)
    assert np.abs(seen - sharp).max() > 5
    assert np.abs(divided(seen, light, 20.0) - sharp).max() <= 1.0  # rounded twice


def test_an_image_without_light_stays_itself(rng):
    image = grey(rng).astype(np.uint8)
    assert divided(image, np.ones(image.shape, np.float32)) is image


def test_a_negative_strength_is_refused():
    with pytest.raises(ValueError, match="strength must be 0 or more, got -1; measure it again"):
        prepare_light_map(SCREEN, SLANT, CAMERA, -1.0)


@pytest.mark.parametrize(("strength", "black"), [(0.4, 12.0), (2.0, 0.0)])
def test_strength_and_black_come_from_white_and_dark_images(rng, strength, black):
    dark = grey(rng) * 0.4
    lit = dark + strength * (dark - black)
    noise = rng.normal(0, 1.0, (2, *dark.shape))
    there = np.ones(dark.shape, bool)
    lit[:, ::7] = 255.0  # too bright for the camera
    found = brightness((lit + noise[0]).clip(0, 255), dark + noise[1], there)
    assert found[0] == pytest.approx(strength, rel=0.03)
    assert found[1] == pytest.approx(black, abs=1.0)


def test_frames_are_divided_by_what_was_shown_when_they_were_taken(rng):
    sharp, shown = grey(rng), DisplayLog()
    early, late = (Mark(80.0, 60.0, 3.0),), (Mark(180.0, 100.0, 2.0),)
    shown.add(10.0, early)
    shown.add(11.0, late)
    light = prepare_light_map(SCREEN, SLANT, CAMERA, 1.0)
    for time, on in ((9.9, ()), (10.5, early), (11.01, early), (11.2, late)):
        seen = (
            np.rint(sharp * light.on_camera(draw_marks(on, SCREEN))).clip(0, 255).astype(np.uint8)
        )

        class One:
            def grab(self, timeout, frame=Frame(4, time, seen)):  # noqa: B008
                return frame

        frame = LightCorrected(One(), shown, SCREEN, light, 0.05).grab(1.0)
        assert np.abs(frame.image - sharp).max() <= 1.0
        assert (frame.sequence, frame.captured) == (4, time)


def test_the_border_of_light_lies_half_a_pixel_beyond_the_last_lit_one():
    plain = np.zeros((380, 500, 3), np.uint8)
    plain[40:60, 100:130] = 255
    same = Screen((500, 380), np.eye(3))
    light = prepare_light_map(same, np.eye(3), CAMERA, 1.0).on_camera(plain)
    np.testing.assert_array_equal(light - 1.0, plain[..., 0] / 255)
    fine = prepare_light_map(same, np.diag([2.0, 2.0, 1.0]), (1000, 760), 1.0).on_camera(plain)
    lit = np.argwhere(fine > 1.5)  # the middle of each edge, at 2 (99.5) = 199 and 2 (129.5) = 259
    np.testing.assert_allclose(lit.min(axis=0), [79, 199], atol=1)
    np.testing.assert_allclose(lit.max(axis=0), [119, 259], atol=1)


def test_the_black_of_the_camera_is_not_divided():
    image = np.full((3, 4), 20, np.uint8)
    np.testing.assert_array_equal(divided(image, np.full((3, 4), 1.7, np.float32), 20.0), image)
