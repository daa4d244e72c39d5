"""What a net is trained on through a camera is what DIC reads in images, with the noise it has."""

import numpy as np
import pytest

import rig
from rig.calibration.camera_of import camera_of
from rig.scene.account import account
from rig.training.data import simulate_sets
from rig.training.plan import training_plan
from rig.training.rendered_gauges import render_gauges

SCENE = {
    "touches.max_touches": 1,
    "sensor.noise": 1.0,
    "gauges": {"kind": "lattice", "spacing": 51.0, "margin": 25.0, "subset": 41},
    "training": {
        "samples": 50,
        "force": [2.0, 8.0],
        "margin": 30.0,
        "test_samples": 40,
        "rendered_images": 3,
    },
    "estimator": {"kind": "net", "inputs": "relative"},
}


def quiet(done, total):
    """Report of progress that nobody reads."""


@pytest.fixture
def scene(small):
    return small(SCENE)


def test_images_read_as_the_model_says_within_its_noise(scene):
    """Of errors over the stated noise the mean square is near 1: measured 1.07, and no bias."""
    gauges, rng = render_gauges(training_plan(scene).view, quiet), np.random.default_rng(0)
    touches = np.column_stack([rng.uniform(40, 160, (12, 2)), rng.uniform(2.0, 4.0, 12)])
    read = gauges.correlate(touches, rng)
    reported = gauges.seen.strain(touches[:, :2]).reshape(12, -1) * touches[:, 2:]
    white = np.linalg.solve(gauges.root, (read - reported).T)
    assert np.mean(white**2) == pytest.approx(1.0, abs=0.25)
    assert abs(white.mean()) < 4 / np.sqrt(white.size)


def test_averaged_images_have_less_noise(scene):
    plan = training_plan(scene)
    more = training_plan(
        scene.model_copy(update={"training": _with(scene.training, averaged_frames=16)})
    )
    one, mean = (
        np.sqrt(np.trace(np.square(render_gauges(each.view, quiet).root))) for each in (plan, more)
    )
    assert mean < 0.5 * one


def test_samples_have_forces_between_the_bounds_and_noise_that_is_drawn_anew(scene):
    sets = simulate_sets(training_plan(scene), quiet)
    noise = sets.noise
    assert len(sets.training) == len(noise.pool) == 50
    assert ((noise.forces >= 2.0) & (noise.forces <= 8.0)).all()
    assert len(noise.images) == 3
    off = np.linalg.solve(noise.root, (sets.training.strain - noise.pool.strain).T)
    assert np.mean(off**2) == pytest.approx(1.0, abs=0.1)
    np.testing.assert_array_equal(sets.training.targets, noise.pool.targets)


@pytest.mark.slow
def test_gauges_on_the_face_have_the_noise_that_the_scene_states():
    scene = rig.load("paper-one", {"training.noise": 0.05, "training.test_samples": 50})
    sets = simulate_sets(training_plan(scene), quiet)
    assert sets.noise.root == pytest.approx(0.05 * np.sqrt(np.mean(sets.noise.pool.strain**2)))
    assert np.std(sets.training.strain - sets.noise.pool.strain) == pytest.approx(
        sets.noise.root, rel=0.02
    )


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"pattern": None}, r"not what noise they have; add \[pattern\] and \[sensor\]"),
        ({"gauges.margin": 0.0, "gauges.spacing": 1.0}, "must lie in the image"),
        ({"dataset": {"touches": 2}}, "such nets learn one touch; set dataset.touches to 1"),
    ],
)
def test_what_cannot_be_seen_is_refused(small, changes, sentence):
    named = {name: part for name, part in SCENE.items() if name != "gauges"}
    gauges = {f"gauges.{name}": part for name, part in SCENE["gauges"].items()}
    source = {"source": None} if "pattern" in changes else {}
    scene = small(named | gauges | source | changes)
    with pytest.raises(ValueError, match=sentence):
        simulate_sets(training_plan(scene), quiet)


def test_a_camera_of_another_size_is_not_taken(scene):
    assert camera_of(scene, "") is None
    assert camera_of(scene, "{}") is None


def _with(section, **changes):
    return section.model_copy(update=changes)


def test_the_account_of_a_scene_names_the_gauges_that_dic_reads():
    said = account(rig.load("twin-net"))
    parts = {part.name: part.what for part in said.parts}
    assert parts["gauges"] == "lattice of 169 gauges, read by DIC with subsets of 71 px"
    assert parts["training"].startswith("20000 training")
    assert "subset matching" not in {part.name for part in said.left_out}
