"""What is drawn: outline and homography of the plate, marks of touches, the strain map."""

import numpy as np
import pytest

import fe
import synthetic
from models.estimate import Estimate, ForceInterval, Result
from rig.live.baseline import average_reference
from rig.live.bench import build_bench
from rig.live.tracks import Tracks
from rig.live.view import marks, plate_view, strain_map, tracked_marks, true_marks
from rig.projector.markers import project
from rig.sources.twin import build_twin

PLATE = fe.Plate((254.0, 203.0), 2.0, 3000.0, 0.38, fe.Clamped())


def test_the_homography_is_the_camera_on_the_touched_face():
    camera = synthetic.pinhole_above(PLATE.size, stand_off=500.0, pixels=(640, 400))
    view = plate_view(PLATE, camera)
    places = np.random.default_rng(0).uniform((0, 0), PLATE.size, (50, 2))
    seen = camera.project(np.column_stack([places, np.ones(50)]))
    np.testing.assert_allclose(project(view.T_px_plate, places), seen, atol=1e-3)  # px
    corners = np.array([(0, 0), (254, 0), (254, 203), (0, 203)], float)
    np.testing.assert_allclose(view.outline, project(view.T_px_plate, corners), atol=1e-3)


def test_a_mark_has_the_ellipse_of_its_covariance():
    angle, long, short = 0.4, 3.0, 1.0
    axes = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    covariance = np.eye(6)
    covariance[3:5, 3:5] = axes @ np.diag([long**2, short**2]) @ axes.T
    covariance[5, 5] = 0.2**2
    found = Estimate(
        np.array([[50.0, 60.0], [90.0, 20.0]]), np.array([1.0, 2.0]), covariance,
        0.0, 1, 1.0, Result.FOUND,
    )  # fmt: skip
    first, second = marks(found)
    assert (second.x, second.y, second.force) == (90.0, 20.0, 2.0)
    assert second.sigma[:2] == pytest.approx((long, short))
    assert np.tan(second.sigma[2]) == pytest.approx(np.tan(angle))
    assert second.sigma_force == pytest.approx(0.2)
    assert first.sigma[:2] == pytest.approx((1.0, 1.0))


def test_a_touch_that_cannot_be_resolved_has_a_large_and_finite_ellipse():
    unknown = Estimate(
        np.array([[50.0, 60.0]]), np.array([1.0]), np.diag([np.inf] * 3),
        0.0, 1, 1.0, Result.UNRESOLVABLE,
    )  # fmt: skip
    (mark,) = marks(unknown)
    assert 100 < mark.sigma[0] < np.inf


def test_a_mark_has_the_bounds_of_a_force_that_is_not_known_evenly():
    interval = ForceInterval((0.8, 1.4), (0.6, 2.5))
    found = Estimate(
        np.array([[9.0, 60.0], [90.0, 20.0]]), np.array([1.0, 2.0]), np.eye(6),
        0.0, 1, 1.0, Result.FOUND, force_intervals=(interval, None),
    )  # fmt: skip
    assert [mark.force_interval for mark in marks(found)] == [(0.6, 2.5), None]
    followed = Tracks().follow(found, 1.0)[0].tracks
    assert [m.force_interval for m in tracked_marks(followed, found)] == [(0.6, 2.5), None]


def test_a_true_touch_is_drawn_as_exact():
    (mark,) = true_marks((fe.Touch(12.0, 34.0, 2.5),))
    assert (mark.x, mark.y, mark.force, mark.sigma) == (12.0, 34.0, 2.5, (0.0, 0.0, 0.0))


def test_the_strain_map_lies_where_its_tiles_lie(small):
    scene = small()
    bench, twin = build_bench(scene, lambda done, total: None), build_twin(scene)
    _, chain = bench.prepare(average_reference([twin.frame(k, ()) for k in range(4)]))
    assert chain is not None
    xy = chain.blocks.reference.tiles.xy
    shown = strain_map(chain, np.column_stack([1e-6 * xy, 1e-3 + 0 * xy[:, 0]]))
    x, y = np.meshgrid(shown.xs, shown.ys)
    np.testing.assert_allclose(shown.exx, 1e-6 * x, rtol=1e-6)
    np.testing.assert_allclose(shown.eyy, 1e-6 * y, rtol=1e-6)
    assert shown.exy.shape == x.shape == (38, 46)
    assert all(1e-6 < sigma < 1e-2 for sigma in shown.sigma)
