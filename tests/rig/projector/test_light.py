"""The projector's light: seen, divided out, and what it does to touches predicted."""

import numpy as np
import pytest

import fe
import models
import synthetic
from dic.tiles.tiles import lay_tiles
from rig.calibration.projector import brightness
from rig.live import chain as live
from rig.live.baseline import ReferenceFrame
from rig.live.snapshot import Mark
from rig.live.view import look, marks
from rig.projector.display_log import DisplayLog
from rig.projector.interference import Interference, interference
from rig.projector.light_correction import LightCorrected
from rig.projector.light_map import divided, prepare_light_map
from rig.projector.markers import draw_marks, fit_plate
from rig.system.frame import Frame
from rig.system.timing import Stopwatch

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


def test_the_meter_says_beforehand_how_far_light_moves_a_touch():
    plate = fe.Plate((254.0, 203.0), 2.0, 3000.0, 0.38, fe.Clamped())
    camera = synthetic.pinhole_above(plate.size, 500.0, (384, 320))
    pattern = synthetic.speckle(plate.size, diameter=3.5, softness=0.75)
    warper = synthetic.prepare_warp(pattern, camera, 1.0)
    solver = fe.Linear(plate, fe.grid(plate, 32))
    rest = photograph(warper, np.zeros((len(warper.points), 3)))
    tiles = lay_tiles(rest.shape, 8)
    motions = models.prepare_motions(fe.modes(plate, 60), camera, 1.0, tiles)
    chain = live.prepare_chain(ReferenceFrame(rest.astype(np.float32), 2.0), motions, 1)
    screen = fit_plate((640, 512), plate.size)
    light_map = prepare_light_map(
        screen, look(plate, camera, 1.0).T_px_plate, camera.size, 1.0, DARK
    )
    predicted, happened = [], []
    for x, y in ((70.0, 60.0), (127.0, 101.0), (190.0, 140.0)):
        touch = fe.Touch(x, y, 2.0)
        image = photograph(warper, solver.deflect((touch,)).displacement(warper.points, "top"))
        light = light_map.on_camera(draw_marks([Mark(x, y, 2.0)], screen))
        clear = found(chain, image)
        lit = found(chain, DARK + (image - DARK) * light)
        said = interference(chain, light, DARK, marks(clear))
        predicted.append(said.shift)
        happened.append(np.hypot(*(lit.xy[0] - clear.xy[0])))
        assert said.sigmas > 0
    ratio = np.array(predicted) / happened
    assert ((ratio > 0.4) & (ratio < 2.5)).all()  # measured 0.8 to 2.1; the rest is second order


def photograph(warper, moved):
    """Image without noise, grey levels."""
    return DARK + 0.52 * warper.render(moved, None, None)


def found(chain, image):
    return live.estimate_frame(chain, image, live.at_rest(chain), Stopwatch(lambda: 0.0)).estimate


def test_the_meter_speaks_only_where_light_does_harm():
    assert Interference(0.1, 0.01, 0.3).sentence == ""
    assert "moves a touch by 1.2 mm, 2.0 of its uncertainty" in Interference(1.2, 0.1, 2.0).sentence
