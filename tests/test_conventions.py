"""What docs/conventions.md states, held to it. The headings there are the sections here."""

import ast
import dataclasses
import importlib
import re
from pathlib import Path

import numpy as np
import pytest

import dic
import fe
import models
import rig
import synthetic
from dic.fields.strain_field import strain_measure
from models.data import gauge_layout
from rig.system import cache

ROOT = Path(__file__).parent.parent
SIZE = (120.0, 80.0)  # mm
PLATE = fe.Plate(size=SIZE, thickness=2.0, young=3000.0, poisson=0.38)
MESH = fe.Mesh(SIZE, (36, 24))
TOUCH = fe.Touch(x=70.0, y=35.0, force=5.0)
CAMERA = synthetic.pinhole_above(SIZE, stand_off=400.0, pixels=(150, 110))


@pytest.fixture(scope="module")
def bent():
    return fe.deflect(PLATE, [TOUCH], MESH)


@pytest.fixture(scope="module")
def pattern():
    return synthetic.speckle(SIZE, diameter=5.0, softness=0.8)


@pytest.fixture(scope="module")
def image(pattern):
    return synthetic.render(pattern, CAMERA, None, None, None)


# Units


def test_millimetre_newton_and_megapascal_belong_together():
    side, force = 100.0, 3.0
    plate = fe.Plate((side, side), thickness=1.0, young=3000.0, poisson=0.3)
    w = fe.deflect(plate, [fe.Touch(side / 2, side / 2, force)]).deflection([(50.0, 50.0)])[0]
    assert plate.rigidity == pytest.approx(3000.0 / (12 * 0.91))
    # Timoshenko's coefficient of a clamped square under a load in its centre.
    assert -w == pytest.approx(0.00561202 * force * side**2 / plate.rigidity, rel=1e-4)


def test_a_scene_may_write_other_units_and_holds_ours():
    texts = {"plate.size": ["25.4 cm", "0.2 m"], "plate.young": "3000 N/mm2"}
    scene = rig.load("twin", texts)
    assert scene.plate.size == pytest.approx((254.0, 200.0))
    assert scene.plate.young == pytest.approx(3000.0)


# Images


def test_a_pixel_is_row_y_and_column_x_and_its_centre_has_whole_coordinates(pattern, image):
    def off(shift):
        x, y = np.meshgrid(np.arange(150.0), np.arange(110.0))
        light = pattern.intensity(CAMERA.on_plate(np.column_stack([x.ravel(), y.ravel()]) + shift))
        return np.std(image - 255 * light.reshape(image.shape))

    assert image.shape == (110, 150)
    assert off((0.0, 0.0)) < 0.2 * min(off((0.5, 0.0)), off((0.0, 0.5)), off((-0.5, -0.5)))


def test_the_middle_of_an_image_lies_half_a_pixel_before_half_its_size():
    middle = CAMERA.project([(SIZE[0] / 2, SIZE[1] / 2, 0.0)])
    np.testing.assert_allclose(middle, [(74.5, 54.5)], atol=1e-9)


def test_points_are_ordered_x_then_y(image):
    assert dic.prepare(image, points=[(140.0, 60.0)]).xy.tolist() == [[140.0, 60.0]]
    with pytest.raises(ValueError, match=r"ordered \(x, y\)"):
        dic.prepare(image, points=[(60.0, 140.0)])
    with pytest.raises(ValueError, match="0 to 120 by 0 to 80 mm"):
        PLATE.points([(35.0, 100.0)])


def test_grid_points_run_row_by_row(image):
    grid = dic.prepare(image, subset=21, step=10).xy
    assert np.all(grid[:3] - grid[0] == [(0, 0), (10, 0), (20, 0)])
    np.testing.assert_array_equal(grid[0], grid.min(axis=0))
    np.testing.assert_array_equal(grid[-1], grid.max(axis=0))


@pytest.mark.parametrize(("axis", "motion"), [(1, (3.0, 0.0)), (0, (0.0, 3.0))])
def test_u_is_positive_to_the_right_and_v_downwards(image, axis, motion):
    moved = dic.correlate(dic.prepare(image), np.roll(image, 3, axis=axis))
    shift = np.column_stack([moved.u, moved.v])[moved.valid]
    np.testing.assert_allclose(np.median(shift, axis=0), motion, atol=0.01)


# Plate and camera


def test_a_force_into_the_plate_moves_it_away_along_negative_z(bent):
    assert TOUCH.force > 0
    assert bent.deflection([(70.0, 35.0)])[0] < 0
    assert bent.displacement([(70.0, 35.0)])[0, 2] == bent.deflection([(70.0, 35.0)])[0]


