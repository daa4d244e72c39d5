"""Smoothing by local polynomials: what is kept, what the noise is, what is refused."""

from dataclasses import replace

import numpy as np
import pytest

import dic
from dic import Status
from dic.fields.grid import grid_over


def field(u, grid, sigma=0.01):
    """Field with this u at the points of a grid, v its negative half."""
    n = len(u)
    return dic.DisplacementField(
        xy=grid.xy,
        u=u,
        v=-u / 2,
        sigma_u=np.full(n, sigma),
        sigma_v=np.full(n, sigma),
        gradient=np.zeros((n, 2, 2)),
        sigma_gradient=np.zeros((n, 2, 2)),
        zncc=np.ones(n),
        iterations=np.ones(n, np.int16),
        valid_fraction=np.ones(n),
        status=np.zeros(n, np.int8),
        subset=grid.subset,
        order=1,
        grid=grid,
    )


@pytest.fixture
def grid():
    return grid_over((150, 190), 15, 5)


def mean_over_subset(function, grid):
    """Measure a displacement as a subset of order 1 does."""
    pixels = np.arange(grid.subset) - grid.subset // 2
    dy, dx = np.meshgrid(pixels, pixels, indexing="ij")
    x, y = grid.xy.T[:, :, None]
    return function(x + dx.ravel(), y + dy.ravel()).mean(axis=1)


@pytest.mark.parametrize("degree", [1, 2, 3, 4])
def test_polynomials_of_the_degree_are_found_from_their_means(grid, degree):
    def motion(x, y):
        return ((x - 90) / 60) ** degree - ((x - 70) / 50) * ((y - 40) / 70) ** (degree - 1)

    smooth = dic.smooth(field(mean_over_subset(motion, grid), grid), 7, degree)
    truth = motion(*grid.xy.T)
    assert smooth.valid.all()  # at the border too
    np.testing.assert_allclose(smooth.u, truth, atol=1e-9)
    np.testing.assert_allclose(smooth.v, -truth / 2, atol=1e-9)
    assert smooth.gauge == 6 * 5 + 15


def test_wave_that_the_subset_flattens_is_given_back(grid):
    def wave(_, y):
        return 0.5 * np.cos(2 * np.pi * y / 40)

    measured = mean_over_subset(wave, grid)
    smooth = dic.smooth(field(measured, grid), 9, 4)
    middle, truth = np.abs(grid.xy[:, 1] - 75) < 40, wave(*grid.xy.T)
    kept = [u[middle] @ truth[middle] / np.sum(truth[middle] ** 2) for u in (measured, smooth.u)]
    assert kept[0] < 0.8  # the mean over 15 px alone
    assert 0.92 < kept[1] < 1.01  # measured 0.94


@pytest.mark.parametrize("order", [0, 1])
def test_sigma_is_that_of_noise_that_subsets_have_in_common(grid, order):
    import cv2

    rng, draws = np.random.default_rng(3), []
    for _ in range(60):
        mean = cv2.blur(rng.normal(0, 0.15, (150, 190)), (15, 15))
        disp = replace(field(mean[np.ix_(grid.ys, grid.xs)].ravel(), grid), order=order)
        draws.append(dic.smooth(disp, 7, 4))
    sampled = np.std([d.u for d in draws], axis=0)
    predicted = draws[0].sigma_u
    inner = np.all(np.abs(grid.xy - (95, 75)) < 50, axis=1)
    for some in (inner, ~inner):  # at the border polynomials know less
        ratio = np.sqrt(np.mean(predicted[some] ** 2) / np.mean(sampled[some] ** 2))
        assert ratio == pytest.approx(1, abs=0.06)
    assert predicted[~inner].max() > 1.2 * predicted[inner].max()


def test_points_that_were_lost_are_left_out(grid):
    u = 0.01 * grid.xy[:, 0]
    lost = np.hypot(*(grid.xy - (95, 75)).T) < 12
    spoilt = replace(
        field(np.where(lost, np.nan, u), grid),
        status=np.where(lost, Status.LOW_CORRELATION, Status.OK).astype(np.int8),
    )
    smooth = dic.smooth(spoilt, 7, 2)
    np.testing.assert_array_equal(smooth.valid, ~lost)
    np.testing.assert_allclose(smooth.u[~lost], u[~lost], atol=1e-9)
    assert np.isnan(smooth.sigma_v[lost]).all()


def test_window_that_cannot_hold_the_polynomial_has_no_value(grid):
    lonely = grid.xy[:, 1] == grid.ys[3]  # one row: nothing is known of y
    spoilt = replace(
        field(np.zeros(len(grid.xy)), grid),
        status=np.where(lonely, Status.OK, Status.FLAT).astype(np.int8),
    )
    assert not dic.smooth(spoilt, 3, 2).valid.any()


@pytest.mark.parametrize(
    ("window", "degree", "sentence"),
    [
        (8, 4, "must be odd, more than the degree 4 and at most the 28 points of the grid, got 8"),
        (3, 4, "more than the degree 4"),
        (31, 2, "got 31; use 7"),
        (9, 5, "degree of the polynomial must be 1, 2, 3 or 4, got 5; use 4"),
    ],
)
def test_smoothing_refuses(grid, window, degree, sentence):
    with pytest.raises(ValueError, match=sentence):
        dic.smooth(field(np.zeros(len(grid.xy)), grid), window, degree)


def test_smoothing_refuses_what_is_no_mean(grid):
    plain = field(np.zeros(len(grid.xy)), grid)
    for other, found in ((replace(plain, order=2), "order 2"), (replace(plain, grid=None), "scat")):
        with pytest.raises(ValueError, match=f"needs a grid of order 0 or 1, got {found}"):
            dic.smooth(other)
