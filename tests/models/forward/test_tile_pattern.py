"""Touches from the whole pattern: what was pressed is found in the image, to the bound."""

from dataclasses import replace

import cv2
import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

import fe
import models
import synthetic
from dic.tiles.preparation import prepare_tiles
from dic.tiles.tiles import TileSums, lay_tiles, tile_sums
from models.forward.tile_pattern import noise_from_sums

TOP = 0.5  # mm, half the thickness of the plate
NOISE = 2.0  # grey levels, as the bench of `conftest.py`
ONE = [(60.0, 70.0, 1.0)]
TWO = [(50.0, 50.0, 1.5), (110.0, 70.0, 2.0)]
DRIFTS = {
    "still": {},
    "shift": {"shift": (0.3, -0.3)},
    "turn": {"turn": 1e-3},
    "scale": {"grow": 1e-3},
    "all": {"shift": (-0.3, 0.2), "turn": -1e-3, "grow": -5e-4},
}


def deviations(estimate, touches):
    """Errors in standard deviations of a frame, (n, 3)."""
    sigma = np.sqrt(np.diag(estimate.covariance)).reshape(-1, 3)
    return (np.column_stack([estimate.xy, estimate.force]) - touches) / sigma


@pytest.mark.parametrize("drift", DRIFTS)
@pytest.mark.parametrize("touches", [ONE, TWO])
def test_touches_are_found_wherever_the_camera_has_drifted(bench, touches, drift):
    estimate = bench.sense(bench.image(touches, **DRIFTS[drift]))
    assert estimate.result is models.Result.FOUND
    assert estimate.count == len(touches)
    # No noise here: what is left of the modes, the spline and the camera's curvature.
    assert np.abs(deviations(estimate, touches)).max() < 1.0


@pytest.mark.parametrize(("gain", "offset"), [(1.1, -8.0), (0.9, 10.0), (1.0, 25.0)])
def test_the_light_does_not_matter(bench, gain, offset):
    estimate = bench.sense(gain * bench.image(TWO) + offset)
    assert np.abs(deviations(estimate, TWO)).max() < 1.0


def test_the_light_is_a_free_unknown(bench):
    # In place and without motion the change of the light is separated exactly from all motion.
    frame = 1.2 * np.asarray(bench.reference.image, dtype=float) - 10
    right = bench.pattern.gradient(tile_sums(bench.reference, frame), bench.pattern.still())
    assert np.abs(bench.pattern.whiten(right, NOISE)).max() < 1e-2  # standard deviations


def test_following_the_last_frame_finds_what_a_fresh_start_finds(bench):
    rng = np.random.default_rng(1)
    frame = bench.image(ONE) + rng.normal(0, NOISE, bench.reference.image.shape)
    followed = bench.sense(frame, start=[(62.0, 68.0, 1.2)])
    afresh = bench.sense(frame)
    np.testing.assert_allclose(followed.xy, afresh.xy, atol=0.02)  # mm
    np.testing.assert_allclose(followed.force, afresh.force, atol=1e-3)  # N


def test_nothing_is_found_in_empty_frames(bench):
    rng, still = np.random.default_rng(2), bench.image()
    for _ in range(60):
        frame = still + rng.normal(0, NOISE, still.shape)
        assert bench.sense(frame, passes=1).result is models.Result.NO_TOUCH


@pytest.mark.slow
@pytest.mark.parametrize("touches", [ONE, TWO])
def test_scatter_reaches_the_bound(bench, touches):
    rng, truth = np.random.default_rng(3), bench.image(touches)
    errors, squares, p_values = [], [], []
    for _ in range(150):
        estimate = bench.sense(truth + rng.normal(0, NOISE, truth.shape), passes=2)
        assert estimate.count == len(touches)
        error = (np.column_stack([estimate.xy, estimate.force]) - touches).ravel()
        errors.append(error)
        squares.append(error @ np.linalg.solve(estimate.covariance, error))
        p_values.append(estimate.p_value)
    fine = models.pixel_level(
        bench.modes, bench.camera, bench.height, np.asarray(bench.reference.image, float)
    )
    bound = np.sqrt(np.diag(models.cramer_rao(fine, np.array(touches), NOISE)))
    rms, bias = np.sqrt(np.mean(np.square(errors), axis=0)), np.mean(errors, axis=0)
    assert (rms < 1.2 * bound).all()  # measured 0.96 to 1.12, the bias in it
    assert (np.abs(bias) < 0.6 * bound).all()  # measured 0.36, and 0.63 with a quintic spline
    assert np.mean(squares) < 1.3 * 3 * len(touches)
    assert 0.3 < np.mean(p_values) < 0.7


