"""Millimetres and strain on the object, against a plane that stretches under a camera askew."""

from dataclasses import replace

import numpy as np
import pytest

import dic
import synthetic
from rig.calibration.lens import Lens
from rig.calibration.store import keep
from rig.commands.scale import scale_of
from rig.series.gauges import elongation
from rig.series.regions import Extensometer
from rig.series.scale import BoardPlane, PlatePlane, board_plane, in_mm, scaled_points, two_points
from rig.series.tabulate import StrainOptions, strained

SHAPE = (300, 420)
STRETCH = np.array([[1.004, 0.003], [-0.001, 0.997]])
SHIFT = np.array([0.4, -0.2])


@pytest.fixture(scope="module")
def camera():
    """Seven degrees askew, with a lens that bends the corners by several px."""
    c, s = np.cos(0.12), np.sin(0.12)
    pose = np.eye(4)
    pose[:3, :3] = np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]]) @ np.diag([1, -1, -1])
    pose[:3, 3] = -40, 30, 300
    bent = synthetic.Distortion(-0.25, 0.05, 0.001, -0.0005, 0.0)
    return synthetic.Camera((SHAPE[1], SHAPE[0]), 900.0, (207.0, 152.0), pose, bent)


def stretched(camera, xy):
    """Where pixels (N, 2) move as the plane stretches, by the camera's own projection."""
    place = camera.on_plate(xy)
    moved = place @ STRETCH.T + SHIFT
    px = camera.project(np.column_stack([moved, np.zeros(len(moved))]))
    np.testing.assert_allclose(
        camera.project(np.column_stack([place, np.zeros(len(place))])), xy, atol=1e-6
    )
    return px - xy, moved - place


@pytest.fixture(scope="module")
def field(camera):
    """Displacement without noise on a grid whose subsets do not overlap."""
    image = np.random.default_rng(1).integers(0, 255, SHAPE, dtype=np.uint8)
    ref = dic.prepare(image, subset=15, step=16, prefilter=0.0)
    (u, v), _ = (a.T for a in stretched(camera, ref.xy))
    found = dic.correlate(ref, image)
    spread = np.full(len(u), 0.02)
    status = np.zeros(len(u), np.int8)
    return replace(found, u=u, v=v, sigma_u=spread, sigma_v=spread, status=status)


@pytest.fixture(scope="module")
def points(camera, field):
    return scaled_points(PlatePlane(camera, "test"), field.xy)


TRUE_STRAIN = [0.004, -0.003, 0.001]  # of STRETCH, small


def test_lens_and_pose_are_taken_out(camera, field, points):
    found = strained(field, StrainOptions(scaled=points))
    _, true = stretched(camera, field.xy)
    np.testing.assert_allclose(
        np.column_stack([found.more["u_mm"], found.more["v_mm"]]), true, atol=1e-9
    )
    eps = found.strain
    for part, value in zip((eps.exx, eps.eyy, eps.exy), TRUE_STRAIN, strict=True):
        np.testing.assert_allclose(part[eps.valid], value, atol=1e-4)
    raw = strained(field, StrainOptions()).strain
    assert np.nanmax(np.abs(raw.exx - TRUE_STRAIN[0])) > 5e-4  # what the camera adds


def test_gradients_of_a_field_that_brings_its_own_are_those_on_the_object(camera, field, points):
    steps = 0.01 * np.eye(2)
    columns = [
        stretched(camera, field.xy + d)[0] - stretched(camera, field.xy - d)[0] for d in steps
    ]
    slope = np.stack(columns, axis=-1) / 0.02
    own = replace(
        field, gradient=slope, sigma_gradient=np.full_like(slope, 1e-4),
        gauge=np.full(len(field.u), 50.0),
    )  # fmt: skip
    eps = strained(own, StrainOptions(scaled=points)).strain
    for part, value in zip((eps.exx, eps.eyy, eps.exy), TRUE_STRAIN, strict=True):
        np.testing.assert_allclose(part, value, atol=2e-6)


def test_sigma_is_the_scatter_of_drawn_noise(field, points):
    rng = np.random.default_rng(8)
    drawn = []
    for _ in range(200):
        du, dv = rng.normal(0, 0.02, (2, len(field.u)))
        found = strained(replace(field, u=field.u + du, v=field.v + dv),
                         StrainOptions(scaled=points))  # fmt: skip
        names = ("u_mm", "v_mm")
        drawn.append([*(found.more[n] for n in names), found.strain.exx, found.strain.exy])
    stated = [found.more["sigma_u_mm"], found.more["sigma_v_mm"], *found.strain.sigma.T[[0, 2]]]
    for values, sigma in zip(np.swapaxes(drawn, 0, 1), stated, strict=True):
        assert np.nanmedian(values.std(axis=0) / sigma) == pytest.approx(1, abs=0.05)


