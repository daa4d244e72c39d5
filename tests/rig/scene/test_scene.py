import json

import pytest
from hypothesis import given, strategies as st

import rig
from rig.scene import parse_overrides, shipped, with_overrides
from rig.scene.quantity import UNITS, Quantity
from rig.scene.source import V4l2

PLATE = """
title = "a plate"
[plate]
size = [120, "25 cm"]
thickness = "2 mm"
young = "3 GPa"
poisson = 0.38
edges.kind = "clamped"
"""


@pytest.fixture
def plate_file(tmp_path):
    path = tmp_path / "plate.toml"
    path.write_text(PLATE, encoding="utf-8")
    return path


@pytest.mark.parametrize("name", shipped())
def test_every_shipped_scene_loads_by_its_name(name):
    assert rig.load(name).title


def test_the_twin_is_the_bench_of_the_plan():
    scene = rig.load("twin")
    assert scene.plate is not None
    assert scene.plate.size == (254.0, 254.0)
    assert (scene.plate.thickness, scene.plate.young, scene.plate.poisson) == (2.0, 3000.0, 0.38)
    assert scene.camera is not None
    assert (scene.camera.pixels, scene.camera.stand_off) == ((1024, 1024), 500.0)
    assert scene.camera.rate == 30.0
    assert scene.touches is not None
    assert scene.touches.force == (0.5, 4.0)
    assert scene.sensor is not None
    assert scene.sensor.noise == 2.0


def test_values_are_given_in_the_units_of_the_code(plate_file):
    plate = rig.load(plate_file).plate
    assert plate is not None
    assert plate.size == (120.0, 250.0)
    assert plate.young == 3000.0


def test_what_a_file_does_not_name_is_none(plate_file):
    scene = rig.load(plate_file)
    named = {name for name in type(scene).model_fields if getattr(scene, name) is not None}
    assert named == {"title", "plate"}


def test_a_section_that_becomes_another_kind_keeps_what_both_know():
    """What the twin alone knows would be unknown keys of a folder."""
    twin = rig.load("twin", {"source.script": "random"})
    scene = with_overrides(twin, {"source.kind": "files", "source.path": "frames/*.tif"})
    assert scene.source is not None
    assert scene.source.kind == "files"
    camera = rig.load("twin", {"source.kind": "opencv", "source.gain": 3})
    other = with_overrides(camera, {"source.kind": "v4l2"})
    assert isinstance(other.source, V4l2)
    assert other.source.gain == 3.0


def test_what_the_new_kind_does_not_know_is_refused_where_an_override_names_it():
    changes = {"source.kind": "files", "source.path": "*.png", "source.script": "random"}
    with pytest.raises(rig.SceneError, match="unknown key 'script'"):
        rig.load("twin", changes)


def test_edges_become_another_support(plate_file):
    scene = rig.load(plate_file, {"plate.edges.kind": "supported"})
    assert scene.plate is not None
    assert scene.plate.edges.kind == "supported"


def test_a_shipped_scene_is_also_found_by_its_path_beside_the_package(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert rig.load("scenes/twin.toml") == rig.load("twin")


def test_a_file_in_the_working_folder_comes_first(tmp_path, monkeypatch):
    (tmp_path / "scenes").mkdir()
    (tmp_path / "scenes" / "twin.toml").write_text(PLATE, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    assert rig.load("scenes/twin.toml").title == "a plate"


def test_overrides_replace_values_and_add_sections():
    scene = rig.load("twin", overrides={"dic.subset": 35, "projector.display": ":7"})
    assert scene.dic is not None
    assert scene.dic.subset == 35
    assert scene.projector is not None
    assert scene.projector.display == ":7"
    assert rig.load("twin").projector is None


def test_settings_of_a_command_line_are_toml_or_plain_text():
    settings = ["page.port=8766", "source.shift=[0.3, 0]", "plate.thickness = 3 mm", "title='a=b'"]
    assert parse_overrides(settings) == {
        "page.port": 8766,
        "source.shift": [0.3, 0],
        "plate.thickness": "3 mm",
        "title": "a=b",
    }


def test_a_scene_survives_json():
    scene = rig.load("twin")
    stored = json.loads(json.dumps(scene.model_dump(mode="json")))
    assert rig.Scene.model_validate(stored) == scene


def test_a_scene_cannot_be_changed():
    with pytest.raises(ValueError, match="frozen"):
        rig.load("twin").title = "other"


def test_every_key_is_described():
    def check(model):
        for field in model.model_fields.values():
            assert field.description
            for part in [field.annotation, *getattr(field.annotation, "__args__", ())]:
                if hasattr(part, "model_fields"):
                    check(part)

    check(rig.Scene)


@pytest.mark.parametrize(
    ("unit", "text", "number"),
    [
        ("mm", "10 in", 254.0),
        ("mm", "0.3 m", 300.0),
        ("mm", "25.4 cm", 254.0),
        ("mm", "40 µm", 0.04),
        ("mm", "40 um", 0.04),
        ("MPa", "3 GPa", 3000.0),
        ("MPa", "500 kPa", 0.5),
        ("MPa", "2e6 Pa", 2.0),
        ("MPa", "7 N/mm²", 7.0),
        ("N", "2 kN", 2000.0),
        ("N", "1 mN", 0.001),
        ("N/mm²", "2000 N/m²", 0.002),
        ("deg", "3.141592653589793 rad", 180.0),
        ("deg", "2°", 2.0),
        ("s", "8 ms", 0.008),
        ("s", "125 µs", 125e-6),
        ("s", "125 us", 125e-6),
        ("fps", "30 Hz", 30.0),
        ("grey levels", "2 grey levels", 2.0),
    ],
)
def test_a_unit_is_what_the_world_takes_it_for(unit, text, number):
    assert Quantity(unit)(text) == pytest.approx(number, rel=1e-12)


@pytest.mark.parametrize("unit", [unit for unit in UNITS if unit])
@given(number=st.floats(-1e6, 1e6))
def test_a_unit_is_a_factor(unit, number):
    for other, factor in UNITS[unit].items():
        assert Quantity(unit)(f"{number!r} {other}") == pytest.approx(number * factor, rel=1e-12)