def test_amplitudes_are_what_moved_modes_and_camera(bench):
    # A frame made by the linear model itself: all unknowns come back.
    motions, pattern, reference = bench.pattern.motions, bench.pattern, bench.reference
    rng = np.random.default_rng(4)
    place, force = np.array([[70.0, 40.0]]), np.array([0.8])
    modal = force @ bench.modes.response(place)
    camera = rng.normal(0, [0.2, 0.2, 1e-3, 1e-3])
    moved = np.concatenate([modal, camera])
    unknowns = np.concatenate([moved, [0.05, -3.0]])
    right = pattern.normal @ unknowns
    measured = pattern.whiten(right, NOISE)
    truth = force @ pattern.forward(NOISE).response(place)
    np.testing.assert_allclose(measured, truth, atol=1e-6 * np.abs(truth).max())
    estimate = models.find(measured, bench.search)
    np.testing.assert_allclose(estimate.xy, place, atol=1e-6)
    np.testing.assert_allclose(pattern.amplitudes(estimate, right), moved, atol=1e-6)
    # The same from the sums of an image that moved by the motion of the tiles.
    sums = moved_by(reference, motions.tile_basis() @ moved, 0.05, -3.0)
    np.testing.assert_allclose(
        pattern.gradient(sums, pattern.still()), right, atol=2e-4 * np.abs(right).max()
    )
    none = models.find(np.zeros(pattern.count), bench.search)
    assert not pattern.amplitudes(none, np.zeros(len(right))).any()


def moved_by(reference, flow, gain, offset):
    """Tile sums of e = -∇f·d + gain f + offset, from the pixels."""
    tiles, f = reference.tiles, reference.image.astype(float)
    left, top = tiles.origin
    rows, columns, size = *tiles.shape, tiles.size
    e = gain * f + offset
    wide = np.kron(flow.reshape(rows, columns, 2), np.ones((size, size, 1)))
    inside = np.s_[top : top + rows * size, left : left + columns * size]
    fx, fy = reference.gradient.astype(float)
    e[inside] -= fx[inside] * wide[..., 0] + fy[inside] * wide[..., 1]
    gradient = np.column_stack([tiles.sums(fx * e), tiles.sums(fy * e)])
    nothing = np.zeros_like(flow)
    squares = tiles.sums(e), tiles.sums(e * e), tiles.sums(e * f)
    return TileSums(gradient, *squares, reference.hessian, reference.light, nothing)


def test_the_normal_matrix_is_that_of_the_pixels(bench):
    # Every pixel is one equation: -∇f·φ_k, f, 1.
    reference, motions = bench.reference, bench.pattern.motions
    picked = np.array([0, 3, 17, 60, 120, 121, 122, 123])
    columns = [moved_by(reference, motions.tile_basis()[:, :, k], 0.0, 0.0) for k in picked]
    columns += [moved_by(reference, np.zeros((len(reference.hessian), 2)), *light)
                for light in ((1.0, 0.0), (0.0, 1.0))]  # fmt: skip
    count = len(bench.pattern.normal)
    rows = [*picked, count - 2, count - 1]
    for k, sums in zip(rows, columns, strict=True):
        along = -(motions.tile_basis() * sums.gradient[:, :, None]).sum(axis=(0, 1))
        truth = np.concatenate([along, [sums.ef.sum(), sums.e.sum()]])
        scale = np.sqrt(np.diag(bench.pattern.normal) * bench.pattern.normal[k, k])
        np.testing.assert_allclose(bench.pattern.normal[k] / scale, truth / scale, atol=1e-5)


