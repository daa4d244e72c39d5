"""Full field: what `correlate` finds in images whose motion is known in closed form."""

import numpy as np
import pytest

import dic
from dic import Status

TILT = np.deg2rad(5)
MOTIONS = {
    "translation of 37 px": ((37.0, -21.3), ((0, 0), (0, 0))),
    "strain of 0.1 %": ((0.0, 0.0), ((1e-3, 0), (0, -3e-4))),
    "strain of 1 % with shear": ((0.2, 0.3), ((1e-2, 2e-3), (1e-3, -3e-3))),
    "strain of 5 %": ((1.0, 2.0), ((5e-2, 2e-2), (1e-2, -3e-2))),
    "rotation of 5 degrees": (
        (3.0, 2.0),
        ((np.cos(TILT) - 1, -np.sin(TILT)), (np.sin(TILT), np.cos(TILT) - 1)),
    ),
}


def error(disp, truth):
    """Deviation (2, n) px of the valid points."""
    return (np.column_stack([disp.u, disp.v]) - truth)[disp.valid].T


@pytest.mark.parametrize("order", [0, 1])
@pytest.mark.parametrize("shift", np.arange(11) / 10)
def test_rigid_shift_is_found_to_a_thousandth_of_a_px(pattern, reference, shift, order):
    ref = dic.prepare(reference, order=order)
    disp = dic.correlate(ref, pattern.draw((shift, shift / 2)))
    bias = error(disp, (shift, shift / 2)).mean(axis=1)
    assert np.abs(bias).max() <= 1e-3  # measured 0.0003
    assert disp.valid.mean() > 0.9


@pytest.mark.parametrize("motion", MOTIONS.values(), ids=MOTIONS.keys())
def test_affine_motion_is_found_from_nothing(pattern, reference, motion):
    ref = dic.prepare(reference)
    disp = dic.correlate(ref, pattern.draw(*motion))
    truth = pattern.displacement(ref.xy, *motion)
    leaves = disp.status == Status.OUTSIDE
    assert np.abs(error(disp, truth).mean(axis=1)).max() <= 1e-3
    assert error(disp, truth).std(axis=1).max() <= 2e-3
    assert disp.valid[~leaves].mean() >= 0.99


@pytest.mark.parametrize("shift", [-3.4, -0.2, 0.2, 3.4])
def test_outermost_points_are_as_true_as_the_others(pattern, reference, shift):
    disp = dic.correlate(dic.prepare(reference, step=1), pattern.draw((shift, shift / 2)))
    off = np.column_stack([disp.u, disp.v]) - (shift, shift / 2)
    middle = np.array(reference.shape[::-1]) / 2
    outermost = disp.valid & (np.abs(disp.xy - middle) >= middle - 12).any(axis=1)
    assert outermost.sum() > 300
    # A mirror without slope beyond the border makes 3 mpx of bias and 10 mpx of scatter.
    assert np.abs(off[outermost].mean(axis=0)).max() <= 0.5e-3  # measured 0.2 mpx
    assert off[outermost].std(axis=0).max() <= 1.5e-3  # measured 0.5 mpx


def test_subset_gradients_are_those_of_the_motion(pattern, reference):
    motion = MOTIONS["strain of 1 % with shear"]
    disp = dic.correlate(dic.prepare(reference), pattern.draw(*motion))
    found = disp.gradient[disp.valid]
    assert np.abs(found.mean(axis=0) - motion[1]).max() <= 1e-4
    assert disp.uy[disp.valid] == pytest.approx(found[:, 0, 1])


@pytest.mark.parametrize(("gain", "offset"), [(0.5, 50.0), (0.7, -50.0), (1.3, 20.0), (2.0, -50.0)])
def test_gain_and_offset_of_the_light_change_nothing(pattern, reference, gain, offset):
    ref, frame = dic.prepare(reference), pattern.draw((0.3, 0.6), ((0.01, 0), (0, 0)))
    plain, lit = dic.correlate(ref, frame), dic.correlate(ref, gain * frame + offset)
    np.testing.assert_allclose(lit.u, plain.u, atol=1e-5)
    np.testing.assert_allclose(lit.v, plain.v, atol=1e-5)
    np.testing.assert_allclose(lit.zncc, plain.zncc, atol=1e-6)
    np.testing.assert_allclose(lit.sigma_u, plain.sigma_u, rtol=0.06, atol=5e-5)


