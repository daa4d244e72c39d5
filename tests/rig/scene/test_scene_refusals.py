"""Each fault of a scene file ends in one sentence: key, value, unit, remedy."""

from contextlib import suppress

import numpy as np
import pytest
from hypothesis import given, strategies as st

import rig

NET = {"kind": "net"}
KINDS = "'clamped', 'supported', 'free', 'elastic'"
MIXED = {side: {"kind": "clamped"} for side in ("west", "east", "south")} | {"kind": "mixed"}
LENGTHS = "m, cm, um, µm, in"

REFUSALS = [
    (
        {"source": {"kind": "basler", "serial": "7"}, "board.trigger_width": "1 ms"},
        "board.trigger_width sends pulses and the camera runs by itself; set source.trigger to its"
        " input, such as Line1, or leave board.trigger_width out",
    ),
    ({"plate.thicknes": 1}, "unknown key 'thicknes' in [plate]; did you mean 'thickness'?"),
    ({"camra.rate": 1}, "unknown key 'camra'; did you mean 'camera'?"),
    ({"estimator.mode": 3}, "unknown key 'mode' in [estimator]; did you mean 'modes'?"),
    ({"page.qqq": 3}, "unknown key 'qqq' in [page]; known are port, viewers, control"),
    ({"plate.thickness": -2}, "plate.thickness is -2 mm; give more than 0 mm"),
    (
        {"plate.thickness": "2 kg"},
        f"plate.thickness is '2 kg'; give a number in mm or a text with its unit ({LENGTHS})",
    ),
    (
        {"plate.thickness": float("nan")},
        f"plate.thickness is nan mm; give a number in mm or a text with its unit ({LENGTHS})",
    ),
    ({"plate.thickness": "-2 cm"}, "plate.thickness is -20 mm; give more than 0 mm"),
    ({"plate.poisson": "0.3 mm"}, "plate.poisson is '0.3 mm'; give a plain number without a unit"),
    ({"plate.poisson": 0.5}, "plate.poisson is 0.5; give less than 0.5"),
    ({"plate.size": 5}, "plate.size is 5 mm; give a list of 2 values"),
    ({"plate.size": [254]}, "plate.size is [254]; give a list of 2 values"),
    ({"plate.size": [1, 2, 3]}, "plate.size is [1, 2, 3]; give a list of 2 values"),
    ({"plate.size": [254, -1]}, "plate.size[1] is -1 mm; give more than 0 mm"),
    ({"plate.edges.kind": "glued"}, f"plate.edges.kind is 'glued'; give one of {KINDS}, 'mixed'"),
    ({"plate.edges": {}}, "plate.edges.kind is missing; say which kind of edges it is"),
    (
        {"plate.edges.west.kind": "free"},
        "edges of kind 'clamped' are alike, so 'west' contradicts them; set the kind to 'mixed' and"
        " give west, east, south and north a kind each",
    ),
    (
        {"plate.edges": MIXED | {"north": {"kind": "mixed"}}},
        f"plate.edges.north.kind is 'mixed'; give one of {KINDS}",
    ),
    (
        {"plate.edges": MIXED},
        "plate.edges.north is missing; add it to [plate.edges] (edge at y = b)",
    ),
    (
        {"plate.edges.rotation": 3},
        "unknown key 'rotation' in [plate.edges]; known are kind",
    ),
    (
        {"plate.edges": {"kind": "elastic", "deflection": -1, "rotation": 3}},
        "plate.edges.deflection is -1 N/mm²; give at least 0 N/mm²",
    ),
    (
        {"plate.edges": {"kind": "elastic", "deflection": "5 N", "rotation": 3}},
        "plate.edges.deflection is '5 N'; give a number in N/mm² or a text with its unit (N/mm2,"
        " N/m², N/m2)",
    ),
    (
        {"plate.patches": [{"x": [1, 2]}]},
        "plate.patches[0].y is missing; add it to [plate.patches[0]] (from and to along y, mm)",
    ),
    (
        {"plate.warmer": 2, "plate.edges": {"kind": "elastic", "deflection": 9, "rotation": 3}},
        "plate.warmer is 2 K, and an edge gives in the plane, so that the tension does not follow"
        " from it; give plate.tension",
    ),
    ({"plate.tension": [1, 2]}, "plate.tension is [1, 2]; give a list of 3 values"),
    ({"plate.warp": [[0], [0, 1]]}, "plate.warp is [[0], [0, 1]]; give rows of one length"),
    ({"plate.theory": "small"}, "plate.theory is 'small'; give 'linear' or 'large'"),
    ({"touches.radius": -1}, "touches.radius is -1 mm; give at least 0 mm"),
    (
        {"touches.radius": "300 mm"},
        "touches.radius is 300 mm; give at most half of the plate's shorter side, 127 mm",
    ),
    ({"dataset.touches": 4, "gauges.kind": "ring"}, "dataset.touches is 4; give at most 3"),
    ({"dataset.touches": 1}, "[dataset] needs [gauges]; add [gauges] or leave [dataset] out"),
    ({"plate": 3}, "plate is 3; give a table of keys"),
    ({"title": 3}, "title is 3; give a text"),
    (
        {"estimator.kind": "nets"},
        "estimator.kind is 'nets'; give one of 'pattern', 'strain', 'net', 'regression'",
    ),
    ({"estimator": {}}, "estimator.kind is missing; say which kind of estimator it is"),
    ({"estimator.modes": 1.5}, "estimator.modes is 1.5; give a whole number"),
    ({"estimator.modes": True}, "estimator.modes is True; give a whole number"),
    ({"dic.subset": 30}, "dic.subset is 30; give an odd number such as 31"),
    ({"page.port": 99999}, "page.port is 99999; give at most 65535"),
    ({"projector.full_screen": "yes"}, "projector.full_screen is 'yes'; give true or false"),
    (
        {"touches.force": [4, 1]},
        "touches.force runs from 4 N down to 1 N; write the smaller force first",
    ),
    ({"estimator": NET}, "[estimator] needs [gauges]; add [gauges] or leave [estimator] out"),
    (
        {"estimator": NET, "gauges.kind": "ring", "training.margin": 130},
        "training.margin is 130 mm; give less than half of the plate's shorter side, 127 mm",
    ),
]


