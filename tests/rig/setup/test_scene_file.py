"""The scene of a bench from what is said of it, and the refusal of what cannot work."""

import re
import tomllib

import pytest
from hypothesis import given, settings, strategies as st

from rig.scene.refusal import SceneError
from rig.setup.answers import MATERIALS, NOTHING_SAID, text_of, with_answer
from rig.setup.judgement import refusal
from rig.setup.scene_file import board_for, corner_of_board, scene_of, scene_text, spot


def changed(**answers):
    return NOTHING_SAID.model_copy(update=answers)


@settings(max_examples=30)
@given(
    st.floats(40, 1000), st.floats(40, 1000), st.floats(0.3, 6), st.sampled_from(list(MATERIALS)),
    st.sampled_from(["clamped", "supported", "two clamped"]), st.sampled_from(["yes", "no"]),
)  # fmt: skip
def test_whatever_is_said_comes_back_from_the_scene(a, b, thick, material, edges, projector):
    said = changed(width=a, height=b, thickness=thick, material=material, edges=edges,
                   projector=projector, camera="/dev/video2", exposure=8e-3)  # fmt: skip
    scene = scene_of(said)
    assert scene.plate.size == pytest.approx((a, b), rel=1e-5)
    assert scene.plate.thickness == pytest.approx(thick, rel=1e-5)
    assert scene.plate.young == MATERIALS[material].young
    assert (scene.projector is None) == (projector == "no")
    assert scene.source.device == "/dev/video2"
    assert scene.source.exposure == pytest.approx(8e-3)
    sides = {scene.plate.edges.kind} if edges != "two clamped" else {
        scene.plate.edges.west.kind, scene.plate.edges.north.kind,
    }  # fmt: skip
    assert sides == ({"clamped", "free"} if edges == "two clamped" else {edges})


def test_a_speckle_is_five_pixels_wide():
    said = changed(width=200.0, height=100.0, pixels=(1000, 800))
    mm_per_px = 200.0 / (0.96 * 1000)
    assert spot(said) / mm_per_px == pytest.approx(5.0, rel=0.01)


@pytest.mark.parametrize("name", ['a"b', "back\\slash", "Bildschirm ü"])
def test_any_name_of_an_output_can_be_written(name):
    scene = tomllib.loads(scene_text(changed(output=name, screen=(800, 600))))
    assert scene["projector"] == {"size": [800, 600], "output": name}


@pytest.mark.parametrize(
    ("named", "source"),
    [
        ("/dev/video4", {"kind": "opencv", "device": "/dev/video4"}),
        ("v4l2 /dev/video0", {"kind": "v4l2", "device": "/dev/video0"}),
        ("basler 22180001", {"kind": "basler", "serial": "22180001"}),
        ("genicam 77 /opt/a.cti", {"kind": "genicam", "serial": "77", "producer": "/opt/a.cti"}),
    ],
)
def test_a_camera_is_named_by_its_node_or_by_its_kind_and_number(named, source):
    said = scene_of(changed(camera=named)).source.model_dump(exclude_none=True)
    assert said == source


def test_an_answer_keeps_the_value_and_says_it_again():
    said = with_answer(NOTHING_SAID, "pixels", "2048x1536")
    assert said.pixels == (2048, 1536)
    assert text_of(said, "pixels") == "2048 x 1536"
    assert text_of(with_answer(said, "exposure", "12 ms"), "exposure") == "12 ms"
    assert text_of(with_answer(said, "width", "25.4 cm"), "width") == "254"
    assert with_answer(said, "output", "1").output == 1


@pytest.mark.parametrize(
    ("key", "text", "says"),
    [
        ("thickness", "-2", "thickness is -2 mm; give more than 0 mm"),
        ("thickness", "two", "thickness is 'two'; give a number in mm"),
        ("pixels", "many", "give width and height in px"),
        ("material", "cheese", "material is 'cheese'; give"),
        ("exposure", "8", "exposure is '8'; give at most 1 s"),
        ("colour", "red", "there is no question 'colour'"),
        ("grams", "nan", "grams is nan"),
    ],
)
def test_what_is_no_answer_is_refused_in_a_sentence(key, text, says):
    with pytest.raises(SceneError, match=re.escape(says).replace("nan", "'?nan'?")):
        with_answer(NOTHING_SAID, key, text)


def test_the_board_fits_on_the_plate_and_grows_as_it_was_printed():
    said = changed(width=150.0, height=120.0, ruler=101.0)
    board = board_for(said)
    assert board.square == pytest.approx(12.0 * 1.01)
    assert board.size[0] < 150
    assert board.size[1] < 120
    left, below = corner_of_board(said)
    assert left == pytest.approx((150 - board.size[0]) / 2)
    assert below == pytest.approx((120 - board.size[1]) / 2)


@pytest.mark.parametrize(
    ("key", "value", "others"),
    [
        ("thickness", 0.2, {}),
        pytest.param("thickness", 6.0, {}, marks=pytest.mark.slow),
        ("pixels", (4000, 3000), {"width": 60.0, "height": 50.0, "thickness": 0.6}),
    ],
)
def test_what_cannot_work_is_refused_and_its_remedy_works(key, value, others):
    said = changed(**{"pixels": (480, 384), **others, key: value})
    why = refusal(said)
    assert why.startswith(f"{key if key == 'thickness' else 'camera pixels'} ")
    remedy = re.search(r"; set \w+ to ([\d. x]+?)(?: mm)? or (?:more|less|fewer)", why)[1]
    assert refusal(with_answer(said, key, remedy)) == ""
