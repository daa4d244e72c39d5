"""Scattered points: the same measurement where it is asked for."""

import tracemalloc

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy import ndimage

import dic
from dic import Status


@pytest.mark.parametrize("order", [0, 1])
def test_scattered_points_agree_with_the_truth(pattern, reference, order):
    rng = np.random.default_rng(5)
    xy = rng.uniform((20, 20), (170, 130), (60, 2))
    motion = (2.3, -4.6), ((2e-3, 1e-3), (0, -1e-3))
    disp = dic.correlate(dic.prepare(reference, points=xy, order=order), pattern.draw(*motion))
    deviation = np.column_stack([disp.u, disp.v]) - pattern.displacement(xy, *motion)
    assert disp.valid.all()
    assert disp.grid is None
    # A shift cannot follow the strain inside its subset.
    assert np.abs(deviation.mean(axis=0)).max() <= (1e-3 if order == 1 else 3e-3)
    assert deviation.std(axis=0).max() <= (2e-3 if order == 1 else 2e-2)


def test_points_on_the_grid_give_what_the_grid_gives(pattern, reference):
    frame = pattern.draw((0.4, 0.7), ((0.01, 0), (0.005, -0.01)))
    full = dic.correlate(dic.prepare(reference, step=7), frame)
    some = np.flatnonzero(full.valid)[::5]
    sparse = dic.correlate(dic.prepare(reference, points=full.xy[some]), frame)
    np.testing.assert_allclose(sparse.u, full.u[some], atol=2e-3)
    rougher = full.sigma_v[some] / sparse.sigma_v
    np.testing.assert_allclose(rougher, np.median(rougher), rtol=0.4)
    np.testing.assert_allclose(sparse.zncc, full.zncc[some], atol=1e-3)


@settings(max_examples=20)
@given(st.floats(-0.49, 0.49), st.floats(-0.49, 0.49))
def test_displacement_is_that_of_the_point_and_not_of_its_pixel(dx, dy):
    y, x = np.mgrid[:80, :100]
    image = 100 + 40 * np.sin(x / 1.9) * np.cos(y / 2.3) + 20 * np.sin((x + 2 * y) / 3.1)
    place = np.array([[50 + dx, 41 + dy]])
    u = 0.02 * (place[0, 0] - 50)
    inside = (x - 50) / 1.02 + 50
    frame = 100 + 40 * np.sin(inside / 1.9) * np.cos(y / 2.3) + 20 * np.sin((inside + 2 * y) / 3.1)
    disp = dic.correlate(dic.prepare(image, points=place), frame, guess=np.zeros((1, 2)))
    assert disp.u[0] == pytest.approx(u, abs=3e-3)


# Few points are filtered on their own, with what lies beyond 17 px left out; a subset that bends as
# its shape function cannot, here that of order 0, shows it.
@pytest.mark.parametrize("order", [0, 1, 2])
def test_point_does_not_feel_which_others_are_measured_with_it(pattern, reference, order):
    rng, frame = np.random.default_rng(8), pattern.draw((0.3, -0.2), ((4e-3, 0), (2e-3, 0)))
    xy = rng.uniform((20, 20), (170, 130), (12, 2))
    guess = np.zeros_like(xy)
    every = dic.correlate(dic.prepare(reference, points=xy, order=order), frame, guess)
    for n in range(len(xy)):
        alone = dic.prepare(reference, points=xy[n : n + 1], order=order)
        assert dic.correlate(alone, frame, guess[:1]).u[0] == pytest.approx(every.u[n], abs=1e-6)


@pytest.mark.parametrize(("subset", "order"), [(7, 1), (15, 0), (13, 2)])
def test_sigma_of_a_point_is_what_sampling_finds(pattern, reference, subset, order):
    rng, noise = np.random.default_rng(4), 0.5
    x, y = np.meshgrid(np.arange(14, 180, 14), np.arange(14, 140, 14))
    xy = np.column_stack([x.ravel(), y.ravel()]).astype(float)
    frame, guess, ratios = pattern.draw((0.3, 0.2)), np.tile([0.3, 0.2], (len(xy), 1)), []
    for _ in range(10):
        first, second = (i + rng.normal(0, noise, i.shape) for i in (reference, frame))
        disp = dic.correlate(dic.prepare(first, subset, points=xy, order=order), second, guess)
        ratios += [(disp.u - 0.3) / disp.sigma_u, (disp.v - 0.2) / disp.sigma_v]
    known = np.isfinite(ratios)
    assert known.mean() > 0.95
    # Without √2 it is 1.41, with too few freedoms at 7 px 1.09.
    assert np.sqrt(np.mean(np.array(ratios)[known] ** 2)) == pytest.approx(1, abs=0.05)


def test_lone_point_is_enough(pattern, reference):
    disp = dic.correlate(dic.prepare(reference, points=[[90.0, 70.0]]), pattern.draw((12.0, -7.5)))
    assert (disp.u[0], disp.v[0]) == pytest.approx((12.0, -7.5), abs=3e-3)


def test_point_at_the_border_is_measured_with_what_is_left_of_its_subset(pattern, reference):
    xy = np.array([[4.0, 70.0], [90.0, 70.0], [0.0, 70.0], [0.0, 0.0]])
    ref = dic.prepare(reference, points=xy)
    disp = dic.correlate(ref, pattern.draw((0.5, 0.2)))
    assert list(disp.status) == [Status.OK, Status.OK, Status.OK, Status.OUTSIDE]
    np.testing.assert_allclose(disp.valid_fraction, np.array([15, 21, 11, 121 / 21]) / 21)
    np.testing.assert_allclose(disp.u[:3], 0.5, atol=0.01)
    away = dic.correlate(ref, pattern.draw((-0.5, 0.2)))  # what is left leaves the image
    assert list(away.status) == [Status.OUTSIDE, Status.OK, Status.OUTSIDE, Status.OUTSIDE]


def test_a_tracked_frame_takes_memory_for_numbers_of_points_and_no_images():
    """A subset of 31 px has 961 pixels; a point gets less memory than a byte for each of them."""
    rng = np.random.default_rng(3)
    image = rng.integers(0, 255, (700, 800), dtype=np.uint8)
    image = np.kron(image[::4, ::4], np.ones((4, 4), np.uint8))
    ref = dic.prepare(image, 31, points=rng.uniform((30, 30), (770, 670), (72, 2)))
    last = dic.correlate(ref, image, guess=np.zeros((72, 2)))
    dic.correlate(ref, image, guess=last)
    tracemalloc.start()
    try:
        dic.correlate(ref, image, guess=last)
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert peak < 72 * 500  # measured 300 a point, 140 of them the result


def test_noise_that_is_not_white_is_seen_where_few_points_are_left(pattern):
    """The points looked at beforehand lie in what is hidden: others are asked."""
    rng = np.random.default_rng(15)
    shape = (150, 190)

    def grainy():
        return 9.0 * ndimage.gaussian_filter(rng.normal(size=shape), 1.2)

    reference, frame = pattern.draw() + grainy(), pattern.draw((0.3, -0.2)) + grainy()
    frame[:, :150] = rng.uniform(0, 255, (150, 150))
    xy = rng.uniform((16, 16), (174, 134), (432, 2))
    found = dic.correlate(dic.prepare(reference, points=xy, prefilter=0), frame, np.zeros_like(xy))
    assert 12 < np.count_nonzero(found.valid) < 108
    off = np.column_stack([found.u - 0.3, found.v + 0.2])[found.valid]
    sigma = np.column_stack([found.sigma_u, found.sigma_v])[found.valid]
    assert np.sqrt(np.mean(np.square(off / sigma))) < 1.6
