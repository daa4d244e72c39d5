"""The fast images against the exact ones, in grey levels and in pixels of displacement."""

import numpy as np
import pytest

import synthetic

PLATE = (60.0, 46.0)
Z = 0.5
PATTERN = synthetic.Speckle(PLATE, seed=6).draw()
CAMERA = synthetic.pinhole_above(PLATE, stand_off=150.0, pixels=(253, 196))
WARPER = synthetic.prepare_warp(PATTERN, CAMERA, Z)


def pressed(points):
    """Bend a clamped plate: slopes vanish at the edges, the face moves by −z times the slope."""
    x, y = (np.pi * points / PLATE).T
    w = -1.5 * np.sin(x) ** 2 * np.sin(y) ** 2
    wx = -1.5 * np.pi / PLATE[0] * np.sin(2 * x) * np.sin(y) ** 2
    wy = -1.5 * np.pi / PLATE[1] * np.sin(2 * y) * np.sin(x) ** 2
    return np.column_stack([-Z * wx, -Z * wy, w])


def tilted(points):
    """Turn the plate a little, so that the field does not vanish at any edge."""
    return np.column_stack([np.full((len(points), 2), (0.01, -0.02)), points @ [0.02, -0.015] - 1])


def compared(displacement, shift=(0.0, 0.0)):
    """Exact image and error of the warped one."""
    exact = synthetic.render(PATTERN, CAMERA, displacement, None, None, Z)
    warped = WARPER.render(displacement(WARPER.points), None, None, shift)
    return exact, warped - exact


def tile_bias(exact, error, side=21):
    """Displacement, px, that least squares on each tile reads out of the error."""
    slopes = np.stack(np.gradient(exact)[::-1], axis=-1)
    found = []
    for top in range(10, exact.shape[0] - 10 - side, side):
        for left in range(10, exact.shape[1] - 10 - side, side):
            tile = np.s_[top : top + side, left : left + side]
            A, b = slopes[tile].reshape(-1, 2), -error[tile].ravel()
            found.append(np.linalg.lstsq(A, b, rcond=None)[0])
    return np.array(found)


@pytest.mark.parametrize("displacement", [lambda p: np.zeros((len(p), 3)), pressed, tilted])
def test_a_warped_image_is_the_exact_one_within_a_thousandth_of_a_pixel(displacement):
    exact, error = compared(displacement)
    bias = tile_bias(exact, error)
    # Measured at most 0.18 grey levels of 255, 0.7 mpx a tile, 0.02 mpx on average.
    assert error.std() < 0.3
    assert np.abs(bias).max() < 1.0e-3
    assert np.abs(bias.mean(axis=0)).max() < 1.0e-4


def wavy(points):
    """Move along x by waves of 3.5 mm, 15 px."""
    moved = np.zeros((len(points), 3))
    moved[:, 0] = 0.05 * np.sin(2 * np.pi * points[:, 0] / 3.5)
    return moved


def test_a_finer_spacing_follows_what_eight_pixels_do_not():
    exact, coarse = compared(wavy)
    warper = synthetic.prepare_warp(PATTERN, CAMERA, Z, spacing=1)
    again = synthetic.Warper.from_arrays(CAMERA, Z, warper.arrays())
    fine = again.render(wavy(again.points), None, None) - exact
    assert len(again.points) > 253 * 196
    assert fine.std() < 0.6 < 5.0 < coarse.std()
    assert np.abs(tile_bias(exact, fine)).max() < 4.0e-3


def test_a_shift_moves_the_whole_image():
    rest = WARPER.render(np.zeros((len(WARPER.points), 3)), None, None)
    moved = WARPER.render(pressed(WARPER.points), None, None, (3.0, -2.0))
    still = WARPER.render(pressed(WARPER.points), None, None)
    assert np.std(moved[:-2, 3:] - still[2:, :-3]) < 0.1
    assert np.std(still - rest) > 10


def test_a_warper_comes_back_from_its_arrays():
    again = synthetic.Warper.from_arrays(CAMERA, Z, WARPER.arrays())
    u = pressed(WARPER.points)
    assert np.array_equal(again.render(u, None, None), WARPER.render(u, None, None))


def test_control_points_lie_on_the_plate():
    assert np.all(WARPER.points >= 0)
    assert np.all(WARPER.points <= PLATE)
    rows, columns = WARPER.grid
    assert len(WARPER.points) >= rows * columns


def test_frames_go_through_the_sensor_into_the_buffer_given():
    out = np.empty((196, 253), np.uint8)
    u = pressed(WARPER.points)
    image = WARPER.render(u, synthetic.Sensor(), np.random.default_rng(1), out=out)
    assert image is out
    noise = out - 255 * (0.2 + 0.52 * WARPER.light.astype(float))
    assert abs(noise.mean()) < 4 * 2 / np.sqrt(noise.size)
    assert noise.std() == pytest.approx(np.hypot(2, np.sqrt(1 / 12)), rel=0.02)


def test_a_seed_repeats_the_frame():
    u = pressed(WARPER.points)
    first, again = (
        WARPER.render(u, synthetic.Sensor(), np.random.default_rng(1)) for _ in range(2)
    )
    assert np.array_equal(first, again)


@pytest.mark.parametrize(
    ("call", "sentence"),
    [
        (lambda: WARPER.render(np.zeros((4, 3)), None, None), "displacement must have"),
        (lambda: WARPER.render(WARPER.points, None, None), r"shape \(K, 3\)"),
        (
            lambda: WARPER.render(np.full((len(WARPER.points), 3), np.nan), None, None),
            "displacement must be finite",
        ),
        (
            lambda: WARPER.render(np.zeros((len(WARPER.points), 3)), None, None, (np.nan, 0.0)),
            "smaller than the image, 253 px, got nan px",
        ),
        (lambda: synthetic.prepare_warp(PATTERN, CAMERA, Z, oversample=0), "oversample"),
        (lambda: synthetic.prepare_warp(PATTERN, CAMERA, Z, spacing=9), "lie in 1…8 px, got 9 px"),
    ],
)
def test_bad_input_is_named_in_one_sentence(call, sentence):
    with pytest.raises(ValueError, match=sentence):
        call()


def bent(points):
    """Bend the plate far along x: an arch that is 8 mm high and 2 mm shorter."""
    turn = np.pi * points[:, 0] / PLATE[0]
    return np.column_stack(
        [
            1.0 - 2.0 * points[:, 0] / PLATE[0],
            0.02 * points[:, 0],
            8.0 * np.sin(turn) + 0.03 * points[:, 1],
        ]
    )


def test_a_plate_that_is_bent_far_is_warped_from_there():
    warper = synthetic.prepare_warp(PATTERN, CAMERA, Z, displacement=bent)
    for further in (lambda points: np.zeros((len(points), 3)), pressed):

        def whole(points, further=further):
            return bent(points) + further(points)

        exact = synthetic.render(PATTERN, CAMERA, whole, None, None, Z)
        moved = whole(warper.points)
        error = warper.render(moved, None, None) - exact
        # 0.2 grey levels of 255 measured; the steep flanks have spots of 2 px.
        assert error[12:-12, 12:-12].std() < 0.5
    again = synthetic.Warper.from_arrays(CAMERA, Z, warper.arrays())
    np.testing.assert_allclose(again.points, warper.points)
    np.testing.assert_array_equal(again.render(moved, None, None), warper.render(moved, None, None))