def test_motions_of_the_tiles_are_the_modes_as_the_camera_sees_them(bench):
    motions, camera, modes = bench.pattern.motions, bench.camera, bench.modes
    height = bench.height
    truth = np.zeros((len(motions.tiles.xy), 2, len(modes.stiffness)))
    offsets = (np.arange(8) - 3.5)[::2] + 0.5
    for dx in offsets:
        for dy in offsets:
            px = motions.tiles.xy + np.array([dx, dy])
            places = camera.on_plate(px, height).clip(0, modes.plate.size)
            truth += synthetic.image_motion_basis(
                camera, px, modes.value(places), modes.slope(places), height
            )
    truth /= len(offsets) ** 2
    missed = motions.tile_basis()[:, :, : modes.stiffness.size] - truth
    inner = (np.abs(motions.tiles.xy - [159.5, 127.5]) < [130, 100]).all(axis=1)
    fraction = missed[inner].std(axis=(0, 1)) / truth[inner].std(axis=(0, 1))
    assert fraction[:10].max() < 2e-3  # a touch puts 0.999 of its deflection there
    assert np.median(fraction) < 3e-2


@settings(max_examples=20)
@given(st.integers(0, 10**6))
def test_gather_is_the_adjoint_of_small_flows_and_farthest_bounds_them(bench, seed):
    rng, motions = np.random.default_rng(seed), bench.pattern.motions
    amplitudes = 1e-3 * rng.normal(size=motions.basis.shape[1]) / np.abs(motions.basis).max(axis=0)
    sums = rng.normal(size=(len(bench.reference.hessian), 2))
    flow, at_rest = motions.flow(amplitudes), np.zeros_like(sums)
    there, back = (flow * sums).sum(), amplitudes @ motions.project(sums, at_rest)
    assert there == pytest.approx(back, abs=2e-3 * np.linalg.norm(flow) * np.linalg.norm(sums))
    assert np.abs(flow).max() <= motions.max_motion(amplitudes) * 1.01
    columns = motions.tile_basis() @ amplitudes
    np.testing.assert_allclose(flow, columns, atol=1e-2 * np.abs(columns).max())


@pytest.mark.parametrize("drift", [(0.4, -0.3, 0, 0), (0, 0, 2e-3, 1e-3), (0.2, 0.2, -1e-3, 1e-3)])
def test_gather_is_the_derivative_of_flow_wherever_the_camera_has_moved(bench, drift):
    rng, motions = np.random.default_rng(5), bench.pattern.motions
    modal = 0.8 * bench.modes.response([[70.0, 40.0]])[0]
    moved = np.concatenate([modal, drift])
    sums = rng.normal(size=(len(bench.reference.hessian), 2))
    step = 0.01 * np.concatenate([bench.modes.response([[90.0, 60.0]])[0], np.zeros(4)])
    there = ((motions.flow(moved + step) - motions.flow(moved - step)) * sums).sum() / 2
    change = motions.flow(step)
    back = step @ motions.project(sums, motions.flow(moved))
    assert there == pytest.approx(back, abs=5e-3 * np.linalg.norm(change) * np.linalg.norm(sums))


def test_a_tile_sees_the_point_that_came_there(bench):
    # d(x) = u(x - d): by fixed point on the exact camera, for a touch and a shift.
    motions, camera, tiles = bench.pattern.motions, bench.camera, bench.pattern.motions.tiles
    amplitudes = np.concatenate([2 * bench.modes.response([[70.0, 40.0]])[0], [0.6, -0.8, 0, 0]])

    def u(px):
        places = camera.on_plate(px, bench.height)
        values = bench.modes.value(places), bench.modes.slope(places)
        return synthetic.image_motion_basis(camera, px, *values, bench.height) @ amplitudes[
            :120
        ] + [0.6, -0.8]

    inner = (np.abs(tiles.xy - [159.5, 127.5]) < [130, 100]).all(axis=1)
    px = tiles.xy[inner]
    seen = u(px)
    for _ in range(4):
        seen = u(px - seen)
    missed = motions.flow(amplitudes)[inner] - seen
    assert missed.std() < 1e-3  # px; u at the tile itself misses it by 5e-3


def test_noise_is_read_from_the_frame_whatever_a_hand_covers(bench):
    rng = np.random.default_rng(6)
    frame = bench.image() + rng.normal(0, NOISE, bench.reference.image.shape)
    frame[:, :80] = 20.0  # a hand over a quarter
    noise = noise_from_sums(tile_sums(bench.reference, frame), bench.reference.tiles)
    assert noise == pytest.approx(NOISE, rel=0.1)


def test_a_reference_with_other_tiles_is_refused(bench):
    other = prepare_tiles(bench.reference.image, size=16)
    assert other.tiles == lay_tiles((256, 320), 16)
    with pytest.raises(ValueError, match=r"use the same tiles$"):
        models.prepare_pattern(bench.pattern.motions, other)