def test_displacement_is_that_of_the_touched_face_unless_another_is_named(bent):
    place = [(40.0, 50.0)]
    half = PLATE.thickness / 2
    slope = bent.slope(place)[0]
    np.testing.assert_allclose(bent.displacement(place)[0, :2], -half * slope)
    np.testing.assert_allclose(bent.displacement(place, "bottom")[0, :2], half * slope)


def test_the_touched_face_is_in_tension_at_a_clamped_edge_and_compressed_under_the_finger(bent):
    exx, eyy, _ = bent.strain([(70.0, 0.0), (0.0, 35.0), (80.0, 42.0)]).T
    assert eyy[0] > 0
    assert exx[1] > 0
    assert exx[2] < 0
    assert eyy[2] < 0


def test_t_cam_plate_maps_plate_to_camera():
    turn = np.radians(20.0)
    T_cam_plate = np.diag([1.0, -1.0, -1.0, 1.0]) @ np.array(
        [
            [np.cos(turn), -np.sin(turn), 0.0, -50.0],
            [np.sin(turn), np.cos(turn), 0.0, -60.0],
            [0.0, 0.0, 1.0, -400.0],
            [0.0, 0.0, 0.0, 1.0],
        ]
    )
    camera = synthetic.Camera((150, 110), 500.0, (70.0, 50.0), T_cam_plate)
    x, y, z, _ = T_cam_plate @ (30.0, 40.0, 1.0, 1.0)
    assert z > 0  # what it sees lies before it
    expected = [(70.0 + 500.0 * x / z, 50.0 + 500.0 * y / z)]
    np.testing.assert_allclose(camera.project([(30.0, 40.0, 1.0)]), expected)
    np.testing.assert_allclose(T_cam_plate @ (*camera.position, 1.0), (0, 0, 0, 1), atol=1e-9)
    assert camera.position[2] > 0  # on the touched side


def test_above_the_plate_x_runs_right_and_y_runs_up_in_the_image():
    origin, along_x, along_y = CAMERA.project([(60, 40, 0), (70, 40, 0), (60, 50, 0)])
    assert along_x[0] > origin[0]
    assert along_x[1] == pytest.approx(origin[1])
    assert along_y[1] < origin[1]


def test_what_is_pressed_away_from_a_pinhole_moves_towards_the_middle_of_its_image():
    points = np.array([(100.0, 70.0), (20.0, 15.0)])
    pressed = np.tile([0.0, 0.0, -0.5], (2, 1))
    motion = synthetic.image_motion(CAMERA, points, pressed, z=1.0)
    outwards = CAMERA.project(np.column_stack([points, [1.0, 1.0]])) - CAMERA.centre
    assert np.all(np.einsum("kc,kc->k", motion, outwards) < 0)


# Strain


def test_exy_of_the_plate_is_half_of_the_engineering_shear(bent):
    x, y, d = 40.0, 50.0, 0.01
    around = bent.displacement([(x - d, y), (x + d, y), (x, y - d), (x, y + d)])
    gxy = (around[3, 0] - around[2, 0] + around[1, 1] - around[0, 1]) / (2 * d)
    assert bent.strain([(x, y)])[0, 2] == pytest.approx(gxy / 2, rel=1e-2)


def test_exy_of_an_image_is_half_of_the_engineering_shear_and_turns_with_its_y_axis(pattern):
    gxy = 4e-3

    def shear(xy):
        return np.column_stack([gxy * xy[:, 1], np.zeros((len(xy), 2))])

    camera = synthetic.pinhole_above(SIZE, stand_off=400.0, pixels=(300, 200))
    before, after = (
        synthetic.render(pattern, camera, motion, None, None) for motion in (None, shear)
    )
    measured = dic.strain(dic.correlate(dic.prepare(before, subset=31), after), window=9)
    assert np.median(measured.exy[measured.valid]) == pytest.approx(-gxy / 2, rel=0.03)


def test_the_kinds_of_strain_are_what_they_are_called():
    turn = np.radians(25.0)
    rotation = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    long, short = 1.2, 0.9
    gradient = rotation @ np.diag([long, short]) - np.eye(2)  # ∇u = F - 1
    exx, eyy, exy = strain_measure(gradient, "small")
    assert [exx, eyy] == pytest.approx([np.cos(turn) * long - 1, np.cos(turn) * short - 1])
    assert exy == pytest.approx(np.sin(turn) * (long - short) / 2)
    np.testing.assert_allclose(
        strain_measure(gradient, "green-lagrange"),
        [(long**2 - 1) / 2, (short**2 - 1) / 2, 0],
        atol=1e-12,
    )
    np.testing.assert_allclose(
        strain_measure(gradient, "logarithmic"), [np.log(long), np.log(short), 0], atol=1e-12
    )