@pytest.mark.parametrize(("overrides", "sentence"), REFUSALS)
def test_a_wrong_value_is_refused_in_one_sentence(overrides, sentence):
    with pytest.raises(rig.SceneError) as refusal:
        rig.load("twin", overrides)
    assert str(refusal.value) == f"twin.toml: {sentence}"


def test_a_key_below_a_value_is_refused():
    with pytest.raises(rig.SceneError, match=r"'title\.x' cannot be set: title is a value"):
        rig.load("twin", {"title.x": 1})


def test_a_missing_section_is_named_by_the_one_that_needs_it(tmp_path):
    path = tmp_path / "half.toml"
    path.write_text("title = 'half'\n[sensor]\nnoise = 2\n", encoding="utf-8")
    with pytest.raises(rig.SceneError, match=r"\[sensor\] needs \[camera\]; add \[camera\]"):
        rig.load(path)


def test_a_missing_key_is_named_with_its_meaning(tmp_path):
    path = tmp_path / "no_title.toml"
    path.write_text("", encoding="utf-8")
    with pytest.raises(rig.SceneError, match="title is missing; add it"):
        rig.load(path)


def test_an_unknown_name_lists_the_shipped_scenes():
    with pytest.raises(rig.SceneError, match=r"no scene is called 'twins'; shipped are .*twin"):
        rig.load("twins")


def test_a_missing_file_is_named():
    with pytest.raises(rig.SceneError, match=r"scene file 'nowhere/x\.toml' does not exist"):
        rig.load("nowhere/x.toml")


def test_a_fault_of_toml_is_given_with_its_line(tmp_path):
    path = tmp_path / "broken.toml"
    path.write_text("title = 'x'\n[plate\n", encoding="utf-8")
    with pytest.raises(rig.SceneError, match=r"broken\.toml is no TOML: .*line 2"):
        rig.load(path)


def test_a_file_that_is_no_text_is_refused(tmp_path):
    path = tmp_path / "image.toml"
    path.write_bytes(b"\xff\xd8\xff\xe0")
    with pytest.raises(rig.SceneError, match=r"image\.toml is no text in UTF-8"):
        rig.load(path)


KEYS = st.sampled_from(
    [
        *(f"{name}.{key}" for name in rig.Scene.model_fields for key in ("kind", "size", "force")),
        *rig.Scene.model_fields,
        "touches.max_touches",
        "plate.edges.west.kind",
        "plate.patches",
        "estimator.layers",
    ]
)
VALUES = st.recursive(
    st.none()
    | st.booleans()
    | st.integers()
    | st.floats()
    | st.text(max_size=5)
    | st.binary(max_size=3)
    | st.complex_numbers()
    | st.just(np.ones((2, 3)))
    | st.just(object()),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=4), inner),
    max_leaves=6,
)


@pytest.mark.filterwarnings("ignore::rig.scene.renamed.RenamedKeyWarning")
@given(st.dictionaries(KEYS, VALUES, min_size=1, max_size=3))
def test_whatever_is_set_a_scene_loads_or_is_refused(overrides):
    with suppress(rig.SceneError):
        rig.load("twin", overrides)


@pytest.mark.parametrize("scene", [None, 5, 1.5, b"twin", ["twin"], np.ones(3), "", "a\0b", "."])
def test_what_is_no_name_and_no_path_is_refused(scene):
    with pytest.raises(rig.SceneError):
        rig.load(scene)


@pytest.mark.parametrize("key", [None, 5, ("plate", "size"), b"title"])
def test_a_key_that_is_no_text_is_refused(key):
    with pytest.raises(rig.SceneError, match="of an override is no text"):
        rig.load("twin", {key: 1})
