"""What a plate and a camera do to the image of every tile, against the camera itself."""

import numpy as np
import pytest

import models


@pytest.mark.parametrize("towards", [12.0, -12.0])
def test_a_plate_that_comes_nearer_moves_further(bench, towards):
    """Motion of some millimetres, to second order, against points that are moved and seen again."""
    motions, modes, camera = bench.pattern.motions, bench.modes, bench.camera
    amplitudes = np.zeros(motions.basis.shape[1])
    amplitudes[0] = towards / np.abs(modes.value(np.array(modes.plate.size)[None] / 2)[0, 0])

    def moved(px):
        """Where the point that was at a pixel goes, px."""
        places = camera.on_plate(px, bench.height)
        w = amplitudes[0] * modes.value(places)[:, 0]
        slope = amplitudes[0] * modes.slope(places)[:, 0]
        at = np.column_stack([places, np.full(len(places), bench.height)])
        return camera.project(at + np.column_stack([-bench.height * slope, w]))

    inner = np.abs(motions.tiles.xy - np.array(camera.size) / 2).max(axis=1) < 90
    xy = motions.tiles.xy[inner]
    came_from = xy.copy()
    for _ in range(20):
        came_from -= moved(came_from) - xy
    truth = xy - came_from
    assert np.abs(truth).max() > 2.0
    # Without the change of scale by the distance 0.07 px.
    assert np.abs(motions.flow(amplitudes)[inner] - truth).max() < 0.012


def test_tilts_of_a_pinhole_move_the_image_as_its_rotation_does(bench):
    camera = bench.camera
    px = np.random.default_rng(2).uniform(20, 230, (30, 2))
    basis = models.with_tilts(camera, px)
    ray = np.column_stack([(px - camera.centre) / camera.focal, np.ones(len(px))])
    angle = 1e-5
    for axis, sign in ((0, 1.0), (1, 1.0)):
        turned = ray.copy()
        turned[:, axis] -= sign * angle
        turned[:, 2] += sign * angle * ray[:, axis]
        shift = camera.focal * (turned[:, :2] / turned[:, 2:] - ray[:, :2])
        rest = shift.ravel() / angle
        coefficients, *_ = np.linalg.lstsq(basis.reshape(-1, basis.shape[2]), rest, rcond=None)
        left = basis.reshape(-1, basis.shape[2]) @ coefficients - rest
        assert np.abs(left).max() < 1e-3 * np.abs(rest).max()
        assert coefficients[-2 + axis] == pytest.approx(-1.0, rel=1e-2)