def test_light_that_varies_over_the_image_is_followed(pattern, reference):
    y, x = np.mgrid[: reference.shape[0], : reference.shape[1]]
    frame = (0.6 + 0.8 * x / x.max()) * pattern.draw((0.3, 0.6)) - 30 * y / y.max()
    disp = dic.correlate(dic.prepare(reference), frame)
    assert disp.valid.all()
    assert np.abs(error(disp, (0.3, 0.6)).mean(axis=1)).max() <= 2e-3
    # A gain that changes by 0.4 % a px is not constant in a subset; measured 0.043 px.
    assert error(disp, (0.3, 0.6)).std(axis=1).max() <= 0.06


def noisy_fields(pattern, reference, frame, count=10, **options):
    rng = np.random.default_rng(11)
    for _ in range(count):
        ref = dic.prepare(reference + rng.normal(0, 2, reference.shape), **options)
        yield dic.correlate(ref, frame + rng.normal(0, 2, frame.shape))


@pytest.mark.slow
@pytest.mark.parametrize("shift", [(0.0, 0.0), (0.5, 0.25)])
def test_noise_stands_on_the_floor_and_is_predicted(pattern, reference, shift):
    ref = dic.prepare(reference)
    hessian = np.linalg.inv(ref.inverse)[:, :6, :6]
    floor = np.sqrt(2 * 2.0**2 * np.linalg.inv(hessian)[:, 0, 0])  # motion alone, full Hessian
    fields = list(noisy_fields(pattern, reference, pattern.draw(shift), count=24))
    u = np.array([f.u for f in fields])
    known = np.isfinite(u).all(axis=0)
    scatter = np.sqrt(u[:, known].var(axis=0, ddof=1).mean())
    assert scatter <= 1.05 * np.sqrt(np.mean(floor[known] ** 2))  # measured 0.98 to 1.03
    predicted = np.sqrt(np.mean([f.sigma_u[known] ** 2 for f in fields]))
    assert predicted == pytest.approx(scatter, rel=0.06)
    assert abs(u[:, known].mean() - shift[0]) <= 1.5e-3


def test_floor_of_a_shift_is_that_of_sssig(reference):
    ref = dic.prepare(reference, order=0)
    hessian = np.linalg.inv(ref.inverse[:, [0, 3]][:, :, [0, 3]])
    texture = dic.sssig(reference, 21, ref.xy)
    # The light takes its part, so what is left of the diagonal lies below SSSIG.
    assert (hessian[:, 0, 0] <= texture[:, 0] * (1 + 1e-6)).all()
    assert np.median(hessian[:, 0, 0] / texture[:, 0]) > 0.9
    np.testing.assert_allclose(
        dic.noise_floor(2.0, texture), 2 * np.sqrt(2) / np.sqrt(texture), rtol=1e-12
    )


def test_guess_gives_the_same_field_in_fewer_iterations(pattern, reference):
    ref, frame = dic.prepare(reference), pattern.draw((6.4, -3.2), ((0.01, 0), (0, 0.02)))
    cold = dic.correlate(ref, frame)
    # The displacement alone spares the search, but the gradients must be found again.
    for guess, more in ((cold, 0.0), (np.column_stack([cold.u, cold.v]), 0.1)):
        warm = dic.correlate(ref, frame, guess=guess)
        both = warm.valid & cold.valid
        # A point iterated alone follows its own shape, one of a grid the dense motion.
        np.testing.assert_allclose(warm.u[both], cold.u[both], atol=0.01)
        assert warm.iterations[both].mean() < cold.iterations[both].mean() + more
        assert np.count_nonzero(warm.valid != cold.valid) <= 4  # that just touch the border