@pytest.mark.parametrize("noise", [0.0, -1.0, np.nan])
def test_a_noise_that_is_not_positive_is_refused(bench, noise):
    with pytest.raises(ValueError, match=r"^noise of a frame must be positive, got .* grey levels"):
        bench.pattern.forward(noise)


@pytest.mark.parametrize("hidden", [np.zeros(3, bool), np.zeros(1, int)])
def test_a_mask_that_is_not_one_bool_a_tile_is_refused(bench, hidden):
    with pytest.raises(ValueError, match=r"^hidden tiles must be .* bool, one a tile, got"):
        bench.pattern.hiding(hidden)


def test_a_plate_is_seen_where_it_is(bench):
    # Tiles beside the plate carry no motion of it.
    plate = fe.Plate((60.0, 50.0), 1.0, 3000.0, 0.38)
    camera = synthetic.pinhole_above(plate.size, 260.0, (320, 256), margin=0.25)
    tiles = lay_tiles((256, 320), 8)
    motions = models.prepare_motions(fe.modes(plate, 6), camera, 0.5, tiles)
    seen = np.abs(motions.tile_basis()[:, :, :6]).max(axis=(1, 2))
    places = camera.on_plate(tiles.xy, 0.5)
    beside = ((places < -15) | (places > np.array(plate.size) + 15)).any(axis=1)
    assert beside.any()
    assert seen[beside].max() < 0.05 * seen.max()  # the spline rings where the plate ends


@pytest.mark.parametrize("margin", [pytest.param(0.1, marks=pytest.mark.slow), 0.25])
def test_a_free_edge_is_seen_to_move_up_to_its_end(margin):
    edges = fe.Edges(fe.Clamped(), fe.Clamped(), fe.Free(), fe.Free())
    plate = fe.Plate((60.0, 50.0), 1.0, 3000.0, 0.38, edges)
    camera = synthetic.pinhole_above(plate.size, 260.0, (320, 256), margin=margin)
    modes, tiles = fe.modes(plate, 4), lay_tiles((256, 320), 8)
    motions = models.prepare_motions(modes, camera, 0.5, tiles)
    corners = np.array([(-3.5, -3.5), (3.5, -3.5), (-3.5, 3.5), (3.5, 3.5)])
    at = camera.on_plate((tiles.xy[:, None] + corners).reshape(-1, 2), 0.5).reshape(-1, 4, 2)
    whole = ((at > 0) & (at < np.array(plate.size))).all(axis=(1, 2))
    places = camera.on_plate(tiles.xy[whole], 0.5)
    values = modes.value(places), modes.slope(places)
    exact = synthetic.image_motion_basis(camera, tiles.xy[whole], *values, 0.5)
    off = motions.tile_basis()[whole, :, :4] - exact
    # Measured 0.033 and 0.035; 0.19 when the motion ended with the plate, 0.056 three tiles on.
    assert np.abs(off).max() < 0.05 * np.abs(exact).max()


def test_what_lies_beside_the_plate_says_nothing_of_it():
    """A table with a pattern of its own, which is moved, changes no number of what is measured."""
    edges = fe.Edges(fe.Clamped(), fe.Clamped(), fe.Free(), fe.Free())
    plate = fe.Plate((60.0, 40.0), 1.0, 3000.0, 0.38, edges)
    camera = synthetic.pinhole_above(plate.size, 260.0, (320, 320), margin=0.1)
    rng = np.random.default_rng(7)
    image = cv2.GaussianBlur(rng.normal(128.0, 160.0, (320, 320)), (0, 0), 1.2).astype(np.float32)
    reference = prepare_tiles(image, 8)
    motions = models.prepare_motions(fe.modes(plate, 6), camera, 0.5, reference.tiles)
    pattern = models.prepare_pattern(motions, reference)
    beside = ~motions.on_plate
    places = camera.on_plate(reference.tiles.xy, 0.5)
    outside = ((places < -2.0) | (places > np.array(plate.size) + 2.0)).any(axis=1)
    assert 0.3 < outside.mean() < 0.9
    assert beside[outside].all()
    assert not beside[~((places < 0.0) | (places > np.array(plate.size))).any(axis=1)].any()

    pixels = np.pad(np.kron(beside.reshape(reference.tiles.shape), np.ones((8, 8))), 8) > 0
    frame = image + rng.normal(0.0, 1.0, image.shape).astype(np.float32)
    moved = np.where(pixels, np.roll(frame, 1, axis=1), frame)
    still = pattern.still()
    flow = motions.flow(still)
    right, other = (
        pattern.gradient(tile_sums(reference, one, flow), still) for one in (frame, moved)
    )
    np.testing.assert_allclose(other, right, atol=1e-6 * np.abs(right).max())
    hidden = np.zeros(len(outside), dtype=bool)
    hidden[:40] = True  # all of them beside the plate
    np.testing.assert_allclose(pattern.hiding(hidden).normal, pattern.normal, rtol=1e-9)


