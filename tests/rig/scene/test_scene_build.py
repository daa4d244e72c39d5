"""The sections of a scene build the parts that the rooms below know."""

import json
import math

import numpy as np
import pytest

import fe
import rig
from rig.sources.twin import build_twin

MIXED = """
title = "a plate held in four ways"
[plate]
size = ["254 mm", "200 mm"]
thickness = "2 mm"
young = "3 GPa"
poisson = 0.38
[plate.edges]
kind = "mixed"
west = { kind = "clamped" }
east = { kind = "free" }
south = { kind = "supported" }
north = { kind = "elastic", deflection = "2000 N/m²", rotation = "5 kN", membrane = inf }
[[plate.patches]]
x = [10, 20]
y = ["3 cm", "6 cm"]
thickness = "4 mm"
[[plate.patches]]
x = [50, 60]
y = [30, 60]
young = "10 MPa"
"""


@pytest.fixture
def scene():
    return rig.load(
        "twin",
        {
            "plate.size": [120, 80],
            "camera.pixels": [320, 240],
            "gauges.kind": "ring",
            "gauges.placement": "inside",
            "gauges.margin": 10,
        },
    )


def test_the_plate_is_that_of_the_file(scene):
    plate = scene.plate.build()
    assert plate.size == (120.0, 80.0)
    assert plate.edges.kind == "clamped"
    assert plate.rigidity == pytest.approx(3000 * 2**3 / (12 * (1 - 0.38**2)))


@pytest.mark.parametrize("kind", ["clamped", "supported"])
def test_edges_are_alike_unless_they_are_mixed(kind):
    plate = rig.load("twin", {"plate.edges.kind": kind}).plate
    assert plate is not None
    sides = plate.build().sides
    assert {side.kind for axis in (0, 1) for side in sides.along(axis)} == {kind}


def test_each_edge_of_a_mixed_plate_is_where_its_name_says(tmp_path):
    path = tmp_path / "mixed.toml"
    path.write_text(MIXED, encoding="utf-8")
    plate = rig.load(path).plate
    assert plate is not None
    sides = plate.build().sides
    assert (sides.west, sides.east) == (fe.Clamped(), fe.Free())
    assert sides.south == fe.Supported()
    assert sides.north == fe.Elastic(deflection=0.002, rotation=5000.0, membrane=math.inf)


def test_patches_take_what_they_do_not_say_from_the_plate(tmp_path):
    path = tmp_path / "mixed.toml"
    path.write_text(MIXED, encoding="utf-8")
    plate = rig.load(path).plate
    assert plate is not None
    stiff, soft = plate.build().patches
    assert stiff == fe.Patch((10.0, 20.0), (30.0, 60.0), 4.0, 3000.0)
    assert soft == fe.Patch((50.0, 60.0), (30.0, 60.0), 2.0, 10.0)


@pytest.mark.parametrize(
    ("overrides", "sentence"),
    [
        ({"plate.edges": {"kind": "free"}}, "plate edges must hold the plate, got west free"),
        ({"plate.patches": [{"x": [0, 300], "y": [0, 9]}]}, "x from 0 to 254 mm, got 0 to 300 mm"),
        ({"plate.patches": [{"x": [9, 9], "y": [0, 9]}]}, "from a smaller to a larger x, got 9"),
    ],
)
def test_a_plate_that_cannot_be_is_refused_with_the_sentence_of_mechanics(overrides, sentence):
    plate = rig.load("twin", overrides).plate
    assert plate is not None
    with pytest.raises(ValueError, match=sentence):
        plate.build()


def test_tension_is_what_is_given_less_what_warmth_takes():
    pull = {"plate.tension": ["300 N/m", 0.2, -0.05], "plate.warmer": "0.5 K"}
    plate = rig.load("twin", pull | {"plate.expansion": 6e-5}).plate.build()
    warmth = 3000.0 * 2.0 * 6e-5 * 0.5 / (1.0 - 0.38)  # N/mm: a rigid frame holds the strain back
    assert plate.tension == pytest.approx((0.3 - warmth, 0.2 - warmth, -0.05))


