"""The sections of a scene build the parts that the rooms below know."""

import numpy as np
import pytest

import rig


@pytest.fixture
def scene():
    return rig.load(
        "twin",
        {
            "plate.size": [120, 80],
            "camera.pixels": [320, 240],
            "gauges.reading": "A",
            "gauges.margin": 10,
        },
    )


def test_the_plate_is_that_of_the_file(scene):
    plate = scene.plate.build()
    assert plate.size == (120.0, 80.0)
    assert plate.edges.kind == "clamped"
    assert plate.rigidity == pytest.approx(3000 * 2**3 / (12 * (1 - 0.38**2)))


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


@pytest.mark.parametrize("reading", ["A", "B"])
def test_the_ring_lies_as_its_reading_says(scene, reading):
    ring = scene.gauges.model_copy(update={"reading": reading})
    places = ring.build(scene.plate)
    inset = np.minimum(places, np.array([120, 80]) - places).min(axis=1)
    assert inset == pytest.approx(10.0 if reading == "A" else 0.0)
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
