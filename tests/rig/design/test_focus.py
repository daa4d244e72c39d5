"""Focus of a design, against rays that are traced through a thin lens."""

import pytest

from rig.design.focus import blur_of
from rig.design.limits import refusal
from rig.design.setup import setup_of
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


def test_what_is_out_of_focus_is_refused_with_a_remedy(small):
    assert not refusal(small({"camera.lens": LENS}))
    near = small({"camera.lens": LENS | {"focus": 250, "f_number": 1.4}})
    why = refusal(near)
    assert why.startswith(
        "camera.lens.focus is 250 mm and the plate is 499 to 499 mm from the lens"
    )
    remedy = float(why.rpartition("f_number to ")[2].removesuffix(" or more"))
    sharp = float(why.partition("set camera.lens.focus to ")[2].partition(" mm")[0])
    assert not refusal(small({"camera.lens": LENS | {"focus": 250, "f_number": remedy}}))
    assert not refusal(small({"camera.lens": LENS | {"focus": sharp, "f_number": 1.4}}))


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
