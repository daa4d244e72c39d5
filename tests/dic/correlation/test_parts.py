"""The parts of the correlation: spline, sums, grid, dense motion; and what importing them costs."""

import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy import ndimage

import dic
from dic.correlation import dense_motion, moments, normal, subset
from dic.fields import shape
from dic.fields.grid import grid_over
from dic.images import spline, warp
from dic.images.prefilter import smooth_image


@pytest.fixture(scope="module")
def image():
    return np.random.default_rng(0).normal(100, 30, (37, 52))


def continued(image, width=30):
    """Go on beyond the border as the spline does."""
    return np.pad(image, width, mode="reflect", reflect_type="odd")


def test_coefficients_are_those_of_scipy(image):
    ours, margin = spline.spline_coefficients(image), 30 - warp.PAD
    theirs = ndimage.spline_filter(continued(image), 5, mode="mirror")
    np.testing.assert_allclose(ours, theirs[margin:-margin, margin:-margin], atol=2e-3)


@settings(max_examples=50)
@given(st.floats(-0.5, 51.5), st.floats(-0.5, 36.5))
def test_sample_is_that_of_scipy(x, y):
    image = np.random.default_rng(0).normal(100, 30, (37, 52))
    place = [[y + 30], [x + 30]]
    there = ndimage.map_coordinates(continued(image), place, order=5, mode="mirror")[0]
    assert warp.sample(spline.spline_coefficients(image), x, y) == pytest.approx(there, abs=2e-3)


def test_gradient_is_the_slope_of_the_sample(image):
    c, h = spline.spline_coefficients(image), 1e-2
    gx, gy = spline.spline_gradient(c)
    x, y = 23.0, 11.0
    slope_x = (warp.sample(c, x + h, y) - warp.sample(c, x - h, y)) / (2 * h)
    slope_y = (warp.sample(c, x, y + h) - warp.sample(c, x, y - h)) / (2 * h)
    assert (gx[11, 23], gy[11, 23]) == pytest.approx((slope_x, slope_y), abs=0.05)


@pytest.mark.parametrize("sigma", [0.0, 0.8])
@pytest.mark.parametrize(
    ("place", "motion"), [((26, 18), (0.3, -0.6)), ((6, 5), (-0.4, 0.5)), ((40, 30), (4.7, -3.0))]
)
def test_shifted_subset_is_what_the_spline_gives(image, sigma, place, motion):
    half, c = 5, np.zeros((2, 3))
    c[:, 0] = motion
    tools = subset.make_tools(half, 3, sigma)
    done = subset.warp(image, False, np.array(place, dtype=float), c, half, tools)
    found = tools[6][0].reshape(2 * half + 1, -1)[:, : 2 * half + 1]
    smooth = spline.spline_coefficients(smooth_image(image, sigma) if sigma else image)
    x, y = (np.arange(-half, half + 1) + p + u for p, u in zip(place, motion, strict=True))
    there = np.array([[warp.sample(smooth, i, j) for i in x] for j in y])
    assert done == subset.SHIFTED
    np.testing.assert_allclose(found - found.mean(), there - there.mean(), atol=0.3)


@pytest.mark.parametrize("t", [0.0, 0.2, 0.5, 0.7])
def test_noise_power_is_what_noise_keeps_between_pixels(t):
    rng = np.random.default_rng(1)
    noise = rng.normal(0, 1, (400, 300))
    moved = ndimage.shift(noise, (0, -t), order=5, mode="mirror")
    mean, harmonic = spline.noise_power()
    assert mean + harmonic * np.cos(2 * np.pi * t) == pytest.approx(moved.var(), abs=0.03)


def test_noise_slope_is_that_of_noise():
    noise = np.random.default_rng(2).normal(0, 1, (300, 400))
    gx, gy = spline.spline_gradient(spline.spline_coefficients(noise))
    assert (gx.var(), gy.var()) == pytest.approx((spline.noise_slope(),) * 2, rel=0.02)


@pytest.mark.parametrize("stretch", [0.002, 0.2, -1.3])
def test_row_is_warped_as_its_pixels_are_sampled(image, stretch):
    coefficients, x = spline.spline_coefficients(image), np.arange(30.0)
    u, v = (0.4 + stretch * x).astype(np.float32), (-0.3 - 0.1 * stretch * x).astype(np.float32)
    cells, taps, row = np.empty((2, 30), np.int32), np.empty((2, 6, 30), np.float32), np.empty(30)
    warp.warp_row(coefficients, (7, 11), u, v, cells, taps, row)
    there = [warp.sample(coefficients, 7 + i + u[i], 11 + v[i]) for i in range(30)]
    np.testing.assert_allclose(row, there, atol=2e-3)


def texture_of(image):
    gx, gy = spline.spline_gradient(spline.spline_coefficients(image))
    weight = np.ones_like(gx)
    weight[5:9, 20:31] = 0
    return np.stack([gx, gy, image, np.ones_like(gx)], dtype=np.float32) * weight.astype(np.float32)