def test_the_gauge_length_is_every_pixel_that_a_strain_depends_on(image):
    field = dic.correlate(dic.prepare(image, subset=21, step=4), image)
    assert dic.strain(field, window=5).vsg == (5 - 1) * 4 + 21


# Uncertainty


def test_what_is_not_measured_is_nan_with_a_status_that_says_why(image):
    dark = image.copy()
    dark[:, :60] = 128.0
    field = dic.correlate(dic.prepare(image), dark)
    lost = ~field.valid
    assert lost.any()
    assert field.valid.any()
    for values in (field.u, field.v, field.sigma_u, field.sigma_v):
        assert np.isnan(values[lost]).all()
        assert np.isfinite(values[field.valid]).all()
    assert {dic.Status(code).name for code in field.status[lost]} <= set(dic.Status.__members__)


def test_an_estimate_is_sorted_and_its_covariance_runs_x_y_force_in_mm_and_newton():
    influence = fe.influence(PLATE, gauge_layout.gauges_on_edges(SIZE, 10.0, 10.0), MESH)
    truth, sigma = np.array([[30.0, 50.0, 2.0], [80.0, 25.0, 0.5]]), 1e-6
    rng = np.random.default_rng(0)
    clean = np.einsum("k,kmc->mc", truth[::-1, 2], influence.strain(truth[::-1, :2]))
    found = []
    for _ in range(200):
        noisy = clean + rng.normal(0.0, sigma, clean.shape)
        estimate = models.solve(noisy, influence, sigma, count=2)
        found.append(np.column_stack([estimate.xy, estimate.force]).ravel())
    np.testing.assert_allclose(np.mean(found, axis=0), truth.ravel(), atol=0.05)
    predicted = np.sqrt(np.diag(estimate.covariance))
    assert np.std(found, axis=0) == pytest.approx(predicted, rel=0.25)


# Randomness, time, data, cache


def test_the_same_generator_gives_the_same_image_and_nothing_else_is_random(pattern):
    sensor, state = synthetic.Sensor(), np.random.get_state()[1].copy()  # noqa: NPY002
    first, second, other = (
        synthetic.render(pattern, CAMERA, None, sensor, np.random.default_rng(seed))
        for seed in (1, 1, 2)
    )
    assert np.array_equal(first, second)
    assert not np.array_equal(first, other)
    assert np.array_equal(np.random.get_state()[1], state)  # noqa: NPY002


@pytest.mark.parametrize("package", ["dic", "fe", "models", "synthetic"])
def test_only_rig_knows_the_time(package):
    for path in (ROOT / package).rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            if isinstance(node, ast.ImportFrom):
                names = [node.module or ""]
            assert not {"time", "datetime"} & set(names), path


@pytest.mark.parametrize("package", ["dic", "fe", "models", "synthetic"])
def test_public_data_is_frozen(package):
    module = importlib.import_module(package)
    names = [name for name in {*dir(module), *getattr(module, "__all__", ())} if name[0] != "_"]
    public = [getattr(module, name) for name in sorted(names)]
    kinds = [item for item in public if isinstance(item, type) and dataclasses.is_dataclass(item)]
    assert kinds
    for kind in kinds:
        assert kind.__dataclass_params__.frozen, kind


def test_a_cache_entry_is_found_by_everything_that_it_depends_on():
    thicker = dataclasses.replace(PLATE, thickness=2.001)
    key = cache.key("influence", (fe, PLATE, np.zeros((3, 2))))
    assert key == cache.key("influence", (fe, dataclasses.replace(PLATE), np.zeros((3, 2))))
    assert key != cache.key("influence", (fe, thicker, np.zeros((3, 2))))
    assert key != cache.key("influence", (fe, PLATE, np.zeros((2, 3))))
    assert key != cache.key("influence", (dic, PLATE, np.zeros((3, 2))))
    assert key != cache.key("modes", (fe, PLATE, np.zeros((3, 2))))


def test_the_cache_lies_where_the_environment_says(monkeypatch, tmp_path):
    monkeypatch.setenv("TOUCHPLATE_CACHE", str(tmp_path))
    assert cache.folder() == tmp_path


# Errors


@pytest.mark.parametrize(
    ("call", "sentence"),
    [
        (
            lambda: dic.prepare(np.eye(64), subset=30),
            "subset size must be odd, got 30 px; use 29 or 31",
        ),
        (
            lambda: dataclasses.replace(PLATE, thickness=-1.0),
            "plate thickness must be positive and finite, got -1 mm",
        ),
    ],
)
def test_an_error_is_one_sentence_with_quantity_value_and_unit(call, sentence):
    with pytest.raises(ValueError, match=f"^{re.escape(sentence)}$"):
        call()
