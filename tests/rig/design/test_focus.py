"""Focus of a design, against rays that are traced through a thin lens."""

from dataclasses import replace

import numpy as np
import pytest

from rig.design.changes import changes
from rig.design.focus import blur_of
from rig.design.limits import refusal
from rig.design.outlook import search_for
from rig.design.prediction import _patch as patch_of, predict
from rig.design.setup import at_distance, setup_of
from rig.scene.refusal import SceneError

LENS = {"focal": "25 mm", "f_number": 4, "focus": "500 mm"}


def traced(focal, f_number, focus, depth, pixel):
    """Trace the two outermost rays of a point on the axis to the sensor; gives their distance, px.

    A thin lens turns a ray by its height over the focal length.
    """
    sensor = 1 / (1 / focal - 1 / focus)
    edge = focal / f_number / 2
    slope = edge / depth - edge / focal
    return 2 * abs(edge + slope * sensor) / pixel


def pixel_of(camera, focal, focus):
    """Size of a pixel behind such a lens, mm."""
    return 1 / (1 / focal - 1 / focus) / camera.focal


@pytest.mark.parametrize("focus", [420.0, 500.0, 640.0])
def test_the_circle_is_that_of_traced_rays(small, focus):
    scene = small({"camera.lens": LENS | {"focus": focus}, "plate.size": [254, 203]})
    given = setup_of(scene)
    camera = given.camera.build(given.plate)
    depth = given.camera.stand_off - camera.face_height(given.plate.thickness)
    blur = blur_of(given)
    assert blur.depths == pytest.approx((depth, depth))
    expected = traced(25.0, 4.0, focus, depth, pixel_of(camera, 25.0, focus))
    assert blur.circles == pytest.approx((expected, expected), rel=1e-9)


@pytest.mark.slow
def test_what_is_out_of_focus_is_refused_with_a_remedy(small):
    def lens(**changes):
        return small({"plate.thickness": 1.5, "camera.lens": LENS | changes})

    assert not refusal(lens())
    why = refusal(lens(focus=250, f_number=1.4))
    assert why.startswith("camera.lens.focus is 250 mm and the plate is 499.2 mm from the lens")
    remedy = float(why.rpartition("f_number to ")[2].removesuffix(" or more"))
    sharp = float(why.partition("set camera.lens.focus to ")[2].partition(" mm")[0])
    assert not refusal(lens(focus=250, f_number=remedy))
    assert not refusal(lens(focus=sharp, f_number=1.4))


def test_a_plate_that_is_found_when_it_is_sharp_is_not_called_too_thick(small):
    why = refusal(small({"camera.lens": LENS | {"focus": sharp_for(small, 4.5)}}))
    assert "so that a touch of 4 N would be found to" in why
    assert why.endswith("only; set camera.lens.focus to 499 mm")


def test_without_a_lens_nothing_is_said_of_focus(small):
    assert blur_of(setup_of(small())) is None


@pytest.mark.parametrize(
    ("settings", "says"),
    [
        ({"camera.lens": LENS | {"focus": 20}}, "shows nothing sharp that is nearer"),
        ({"camera.lens": LENS | {"f_number": 0}}, "f_number"),
        ({"camera.lens": LENS, "camera.kind": "telecentric"}, "leave one of them out"),
    ],
)
def test_a_lens_that_cannot_be_is_refused(small, settings, says):
    with pytest.raises(SceneError, match=says):
        small(settings)


def test_what_is_out_of_focus_has_less_gradient_by_what_its_disc_passes(small):
    """A grating beneath a disc: the mean of a wave over the disc, by points that fill it."""
    circle = 3.0
    points = np.stack(np.meshgrid(*[np.linspace(-0.5, 0.5, 401)] * 2), -1).reshape(-1, 2)
    inside = circle * points[np.hypot(*points.T) <= 0.5]
    given = setup_of(small({"camera.lens": LENS | {"focus": sharp_for(small, circle)}}))
    assert max(blur_of(given).circles) == pytest.approx(circle, rel=1e-3)
    sharp, soft = patch_of(setup_of(small())), patch_of(given)
    spectra = [np.abs(np.fft.rfft2(image - image.mean())) ** 2 for image in (sharp, soft)]
    fy, fx = np.fft.fftfreq(sharp.shape[0])[:, None], np.fft.rfftfreq(sharp.shape[1])
    for wave in (0.05, 0.1, 0.15):  # periods a px
        ring = np.abs(np.hypot(fy, fx) - wave) < 0.004
        passed = np.cos(2 * np.pi * wave * inside[:, 0]).mean()
        assert spectra[1][ring].sum() / spectra[0][ring].sum() == pytest.approx(passed**2, rel=0.1)


def sharp_for(small, circle):
    """Focus at which the face is a circle wide, px: the nearer one."""
    given = setup_of(small({"camera.lens": LENS}))
    camera, lens = given.camera.build(given.plate), given.camera.lens
    depth = given.camera.stand_off - camera.face_height(given.plate.thickness)
    return 1 / (1 / depth + circle / (lens.focal / lens.f_number * camera.focal))


@pytest.mark.slow
def test_focus_is_the_cheapest_change_where_it_reaches_an_error(small):
    sharp = float(np.median(predict(setup_of(small()), None, 0.5).errors.place))
    far = small({"camera.lens": LENS | {"focus": sharp_for(small, 4.0)}})
    found = search_for(far, 1.1 * sharp, 0.5)
    assert found.now > 1.3 * sharp
    first = found.alone[0]
    assert (first.what, first.unit) == ("focus distance", "mm")
    turned = small({"camera.lens": LENS | {"focus": first.after}})
    reached = float(np.median(predict(setup_of(turned), None, 0.5).errors.place))
    assert 1.07 * sharp < reached < 1.101 * sharp
    assert "focus distance" in [what for what, *_ in changes(setup_of(far))]


def test_a_camera_that_comes_nearer_keeps_its_view_and_its_focus(small):
    given = setup_of(small({"camera.lens": LENS | {"focus": 499.0}}))
    assert max(blur_of(given).circles) == pytest.approx(0.0, abs=1e-9)
    near = replace(given, camera=at_distance(given.camera, 250.0))
    assert near.camera.lens.focal == pytest.approx(12.5)
    assert max(blur_of(near).circles) < 0.1
