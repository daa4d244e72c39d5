"""The twin: frames that follow from their number, and mechanics that the truth can rest on."""

import numpy as np
import pytest

import dic
import fe
import synthetic
from rig.sources.twin import build_twin


@pytest.fixture
def twin(small):
    return build_twin(small({"source.seed": 5}))


PRESS = (fe.Touch(100.0, 80.0, 3.0),)


def test_a_frame_follows_from_seed_number_and_touches(small, twin):
    again = build_twin(small({"source.seed": 5}))
    later = twin.frame(41, PRESS)
    first = twin.frame(40, PRESS)
    np.testing.assert_array_equal(again.frame(40, PRESS), first)
    np.testing.assert_array_equal(again.frame(41, PRESS), later)
    assert (first != later).mean() > 0.5  # the noise is new
    assert (build_twin(small({"source.seed": 6})).frame(40, PRESS) != first).mean() > 0.5


def test_a_frame_is_a_image_of_the_camera_and_may_reuse_memory(twin):
    out = np.empty((320, 384), np.uint8)
    image = twin.frame(3, (), out)
    assert image is out
    np.testing.assert_array_equal(image, twin.frame(3, ()))
    assert image.std() > 30  # grey levels of speckle


def test_the_noise_is_that_of_the_scene(small, twin):
    clean = build_twin(small({"sensor.noise": 0})).frame(0, ()).astype(float)
    noisy = twin.frame(0, ()).astype(float)
    inside = (clean > 20) & (clean < 235)
    assert (noisy - clean)[inside].std() == pytest.approx(2.0, rel=0.05)
    assert (noisy - clean)[inside].mean() == pytest.approx(0.0, abs=0.1)


def test_the_camera_shifts_after_the_first_second(small):
    twin = build_twin(small({"source.shift": [0.3, -0.2], "sensor.noise": 0}))
    before, after = (twin.frame(sequence, ()).astype(float) for sequence in (29, 30))
    np.testing.assert_array_equal(twin.frame(0, ()), before)
    points = np.random.default_rng(1).uniform((40, 40), (344, 280), (60, 2))
    seen = dic.correlate(dic.prepare(before, subset=31, points=points), after)
    shift = np.median(seen.u), np.median(seen.v)
    assert shift == pytest.approx((0.3, -0.2), abs=0.005)


def test_a_press_moves_the_image_and_a_release_gives_it_back(small):
    twin = build_twin(small({"sensor.noise": 0}))
    rest, pressed = twin.frame(40, ()), twin.frame(40, PRESS)
    camera, height = twin.warper.camera, twin.solver.plate.thickness / 2
    points = np.random.default_rng(2).uniform((60, 60), (324, 260), (60, 2))
    seen = dic.correlate(dic.prepare(rest, subset=31, points=points), pressed)
    places = camera.on_plate(points, height)
    moved = twin.solver.deflect(PRESS).displacement(places)
    truth = synthetic.image_motion(camera, places, moved, height)
    assert np.abs(truth).max() > 0.02
    error = np.column_stack([seen.u, seen.v]) - truth
    assert np.sqrt(np.mean(error**2)) < 0.1 * np.abs(truth).max()
    np.testing.assert_array_equal(twin.frame(40, ()), rest)


def test_the_coarser_mesh_is_right_to_three_parts_in_ten_thousand(twin):
    fine = fe.Linear(twin.solver.plate, fe.default_mesh(twin.solver.plate)).deflect(PRESS)
    points = np.random.default_rng(0).uniform((5, 5), (249, 198), (400, 2))
    w, truth = (state.deflection(points) for state in (twin.solver.deflect(PRESS), fine))
    assert np.abs(w - truth).max() < 3e-4 * np.abs(truth).max()


@pytest.mark.parametrize("name", ["tour", "random", "empty"])
def test_the_script_is_that_of_the_scene(small, name):
    twin = build_twin(small({"source.script": name}))
    assert twin.touches(0) == ()
    assert len(twin.touches(60)) == (0 if name == "empty" else 1)


def test_a_scene_without_a_twin_is_refused(small):
    scene = small().model_copy(update={"source": None})
    with pytest.raises(ValueError, match=r"has no twin; add \[source\] with kind = \"twin\""):
        build_twin(scene)


def test_random_touches_need_forces_to_draw_from(small):
    scene = small({"source.script": "random"}).model_copy(update={"touches": None})
    with pytest.raises(ValueError, match=r"add \[touches\] to the scene"):
        build_twin(scene)