def test_a_plate_at_rest_is_as_high_as_its_scene_says():
    tilted = {"plate.size": [254, 200], "plate.sag": "0.3 mm", "plate.warp": [[0, 0], ["50 µm", 0]]}
    plate = rig.load("twin", tilted).plate.build()
    places = [[127.0, 100.0], [254.0, 60.0], [0.0, 130.0]]
    np.testing.assert_allclose(plate.rise(places), [0.3, 0.05, -0.05], atol=1e-12)
    assert rig.load("twin").plate.build().shape is None


def test_a_tapered_plate_is_thicker_at_one_edge():
    tapered = {"plate.size": [254, 200], "plate.taper": [0.05, -0.02]}
    plate = rig.load("twin", tapered).plate.build()
    thickness, _ = plate.material([[254.0, 100.0], [127.0, 200.0]])
    np.testing.assert_allclose(thickness, [2.1, 1.96])


def test_an_elastic_edge_gives_more_at_one_end():
    springs = {"deflection": math.inf, "rotation": "2 kN", "taper": [0, 0.3, 0]}
    plate = rig.load("twin", {"plate.edges": {"kind": "elastic"} | springs}).plate.build()
    assert plate.sides.south == fe.Elastic(math.inf, 2000.0, taper=(0.0, 0.3, 0.0))


def test_a_scene_with_springs_survives_json(tmp_path):
    path = tmp_path / "mixed.toml"
    path.write_text(MIXED, encoding="utf-8")
    scene = rig.load(path)
    stored = json.loads(json.dumps(scene.model_dump(mode="json")))
    assert rig.Scene.model_validate(stored) == scene


def test_the_twin_presses_discs_where_touches_have_a_radius(small):
    twin = build_twin(small({"touches.radius": "4 mm"}))
    pressed = [twin.touches(sequence) for sequence in range(120)]
    assert {touch.radius for touches in pressed for touch in touches} == {4.0}


def test_the_camera_sees_the_whole_plate(scene):
    camera = scene.camera.build(scene.plate)
    assert camera.size == (320, 240)
    corners = np.array([[0, 0, 1], [120, 0, 1], [120, 80, 1], [0, 80, 1]], float)
    seen = camera.project(corners)
    assert (seen > 0).all()
    assert (seen < [319, 239]).all()
    assert np.ptp(seen[:, 0]) / 320 == pytest.approx(0.96, abs=0.01)


def test_pattern_and_sensor_have_the_values_of_the_file(scene):
    pattern = scene.pattern.build(scene.plate)
    light = pattern.intensity(np.random.default_rng(0).uniform(0, [120, 80], (2000, 2)))
    assert 0.3 < light.mean() < 0.7
    assert scene.sensor.build().noise == 2.0


@pytest.mark.parametrize("placement", ["inside", "edges"])
def test_the_ring_lies_as_its_placement_says(scene, placement):
    ring = scene.gauges.model_copy(update={"placement": placement})
    places = ring.build(scene.plate)
    inset = np.minimum(places, np.array([120, 80]) - places).min(axis=1)
    assert inset == pytest.approx(10.0 if placement == "inside" else 0.0)
    assert len(places) == 2 * (100 + 60) / 5


def test_the_paper_has_seventy_two_gauges():
    scene = rig.load("paper-one")
    assert scene.plate is not None
    assert scene.gauges is not None
    assert scene.gauges.build(scene.plate).shape == (72, 2)


@pytest.mark.parametrize(
    ("subset", "tile", "block"), [(25, 8, 3), (31, 8, 3), (41, 8, 5), (5, 16, 1), (21, 4, 5)]
)
def test_the_window_of_the_map_is_the_nearest_odd_number_of_tiles(subset, tile, block):
    scene = rig.load("twin", {"dic.subset": subset, "dic.tile": tile})
    assert scene.dic is not None
    assert scene.dic.block == block