def test_an_extensometer_reads_lengths_on_the_object(field, points):
    found = strained(field, StrainOptions(scaled=points))
    table = {name: found.table(StrainOptions(scaled=points).fields)[name] for name in
             ("u", "v", "u_mm", "v_mm", "sigma_u_mm", "sigma_v_mm")}  # fmt: skip
    one = Extensometer(name="e", start=(40, 60), end=(380, 210))
    start, end = points.scale.places(np.array([one.start, one.end], dtype=float))
    true = np.linalg.norm(STRETCH @ (end - start)) / np.linalg.norm(end - start) - 1
    value, sigma = elongation(one, field.grid, table, points.places)
    assert value == pytest.approx(true, abs=2e-6)
    assert 1e-5 < sigma < 1e-3


def test_points_that_are_lost_stay_lost(field, points):
    lost = np.zeros(len(field.u), bool)
    lost[::7] = True
    u, v = (np.where(lost, np.nan, part) for part in (field.u, field.v))
    moved = in_mm(points, replace(field, u=u, v=v, status=6 * lost.astype(np.int8)))
    np.testing.assert_array_equal(np.isnan(moved.u), lost)


def test_two_points_scale_as_far_as_they_are_apart():
    scale = two_points("10,20,310,420=50 mm", None)
    assert scale.mm_per_px == pytest.approx(0.1)
    np.testing.assert_allclose(scale.places(np.array([[3.0, 7.0]])), [[0.3, 0.7]])


@pytest.mark.parametrize("text", ["", "1,2,3=4 mm", "1,2,1,2=5 mm", "1,2,9,2=0 mm", "1,2,9,2=5"])
def test_a_scale_that_is_none_is_one_sentence(text):
    with pytest.raises(ValueError, match="scale ") as refusal:
        two_points(text, None)
    assert "\n" not in str(refusal.value)


def test_a_board_takes_perspective_and_lens_out(camera, field):
    x, y = np.meshgrid(np.arange(5) * 15.0, np.arange(4) * 15.0)
    mm = np.column_stack([x.ravel(), y.ravel()])
    px = camera.project(np.column_stack([mm, np.zeros(len(mm))]))
    plane = board_plane(mm, px, camera, "board.png")
    np.testing.assert_allclose(plane.places(field.xy), camera.on_plate(field.xy), atol=3e-5)
    with pytest.raises(ValueError, match=r"lie \S+ px from a plane, 1 px may be; lay it flat"):
        board_plane(mm, px + 4.0 * np.sin(mm / 10), camera, "board.png")  # it curls
    with pytest.raises(ValueError, match="one row of the board's corners"):
        board_plane(mm[:5], px[:5], camera, "board.png")


def test_beyond_the_horizon_of_a_board_lies_no_place():
    steep = np.array([[0.1, 0, 0], [0, 0.1, 0], [0, -0.01, 1.0]])  # w = 0 at y = 100 px
    plane = BoardPlane(steep, None, "a board")
    assert np.isfinite(plane.places(np.array([[50.0, 99.0]]))).all()
    with pytest.raises(ValueError, match=r"\(50, 101\) px lies beyond the horizon"):
        plane.places(np.array([[50.0, 99.0], [50.0, 101.0]]))


def test_a_lens_alone_needs_two_points_and_its_own_size(tmp_path, camera):
    path = tmp_path / "bench.json"
    keep(path, Lens(camera.size, 900.0, camera.centre, camera.distortion, 1.0, 0.1, 0.01, ()))
    with pytest.raises(ValueError, match="holds no pose"):
        scale_of(None, None, path, SHAPE)
    with pytest.raises(ValueError, match="420x300 px and the reference has 64x48 px"):
        scale_of("1,2,9,2=5 mm", None, path, (48, 64))
    scale = scale_of("207,152,300,152=20 mm", None, path, SHAPE)
    apart = np.diff(scale.places(np.array([[207.0, 152.0], [300.0, 152.0]])), axis=0)
    assert np.linalg.norm(apart) == pytest.approx(20)
    bent = scale.places(np.array([[5.0, 5.0], [98.0, 5.0]]))
    assert np.linalg.norm(np.diff(bent, axis=0)) > 20.3  # a barrel narrows its corners
    assert "lens" in scale.described