@pytest.mark.parametrize("order", [1, 2])
def test_running_sums_are_the_sums_one_by_one(image, order):
    texture, grid = texture_of(image), grid_over(image.shape, 9, 4)
    together = moments.sums_on_grid(texture, grid.xs, grid.ys, 4, order)
    alone = moments.sums_at_points(texture, grid.xy, 4, order)
    np.testing.assert_allclose(together, alone, rtol=1e-6, atol=1e-9 * np.abs(alone).max())


@pytest.mark.parametrize("order", [1, 2])
def test_inverse_is_that_of_the_normal_equations(image, order):
    texture, (x, y), half = texture_of(image), (33.3, 17.6), 6
    rows, columns = np.mgrid[18 - half : 19 + half, 33 - half : 34 + half]
    fx, fy, f, weight = texture[:, rows, columns].astype(np.float64)
    monomials = [
        (columns - x) ** a * (rows - y) ** b for a, b in shape.monomials(shape.degree(order))
    ]
    parts = [g * m for g in (fx, fy) for m in monomials] + [-f, -weight]
    jacobian = np.array([part.ravel() for part in parts])
    sums = moments.sums_at_points(texture, np.array([[x, y]]), half, order)
    inverse = normal.inverse(sums, np.zeros(1), order)[0]
    np.testing.assert_allclose(inverse @ jacobian @ jacobian.T, np.eye(len(parts)), atol=1e-4)


@pytest.mark.parametrize("order", [0, 1, 2])
def test_grid_and_lone_points_stand_still_at_the_same_motion(speckle, order):
    pattern = speckle((70, 90), seed=4)
    first, second = pattern.draw(), pattern.draw((0.7, -0.4), ((0.01, 0.004), (0.0, -0.02)))
    full = dic.correlate(dic.prepare(first, order=order), second)
    lone = dic.correlate(dic.prepare(first, order=order, points=full.xy), second)
    assert full.valid.all()
    assert lone.valid.all()
    np.testing.assert_allclose(lone.u, full.u, atol=8e-3)
    # A field also sees that it is rougher than its noise: a shift cannot follow the strain.
    rougher = full.sigma_u / lone.sigma_u
    assert rougher.min() >= 0.9
    np.testing.assert_allclose(rougher, np.median(rougher), rtol=0.35)


def test_dense_motion_is_exact_for_parabolas_inside_the_grid():
    grid = grid_over((61, 83), 9, 5)
    x, y = grid.xy.T
    motion = np.zeros((len(x), 2, 3))
    motion[:, 0, 0], motion[:, 1, 0] = 1e-3 * x * x - 2e-3 * x * y, 3e-3 * y * y
    net = dense_motion.motion_grid(motion, grid)
    px, py = 37, 29
    (column, across), (row, down) = (
        divmod(p - o, 5) for p, o in zip((px, py), net.origin, strict=True)
    )
    window = net.motion[:, row - 1 : row + 3, column - 1 : column + 3]
    u, v = np.einsum("aij,i,j->a", window, net.weights()[down], net.weights()[across]) + net.base
    assert (u, v) == pytest.approx((1e-3 * px * px - 2e-3 * px * py, 3e-3 * py * py), abs=1e-9)


@given(st.integers(25, 90), st.integers(25, 90), st.sampled_from([5, 11, 21]), st.integers(1, 30))
def test_every_subset_of_a_grid_lies_on_the_image(height, width, subset, step):
    grid = grid_over((height, width), subset, step)
    assert grid.xs[0] >= subset // 2
    assert grid.xs[-1] + subset // 2 < width
    assert grid.ys[-1] + subset // 2 < height
    assert width - (grid.xs[-1] - grid.xs[0] + subset) < step
    assert grid.xy.shape == (grid.shape[0] * grid.shape[1], 2)


def test_fill_takes_the_nearest_within_reach():
    xy = np.array([[0.0, 0], [10, 0], [100, 0]])
    motion = np.array([[[1.0, 0.1, 0], [2.0, 0, 0]], [[9] * 3] * 2, [[9] * 3] * 2])
    filled, given = dense_motion.fill(xy, motion, np.array([True, False, False]), reach=20)
    assert list(given) == [False, True, False]
    assert filled[1, 0, 0] == pytest.approx(2.0)
    assert filled[2, 0, 0] == 9


def test_importing_and_correlating_loads_neither_torch_nor_what_draws():
    code = (
        "import sys, numpy as np, dic\n"
        "early = {'numba', 'cv2', 'scipy'} & set(sys.modules)\n"
        "image = np.random.default_rng(0).integers(0, 255, (40, 50), dtype=np.uint8)\n"
        "dic.strain(dic.correlate(dic.prepare(image, subset=11, step=4), image))\n"
        "late = {'torch', 'matplotlib', 'h5py', 'fe', 'models'} & set(sys.modules)\n"
        "sys.exit(f'{early} {late}' if early | late else 0)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_every_public_name_is_there():
    assert {"prepare", "correlate", "strain", "read_image", "export"} <= set(dir(dic))
    for name in dir(dic):
        assert getattr(dic, name) is not None
