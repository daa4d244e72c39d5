"""What cannot be measured says so, and spoils nothing beside it."""

import numpy as np

import dic
from dic import Status

SHIFT = (0.3, 0.6)
HOLE = np.s_[50:110, 60:130]


def deep_inside(xy, area=HOLE, half=10):
    """Points whose whole subset lies in the area."""
    rows, columns = area
    x, y = xy.T
    return (
        (x - half >= columns.start)
        & (x + half < columns.stop)
        & (y - half >= rows.start)
        & (y + half < rows.stop)
    )


def far_from(xy, area=HOLE, half=10):
    rows, columns = area
    x, y = xy.T
    return ~(
        (x + half >= columns.start)
        & (x - half < columns.stop)
        & (y + half >= rows.start)
        & (y - half < rows.stop)
    )


def assert_rest_is_measured(disp, noise=2.0):
    rest = far_from(disp.xy)
    assert disp.valid[rest].all()
    assert np.abs(disp.u[rest] - SHIFT[0]).max() <= 0.01 + 0.02 * noise


def test_lost_pattern_has_low_correlation(pattern, reference):
    frame, rest = pattern.draw(SHIFT), []
    for seed in range(4):
        frame[HOLE] = np.random.default_rng(seed).normal(128, 50, frame[HOLE].shape)
        disp = dic.correlate(dic.prepare(reference), frame)
        assert (disp.status[deep_inside(disp.xy)] == Status.LOW_CORRELATION).all()
        assert np.isnan(disp.u[~disp.valid]).all()
        assert np.isnan(disp.sigma_v[~disp.valid]).all()
        far = far_from(disp.xy)
        rest.append(disp.valid[far])
        assert np.nanmax(np.abs(disp.u[far] - SHIFT[0])) <= 0.05
    # The spline of the frame carries what is lost two or three pixels on.
    assert np.mean(rest) > 0.99


def test_blank_area_with_noise_is_flat(pattern, reference):
    rng, first, second = np.random.default_rng(2), reference.copy(), pattern.draw(SHIFT)
    first[HOLE], second[HOLE] = 128, 128
    noise = rng.normal(0, 1, (2, *first.shape))
    disp = dic.correlate(dic.prepare(first + noise[0]), second + noise[1])
    assert (disp.status[deep_inside(disp.xy)] == Status.FLAT).all()
    assert_rest_is_measured(disp)


def test_point_in_a_hole_is_flat_even_where_its_subset_reaches_over_the_rim(pattern, reference):
    first, second = reference.copy(), pattern.draw(SHIFT)
    first[HOLE], second[HOLE] = 20, 20
    disp = dic.correlate(dic.prepare(first, step=1), second)
    own_half_inside = deep_inside(disp.xy, half=5 + 3)  # the spline rings 3 px over the rim
    assert own_half_inside.sum() > deep_inside(disp.xy).sum()
    assert (disp.status[own_half_inside] == Status.FLAT).all()
    assert not (disp.status[far_from(disp.xy)] == Status.FLAT).any()


def test_stripes_are_flat_because_one_direction_is_blind(reference):
    stripes = np.broadcast_to(128 + 50 * np.sin(np.arange(190) / 2), (150, 190))
    ref = dic.prepare(stripes)
    assert (ref.status == Status.FLAT).all()
    disp = dic.correlate(ref, stripes)
    assert np.isnan(disp.u).all()


def test_black_and_white_areas_are_named(pattern, reference):
    for level, name in ((0, Status.DARK), (255, Status.SATURATED)):
        image = np.clip(reference / 2 + 64, 1, 254).astype(np.uint8)
        image[HOLE] = level
        ref = dic.prepare(image)
        assert (ref.status[deep_inside(ref.xy)] == name).all()
        assert (ref.status[far_from(ref.xy)] == Status.OK).all()


def test_roi_excludes_points_and_the_pixels_of_others(pattern, reference):
    roi = np.ones(reference.shape, dtype=bool)
    roi[HOLE] = False
    frame, first = pattern.draw(SHIFT), reference.copy()
    first[HOLE], frame[HOLE] = 7.0, 211.0  # would ruin every subset that read it
    disp = dic.correlate(dic.prepare(first, roi=roi), frame)
    x, y = disp.xy.astype(int).T
    assert (disp.status[~roi[y, x]] == Status.EXCLUDED).all()
    edge = roi[y, x] & ~far_from(disp.xy)
    assert disp.valid[edge].mean() > 0.5
    whole = far_from(disp.xy, half=10 + 3)  # the spline rings 3 px over the rim
    assert (disp.valid_fraction[whole] == 1).all()
    assert (disp.valid_fraction[~whole] < 1).all()
    assert (
        (disp.valid_fraction[edge & disp.valid] >= 0.3)
        & (disp.valid_fraction[edge & disp.valid] < 1)
    ).all()
    assert (disp.status[edge & ~disp.valid] == Status.EXCLUDED).all()
    assert_rest_is_measured(disp)
    clean = far_from(disp.xy, half=13)
    assert np.abs(disp.u[clean] - SHIFT[0]).max() <= 5e-3


def test_what_leaves_the_image_is_outside(pattern, reference):
    disp = dic.correlate(dic.prepare(reference), pattern.draw((20.0, 0.0)))
    leaves = disp.xy[:, 0] + 20 + 10 > reference.shape[1] - 0.5
    assert (disp.status[leaves] == Status.OUTSIDE).all()
    assert disp.valid[~leaves].all()
    assert np.abs(disp.u[~leaves] - 20).max() <= 0.01


def test_another_image_altogether_is_low_correlation(speckle, pattern, reference):
    disp = dic.correlate(dic.prepare(reference), speckle(reference.shape, seed=99).draw())
    assert disp.valid.mean() <= 0.01
    assert (disp.status == Status.LOW_CORRELATION).mean() >= 0.8


def test_blank_frame_is_low_correlation_without_a_warning(reference):
    disp = dic.correlate(dic.prepare(reference), np.full(reference.shape, 90.0))
    assert not disp.valid.any()
    assert (disp.status == Status.LOW_CORRELATION).all()
