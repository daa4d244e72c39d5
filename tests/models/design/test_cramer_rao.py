"""The Cramér-Rao bound equals the Fisher matrix that is summed pixel by pixel."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.ndimage import map_coordinates

import fe
import models
import synthetic
from dic.tiles.tiles import lay_tiles

NOISE = 1.7  # grey levels


@pytest.fixture(scope="module")
def fine(bench):
    image = np.asarray(bench.reference.image, dtype=float)
    return models.pixel_level(
        bench.modes, bench.camera, bench.height, image, moves=models.with_tilts
    )


def by_pixels(bench, touches):
    """Covariance of x, y, F from one equation a pixel, the plate solved anew for each slope."""
    image = np.asarray(bench.reference.image, dtype=float)
    tiles = lay_tiles(image.shape, 4)
    left, top = tiles.origin
    x, y = np.meshgrid(left + np.arange(4 * tiles.shape[1]), top + np.arange(4 * tiles.shape[0]))
    px = np.column_stack([x.ravel(), y.ravel()]).astype(float)
    height = bench.height
    places = bench.camera.on_plate(px, height)
    inside = ((places >= 0) & (places <= bench.modes.plate.size)).all(axis=1)

    def motion(pressed):
        moved = np.zeros_like(px)
        field = bench.solver.deflect([fe.Touch(*touch) for touch in pressed])
        displacement = field.displacement(places[inside], "top")
        moved[inside] = synthetic.image_motion(bench.camera, places[inside], displacement, height)
        return moved

    columns = []
    for n in range(len(touches)):
        for k, nudge in enumerate((0.05, 0.05, 0.01)):
            step = np.zeros_like(touches)
            step[n, k] = nudge
            columns.append((motion(touches + step) - motion(touches - step)) / (2 * nudge))
    columns += list(synthetic.rigid_motion_basis(bench.camera, px).transpose(2, 0, 1))
    columns += [tilted(bench.camera, px, height, axis) for axis in (0, 1)]

    def light(dx, dy):
        return map_coordinates(image, [px[:, 1] + dy, px[:, 0] + dx], order=5, mode="mirror")

    fx, fy = (light(0.01, 0) - light(-0.01, 0)) / 0.02, (light(0, 0.01) - light(0, -0.01)) / 0.02
    equations = [-(fx * column[:, 0] + fy * column[:, 1]) for column in columns]
    equations = np.array([*equations, light(0, 0), np.ones(len(px))]) / NOISE
    wanted = 3 * len(touches)
    return np.linalg.inv(equations @ equations.T)[:wanted, :wanted]


def tilted(camera, px, height, axis, angle=1e-4):
    """Motion of the image, px per rad, as the camera turns about its own x or y."""
    points = np.column_stack([camera.on_plate(px, height), np.full(len(px), height)])
    seen = []
    for turn in (angle, -angle):
        pose, (c, s) = np.eye(4), (np.cos(turn), np.sin(turn))
        others = [1 - axis, 2]
        pose[np.ix_(others, others)] = [[c, -s], [s, c]]
        seen.append(replace(camera, T_cam_plate=pose @ camera.T_cam_plate).project(points))
    return (seen[0] - seen[1]) / (2 * angle)


@pytest.mark.slow
@pytest.mark.parametrize("touches", [[(60.0, 70.0, 1.0)], [(50.0, 50.0, 1.5), (110.0, 70.0, 2.0)]])
def test_bound_is_that_of_the_pixels(bench, fine, touches):
    touches = np.array(touches)
    found, truth = models.cramer_rao(fine, touches, NOISE), by_pixels(bench, touches)
    sigma = np.sqrt(np.diag(truth))
    np.testing.assert_allclose(np.sqrt(np.diag(found)), sigma, rtol=0.02)
    np.testing.assert_allclose(found / np.outer(sigma, sigma), truth / np.outer(sigma, sigma),
                               atol=0.04)  # fmt: skip


@pytest.mark.slow
def test_bound_beside_an_edge_and_of_neighbours_is_that_of_the_pixels(bench):
    image = np.asarray(bench.reference.image, dtype=float)
    for touches in ([(8.0, 70.0, 1.0)], [(60.0, 70.0, 1.0), (75.0, 70.0, 2.0)]):
        found, truth = (
            np.sqrt(np.diag(covariance))
            for covariance in (
                models.pixel_bound(
                    bench.modes.plate,
                    bench.camera,
                    bench.height,
                    image,
                    np.array(touches),
                    NOISE,
                    moves=models.with_tilts,
                ),
                by_pixels(bench, np.array(touches)),
            )
        )
        np.testing.assert_allclose(found, truth, rtol=0.03)


def test_bound_grows_with_the_noise_and_falls_with_the_force(fine):
    touch = np.array([[60.0, 70.0, 1.0]])
    base = models.cramer_rao(fine, touch, NOISE)
    np.testing.assert_allclose(models.cramer_rao(fine, touch, 2 * NOISE), 4 * base)
    harder = models.cramer_rao(fine, touch * [1, 1, 2], NOISE)
    np.testing.assert_allclose(harder[:2, :2], base[:2, :2] / 4)
    assert harder[2, 2] == pytest.approx(base[2, 2])


def test_a_touch_without_force_has_no_place(fine):
    bound = np.diag(models.cramer_rao(fine, np.array([[60.0, 70.0, 0.0]]), NOISE))
    assert (bound[:2] > 1e6).all()
    assert bound[2] < 1.0


def test_tiles_lose_little_of_what_the_pixels_know(bench, fine):
    touch = np.array([[60.0, 70.0, 1.0]])
    tiles = models.cramer_rao(bench.pattern, touch, NOISE)
    pixels = models.cramer_rao(fine, touch, NOISE)
    assert np.sqrt(np.diag(tiles) / np.diag(pixels)) == pytest.approx([1, 1, 1], abs=0.05)