def tilting(bench):
    tiles = bench.reference.tiles
    return models.prepare_motions(bench.modes, bench.camera, TOP, tiles, moves=models.with_tilts)


def test_tilts_are_those_of_a_camera_that_turns_about_its_centre(bench):
    # The first-order motion of all points of the plate as the pose of the camera changes.
    camera, motions = bench.camera, tilting(bench)
    px, angle = motions.tiles.xy, 1e-5
    points = np.column_stack([camera.on_plate(px, TOP), np.full(len(px), TOP)])
    seen = motions.tile_basis()[:, :, -6:]
    for axis, tilt in ((0, -1), (1, -2)):
        turn = np.eye(4)
        ray = np.zeros(3)
        ray[axis] = angle
        turn[:3, :3] += np.cross(np.eye(3), ray)
        q, _ = np.linalg.qr(turn[:3, :3])
        turn[:3, :3] = q * np.sign(np.diag(q))
        tilted = replace(camera, T_cam_plate=turn @ camera.T_cam_plate)
        moved = ((tilted.project(points) - px) / angle).reshape(-1)
        columns = seen.reshape(len(moved), -1)
        with_tilts, without = (
            np.linalg.lstsq(part, moved, rcond=None) for part in (columns, columns[:, :4])
        )
        left = moved - columns @ with_tilts[0]
        assert np.abs(left).max() < 1e-3 * np.abs(moved).max()
        assert abs(with_tilts[0][tilt]) == pytest.approx(1.0, rel=0.02)
        assert np.abs(moved - columns[:, :4] @ without[0]).max() > 20 * np.abs(left).max()


def test_a_camera_that_tilts_leaves_the_touches_where_they_are(bench):
    pattern = models.prepare_pattern(tilting(bench), bench.reference)
    tilts = pattern.motions.tile_basis()[:, :, -2:] @ [0.004, -0.003]  # up to half a pixel
    assert 0.1 < np.abs(tilts).max() < 1.0
    unknowns = np.zeros(len(pattern.normal))
    unknowns[: bench.pattern.count] = 1.5 * bench.modes.response([[60.0, 70.0]])[0]
    unknowns[-4:-2] = 0.004, -0.003
    right = pattern.normal @ unknowns
    search = models.prepare_candidates(pattern.forward(NOISE))
    estimate = models.find(pattern.whiten(right, NOISE), search)
    np.testing.assert_allclose(estimate.xy, [[60.0, 70.0]], atol=1e-5)
    assert estimate.count == 1


def test_what_a_camera_leaves_is_taken_off_by_how_much_it_moved(bench):
    """Two numbers of the plate seem to change with a shift; without one nothing is taken off."""
    uneven = np.zeros((bench.pattern.count, len(bench.pattern.still()) - bench.pattern.count))
    uneven[0, 0], uneven[2, 0] = 0.03, -0.02
    other = replace(bench.pattern, uneven=uneven)
    for shift in (0.0, 0.2):
        moved = bench.pattern.still()
        moved[bench.pattern.count] = shift
        sums = tile_sums(bench.reference, bench.image(), bench.pattern.motions.flow(moved))
        right = bench.pattern.gradient(sums, moved)
        motion = bench.pattern.motion(right)
        taken = bench.pattern.whiten(right, NOISE) - other.whiten(right, NOISE)
        by = bench.pattern.uncorrected(motion)
        expected = bench.pattern.factor.T @ (uneven @ by) / NOISE
        np.testing.assert_allclose(taken, expected, atol=1e-9)
        assert other.uncorrected(motion) is None
    assert other.hiding(np.arange(len(other.hidden)) < 9).uneven is uneven
