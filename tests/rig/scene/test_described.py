"""Whether a bench is taken as its scene describes it, where the scene does not say."""

import pytest

import rig
from rig.scene.described import described

FOLDER = {"source": {"kind": "folder", "path": "there"}}


@pytest.mark.parametrize(
    ("scene", "changes", "expected"),
    [
        ("twin", {}, "exact"),
        ("twin", {"source.departure.sag": 0.1}, "usual"),
        ("twin", FOLDER, "usual"),
        ("twin", {"source.kind": "opencv"}, "usual"),
        ("twin", FOLDER | {"estimator.bench": "exact"}, "exact"),
        ("twin", {"estimator.bench": "usual"}, "usual"),
        ("twin", FOLDER | {"estimator.start": "net"}, "exact"),
        ("twin", FOLDER | {"dynamics.density": 1400.0}, "exact"),
        ("bent-base", FOLDER, "exact"),
        ("twin-net", FOLDER, "exact"),
        ("bench", {}, "usual"),
    ],
)
def test_images_of_a_lab_show_a_bench_that_is_not_just_as_the_scene_says(scene, changes, expected):
    assert described(rig.load(scene, changes)) == expected