def test_points_that_were_wrong_are_rescued_by_their_neighbours(pattern, reference):
    ref = dic.prepare(reference)
    guess = np.tile([0.0, 0.0], (len(ref.xy), 1))
    guess[: len(guess) // 3] = (15.0, -9.0)
    disp = dic.correlate(ref, pattern.draw((0.4, 0.2)), guess=guess)
    assert disp.valid.all()
    assert np.abs(error(disp, (0.4, 0.2))).max() <= 0.01


def test_result_does_not_depend_on_type_or_memory_order(pattern, reference):
    grey = np.clip(np.rint(reference / 2 + 64), 0, 255)
    frame = np.clip(np.rint(pattern.draw((0.4, 0.7)) / 2 + 64), 0, 255)
    plain = dic.correlate(dic.prepare(grey), frame)
    for kind, scale in ((np.uint8, 1), (np.uint16, 16), (np.float32, 1)):
        first, second = (np.asfortranarray((i * scale).astype(kind)) for i in (grey, frame))
        disp = dic.correlate(dic.prepare(first), second)
        np.testing.assert_allclose(disp.u, plain.u, atol=1e-4)


def test_inputs_are_left_as_they_were(pattern, reference):
    frame = pattern.draw((0.4, 0.7))
    before = reference.copy(), frame.copy()
    dic.correlate(dic.prepare(reference), frame)
    np.testing.assert_array_equal(before[0], reference)
    np.testing.assert_array_equal(before[1], frame)


def test_guess_that_was_lost_altogether_is_searched_for_again(pattern, reference):
    ref = dic.prepare(reference)
    lost = dic.correlate(ref, np.full(reference.shape, 90.0))
    assert not lost.valid.any()
    disp = dic.correlate(ref, pattern.draw((9.3, -4.1)), guess=lost)
    assert np.abs(error(disp, (9.3, -4.1)).mean(axis=1)).max() <= 1e-3


@pytest.fixture(scope="module")
def to_the_border(reference):
    """Lay a grid whose outer subsets are cut by the image."""
    height, width = reference.shape
    return dic.Grid(np.arange(1, width, 7), np.arange(3, height, 7), 21, 7)


@pytest.mark.parametrize("order", [0, 1, 2])
def test_grid_to_the_border_agrees_with_points_one_by_one(pattern, reference, to_the_border, order):
    frame = pattern.draw((0.2, -0.1), ((1e-3, 0), (0, 2e-3)))
    full = dic.correlate(dic.prepare(reference, 21, 7, order, points=to_the_border), frame)
    alone = dic.correlate(dic.prepare(reference, 21, order=order, points=to_the_border.xy), frame)
    cut = full.valid_fraction < 1
    assert cut.mean() > 0.15
    np.testing.assert_allclose(full.valid_fraction, alone.valid_fraction)
    both = full.valid & alone.valid
    assert both[cut].mean() > 0.4
    assert np.count_nonzero(full.valid != alone.valid) <= 4  # that just touch the border
    np.testing.assert_allclose(full.u[both], alone.u[both], atol=5e-3)


@pytest.mark.slow
def test_sigma_of_cut_subsets_is_that_of_fewer_pixels(pattern, reference, to_the_border):
    fields = list(
        noisy_fields(
            pattern, reference, pattern.draw(), count=24, subset=21, step=7, points=to_the_border
        )
    )
    u, sigma = (np.array([getattr(f, k) for f in fields]) for k in ("u", "sigma_u"))
    cut = (fields[0].valid_fraction < 1) & np.isfinite(u).all(axis=0)
    assert cut.sum() > 100
    scatter = np.sqrt(u[:, cut].var(axis=0, ddof=1).mean())
    assert np.sqrt(np.mean(sigma[:, cut] ** 2)) == pytest.approx(scatter, rel=0.1)
    assert scatter > 1.5 * np.nanmedian(sigma[:, ~cut])
    assert abs(u[:, cut].mean()) < 2e-3
