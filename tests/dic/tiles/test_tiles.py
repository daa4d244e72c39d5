"""Tile sums: what numpy and an independent spline say, and the shift that they contain."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy import ndimage
from scipy.interpolate import BSpline, make_interp_spline
from scipy.special import erf

import dic
from dic.tiles.tiles import MARGIN

SIZE = 16
RAMP = np.add.outer(np.arange(40.0), np.arange(60.0))


@pytest.fixture(scope="module")
def prepared(reference):
    return dic.prepare_tiles(reference, SIZE)


@pytest.fixture(scope="module")
def frame(pattern):
    return np.rint(pattern.draw((0.3, -0.4), ((0.002, 0.001), (0.0, -0.003))))


def by_hand(reference, image, tiles, flow):
    """Sum fx·e, fy·e, e, e², e·f over every tile, (T, 5), by splines along y, then along x."""
    pad, sums = 30, []  # what lies farther off does not matter
    wide = np.pad(reference, pad, mode="reflect")
    along_y, along_x = (make_interp_spline(np.arange(n) - pad, np.eye(n), 7) for n in wide.shape)
    coefficients = along_y.c @ wide @ along_x.c.T
    side = np.arange(tiles.size) - (tiles.size - 1) / 2
    for (x, y), d in zip(tiles.xy, flow, strict=True):
        columns, rows = x + side, y + side

        def spline(dx, dy, at=(columns - d[0], rows - d[1])):
            down = BSpline(along_y.t, coefficients, 7)(at[1], dy)
            return BSpline(along_x.t, down, 7, axis=1)(at[0], dx)

        f, fx, fy = spline(0, 0), spline(1, 0), spline(0, 1)
        e = image[np.ix_(rows.astype(int), columns.astype(int))] - f
        sums.append([(part * e).sum() for part in (fx, fy, np.ones_like(f), e, f)])
    return np.array(sums)


def as_columns(sums):
    return np.column_stack([sums.gradient, sums.e, sums.ee, sums.ef])


def assert_same_sums(found, expected, atol=1e-4):
    """Images are held in single precision: compare with the largest sum of each kind."""
    np.testing.assert_allclose(
        found / np.abs(expected).max(axis=0), expected / np.abs(expected).max(axis=0), atol=atol
    )


def best_shift(prepared, sums):
    """Shift of the whole image that the sums imply, (2,) px."""
    xx, xy, yy = prepared.hessian.sum(axis=0)
    return sums.flow[0] - np.linalg.solve([[xx, xy], [xy, yy]], sums.gradient.sum(axis=0))


def test_tiles_lie_side_by_side_within_the_margin():
    tiles = dic.lay_tiles((70, 101), 8)
    assert tiles.shape == (6, 10)
    np.testing.assert_allclose(np.diff(tiles.xs), 8)
    np.testing.assert_allclose(np.diff(tiles.ys), 8)
    low, high = tiles.xy.min(axis=0) - 3.5, tiles.xy.max(axis=0) + 3.5
    assert (low >= MARGIN).all()
    assert (high <= np.array([101, 70]) - 1 - MARGIN).all()
    np.testing.assert_array_equal(tiles.xy[1] - tiles.xy[0], [8, 0])  # row by row


def test_sums_of_an_image_are_those_of_numpy(reference):
    tiles = dic.lay_tiles(reference.shape, SIZE)
    sums = tiles.sums(reference)
    for index in (0, 7, len(sums) - 1):
        x, y = (tiles.xy[index] - (SIZE - 1) / 2).astype(int)
        assert sums[index] == pytest.approx(reference[y : y + SIZE, x : x + SIZE].sum())


def test_hessian_and_light_are_sums_of_the_gradient(prepared, reference):
    zero = np.zeros((len(prepared.hessian), 2))
    black = by_hand(reference, np.zeros_like(reference), prepared.tiles, zero)  # e is -f
    light = prepared.light
    assert_same_sums(light[:, [0, 1, 5, 4, 4]], black * [-1, -1, -1, 1, -1])
    fx, fy = prepared.gradient.astype(float)
    for column, product in enumerate((fx * fx, fx * fy, fy * fy)):
        np.testing.assert_allclose(prepared.hessian[:, column], prepared.tiles.sums(product), 1e-4)


def test_sums_in_place_are_those_of_numpy(prepared, reference, frame):
    zero = np.zeros((len(prepared.hessian), 2))
    found = as_columns(dic.tile_sums(prepared, frame))
    assert_same_sums(found, by_hand(reference, frame, prepared.tiles, zero))


@settings(max_examples=10)
@given(st.floats(-5, 5), st.floats(-5, 5), st.integers(0, 99))
def test_moved_sums_are_those_of_numpy(prepared, reference, frame, u, v, seed):
    # Five pixels keep the spline of a border tile within the image.
    spread = np.random.default_rng(seed).uniform(-1, 1, (len(prepared.hessian), 2))
    flow = np.clip(np.array([u, v]) + spread, -5, 5)
    found = as_columns(dic.tile_sums(prepared, frame, flow))
    assert_same_sums(found, by_hand(reference, frame, prepared.tiles, flow))


def test_in_place_and_moved_agree_at_zero_flow(prepared, frame):
    still = dic.tile_sums(prepared, frame)
    moved = dic.tile_sums(prepared, frame, np.zeros((len(prepared.hessian), 2)))
    assert_same_sums(as_columns(moved), as_columns(still), 1e-5)


@pytest.mark.parametrize("kind", [np.uint8, np.uint16, np.float32, np.float64])
def test_the_type_of_a_pixel_does_not_matter(prepared, frame, kind):
    frame = frame.clip(0, 255)
    flow = np.full((len(prepared.hessian), 2), 0.3)
    for given_flow in (None, flow):
        found = as_columns(dic.tile_sums(prepared, frame.astype(kind), given_flow))
        assert_same_sums(found, as_columns(dic.tile_sums(prepared, frame, given_flow)), 1e-6)


@pytest.mark.parametrize("shift", [(0.25, -0.5), (-0.37, 0.11), (2.62, 3.4), (-4.5, 1.75)])
def test_a_shift_below_a_pixel_is_recovered(prepared, pattern, shift):
    frame = pattern.draw(shift)
    flow = np.round(shift)
    for _ in range(2):
        moved = np.tile(flow, (len(prepared.hessian), 1))
        flow = best_shift(prepared, dic.tile_sums(prepared, frame, moved))
    np.testing.assert_allclose(flow, shift, atol=1e-3)  # px; measured 2e-4


@given(
    st.lists(st.floats(-0.02, 0.02), min_size=4, max_size=4),
    st.floats(-1.0, 1.0),
    st.floats(-1.0, 1.0),
)
@settings(max_examples=8)
def test_motion_that_varies_over_a_tile_is_read_where_the_tile_is(prepared, pattern, a, u, v):
    gradient, tiles = np.reshape(a, (2, 2)), prepared.tiles
    image = pattern.draw((u, v), gradient)
    # A pixel x sees the point that came from x - d: (1 + G) d = s + G (x - middle).
    undone = np.linalg.inv(np.eye(2) + gradient)
    flow = ((u, v) + (tiles.xy - pattern.middle) @ gradient.T) @ undone.T
    flow_gradient = np.tile(undone @ gradient, (len(flow), 1, 1))
    as_whole = left_over(prepared, dic.tile_sums(prepared, image, flow))
    deformed = left_over(prepared, dic.tile_sums(prepared, image, flow, flow_gradient))
    assert rms(deformed) < 0.15 * rms(as_whole) + 5e-4
    assert abs(deformed.mean()) < 2e-4


def left_over(prepared, sums):
    """Motion of each tile beside its flow, (T, 2) px."""
    xx, xy, yy = sums.hessian.T
    gradient = dic.unbiased_gradient(prepared, sums)
    matrices = np.stack([np.stack([xx, xy], 1), np.stack([xy, yy], 1)], 1)
    return -np.linalg.solve(matrices, gradient[..., None])[..., 0]


def rms(values):
    return float(np.sqrt(np.mean(np.square(values))))


def test_flows_far_out_of_the_image_do_no_harm(prepared, frame):
    width = frame.shape[1]
    for u, v in [(width - 1, 0), (-width + 1, 40), (0, width - 1), (-30, -width + 1)]:
        sums = dic.tile_sums(prepared, frame, np.full((len(prepared.hessian), 2), (u, v), float))
        assert np.isfinite(as_columns(sums)).all()


@pytest.mark.parametrize("flow", [(-31.3, 4.6), (28.2, -33.7)])
def test_beyond_the_border_the_nearest_coefficient_stands(prepared, frame, flow):
    pad, count = 60, len(prepared.hessian)
    tiles, flows = prepared.tiles, np.full((count, 2), flow)
    wide = replace(
        prepared,
        tiles=replace(tiles, origin=(tiles.origin[0] + pad, tiles.origin[1] + pad)),
        image=np.pad(prepared.image, pad),
        coefficients=np.pad(prepared.coefficients, pad, mode="edge"),
    )
    there = dic.tile_sums(wide, np.pad(frame, pad), flows)
    here = dic.tile_sums(prepared, frame, flows)
    np.testing.assert_array_equal(as_columns(here), as_columns(there))
    np.testing.assert_array_equal(here.light, there.light)


def test_light_of_a_moved_reference_is_that_of_numpy(prepared, reference):
    flow = np.random.default_rng(1).uniform(-3, 3, (len(prepared.hessian), 2))
    black = np.zeros_like(reference)
    by_spline = by_hand(reference, black, prepared.tiles, flow)  # e is -f
    found = dic.tile_sums(prepared, black, flow).light
    assert_same_sums(found[:, [0, 1, 5, 4, 4]], by_spline * [-1, -1, -1, 1, -1])
    slopes = by_hand(reference, black, prepared.tiles, flow) - by_hand(
        reference, black - 1, prepared.tiles, flow
    )
    assert_same_sums(found[:, [2, 3]], slopes[:, :2])


def test_sums_keep_the_flow_they_were_taken_at(prepared, frame):
    flow = np.random.default_rng(1).normal(0, 1, (len(prepared.hessian), 2))
    np.testing.assert_array_equal(dic.tile_sums(prepared, frame, flow).flow, flow)
    assert not dic.tile_sums(prepared, frame).flow.any()


def refused(sentence, call, *args):
    with pytest.raises(ValueError, match=sentence) as refusal:
        call(*args)
    assert "\n" not in str(refusal.value)


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (lambda g: g[:-1], r"^reference is 190x150 px, deformed is 190x149 px"),
        (lambda g: np.dstack([g, g, g]), "^deformed image has 3 channels; convert it to grey"),
        (lambda g: np.where(g == g.max(), np.nan, g), "^deformed image holds 1 pixels that"),
        (lambda g: np.where(g == g.max(), np.inf, g), "^deformed image holds 1 pixels that"),
    ],
)
def test_bad_images_are_refused_in_one_sentence(prepared, frame, change, sentence):
    refused(sentence, dic.tile_sums, prepared, change(frame))


@pytest.mark.parametrize(
    ("flow", "sentence"),
    [
        (np.zeros((3, 2)), r"^flow must be \(80, 2\) px.* got shape \(3, 2\)"),
        (np.full((80, 2), np.nan), "motions up to nan px"),
        (np.full((80, 2), -500.0), "motions up to 500 px"),
    ],
)
def test_bad_flows_are_refused_in_one_sentence(prepared, frame, flow, sentence):
    refused(sentence, dic.tile_sums, prepared, frame, flow)


@pytest.mark.parametrize(
    ("flow", "flow_gradient", "sentence"),
    [
        (None, np.zeros((80, 2, 2)), "^flow_gradient needs the flow"),
        (np.zeros((80, 2)), np.zeros((80, 4)), r"^flow_gradient must be \(80, 2, 2\).* got shape"),
        (np.zeros((80, 2)), np.full((80, 2, 2), np.nan), "derivatives up to nan"),
    ],
)
def test_bad_derivatives_are_refused_in_one_sentence(
    prepared, frame, flow, flow_gradient, sentence
):
    refused(sentence, dic.tile_sums, prepared, frame, flow, flow_gradient)


@pytest.mark.parametrize(
    ("image", "size", "sentence"),
    [
        (RAMP, 3, "^tile size must be 4 px or more .* got 3 px on 60x40 px"),
        (RAMP, 32, "got 32 px on 60x40 px"),
        (RAMP[0], 8, r"^reference image must be \(H, W\)"),
        (np.ones((40, 60)), 8, "^reference image is blank"),
        (RAMP * np.nan, 8, "^reference image holds 2400 pixels that are not finite"),
    ],
)
def test_bad_references_are_refused_in_one_sentence(image, size, sentence):
    refused(sentence, dic.prepare_tiles, image, size)


@pytest.mark.parametrize("width", [0.75, 0.9])
@pytest.mark.parametrize("shift", [(0.25, 0.0), (0.6, 0.3), (0.1, -0.4)])
def test_interpolation_does_not_bias_a_shift(shift, width):
    """Spots drawn exactly where they are: not by the Fourier series that is tested."""
    prepared, biased, left = biases(shift, width)
    assert (prepared.bias > 0).all()
    assert np.abs(biased).max() > 2e-4
    assert np.abs(left).max() < 0.5 * np.abs(biased).max()


def test_a_pattern_that_aliasing_hides_is_left_alone():
    prepared, biased, left = biases((0.25, 0.25), 0.5)
    assert (prepared.bias == 0).all()
    assert (biased < 0).all()
    np.testing.assert_array_equal(biased, left)


@pytest.mark.parametrize("sigma", [0.0, 0.5])
@pytest.mark.parametrize("shift", [(0.25, 0.25), (0.7, -0.2)])
def test_noise_of_the_reference_does_not_bias_a_shift(shift, sigma):
    """Noise of 1 where the spots have a slope of 3 to 5 a pixel; frames without noise."""
    biased, left = np.zeros(2), np.zeros(2)
    for seed in range(8):
        prepared, without, corrected = biases(shift, 0.9, (1.0, seed), sigma)
        assert (prepared.bias > 1e-3).all()
        biased, left = biased + without / 8, left + corrected / 8
    assert np.abs(biased).max() > 4e-3
    assert np.abs(left).max() < 0.15 * np.abs(biased).max()


def test_a_reference_of_unknown_noise_counts_as_one_without():
    rng, image = np.random.default_rng(2), spots(np.empty((0, 2)), 0.9)
    image = image + 20.0 * ndimage.gaussian_filter(rng.standard_normal(image.shape), 1.5)
    unknown, none = dic.prepare_tiles(image, SIZE), dic.prepare_tiles(image, SIZE, noise=0.0)
    noisy = dic.prepare_tiles(image, SIZE, noise=1.0)
    np.testing.assert_allclose(unknown.bias, none.bias, rtol=0.1)
    assert (noisy.bias > none.bias).all()


def test_a_noise_of_the_reference_that_is_none_is_refused():
    refused("^noise must be", dic.prepare_tiles, RAMP, 8, 0.0, -1.0)


def biases(shift, width, noise=(0.0, 0), sigma=0.0):
    """Give a reference, and the bias of a shift of its tiles as it is and as it is corrected."""
    dots = np.random.default_rng(3).uniform((0, 0), (200, 150), (3000, 2))
    still, moved = (spots(dots + offset, width) for offset in ((0.0, 0.0), shift))
    own = noise[0] * np.random.default_rng(noise[1]).standard_normal(still.shape)
    prepared = dic.prepare_tiles(still + own, SIZE, sigma, noise[0] or None)
    sums = dic.tile_sums(prepared, moved, np.tile(shift, (len(prepared.hessian), 1)))
    corrected = replace(sums, gradient=dic.unbiased_gradient(prepared, sums))
    return prepared, *(best_shift(prepared, each) - shift for each in (sums, corrected))


def spots(places, width):
    """Light of Gaussian spots on pixels, which integrate it, (150, 200)."""

    def along(count, at):
        edges = np.arange(count + 1.0)[None] - 0.5 - at[:, None]
        return 0.5 * np.diff(erf(edges / (width * np.sqrt(2.0))), axis=1)

    return 40.0 + 50.0 * along(150, places[:, 1]).T @ along(200, places[:, 0])


@pytest.mark.parametrize("blur", [0.0, 12.0])
def test_aliasing_of_a_print_is_predicted(blur):
    """Blots of 2 px, drawn on a grid of an eighth of a px and moved there: no interpolation."""
    fine = ndimage.gaussian_filter(np.random.default_rng(4).normal(size=(8 * 200, 8 * 240)), 7.0)
    ink = ndimage.gaussian_filter(np.where(fine > 0, 220.0, 40.0), max(blur, 1e-3))
    rest, moved = (
        np.roll(ink, 3 * k, axis=1).reshape(200, 8, 240, 8).mean(axis=(1, 3)) for k in (0, 1)
    )
    reference = dic.prepare_tiles(rest, 16)
    sums = dic.tile_sums(reference, moved, np.tile((0.375, 0.0), (len(reference.hessian), 1)))
    off = sums.gradient[:, 0] / reference.hessian[:, 0]
    found = float(np.std(off[np.abs(off - np.median(off)) < 0.2]))
    if blur:
        assert reference.aliasing < 2e-3
        assert found < 2e-3
    else:
        assert reference.aliasing / 2.5 < found < 2.5 * reference.aliasing
        assert reference.aliasing > 4e-3
