"""The solver finds what was pressed, says how sure it is, and does not guess."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.stats import chi2

import fe
import models
from models import Result
from models.inverse.solver import find

PLATE = fe.Plate((150.0, 100.0), 1.0, 3000.0, 0.38)
X, Y = np.linspace(7.5, 142.5, 18), np.linspace(7.5, 92.5, 12)
RING = np.vstack(
    [[(x, y) for x in X for y in (5.0, 95.0)], [(x, y) for x in (5.0, 145.0) for y in Y]]
)
INFLUENCE = fe.influence(PLATE, RING, fe.Mesh(PLATE.size, (30, 20)))
SIGMA = 1e-7  # strain; a touch of 1 N gives 4e-5
FORWARD = models.gauge_forward(INFLUENCE, SIGMA)
SEARCH = models.prepare_candidates(FORWARD)


def draw(rng, count, apart=30.0):
    """Touches (n, 3) in canonical order, `apart` mm or more from one another."""
    while True:
        touches = np.column_stack(
            [rng.uniform((15, 15), (135, 85), (count, 2)), rng.uniform(1, 5, count)]
        )
        touches = touches[np.lexsort((touches[:, 1], touches[:, 0]))]
        distance = np.linalg.norm(touches[:, None, :2] - touches[None, :, :2], axis=2)
        if count < 2 or distance[np.triu_indices(count, 1)].min() > apart:
            return touches


def strain(touches):
    touches = np.asarray(touches, dtype=float).reshape(-1, 3)
    return np.einsum("n,nmc->mc", touches[:, 2], INFLUENCE.strain(touches[:, :2]))


def found(estimate):
    return np.column_stack([estimate.xy, estimate.force])


@pytest.mark.parametrize("count", [1, 2, 3, 4])
@pytest.mark.parametrize("known", [True, False])
def test_touches_without_noise_are_found_exactly(count, known):
    rng = np.random.default_rng(count)
    for _ in range(8):
        touches = draw(rng, count)
        estimate = models.solve(strain(touches), INFLUENCE, SIGMA, count if known else None)
        assert estimate.result is Result.FOUND
        np.testing.assert_allclose(found(estimate), touches, atol=1e-6)  # mm and N


@pytest.mark.slow
@pytest.mark.parametrize("count", [2, 3, 4])
def test_greed_does_not_end_beside_the_best_fit(count):
    rng, missed = np.random.default_rng(20 + count), 0
    for _ in range(100):
        touches = draw(rng, count, apart=25.0)
        estimate = find(FORWARD.whiten(strain(touches)), SEARCH, count=count)
        missed += np.abs(found(estimate) - touches).max() > 1e-6
    assert missed <= 1  # greed alone misses 2 to 8


def test_nothing_is_found_where_nothing_presses():
    rng = np.random.default_rng(4)
    for _ in range(50):
        estimate = find(rng.standard_normal(len(RING) * 3), SEARCH)
        assert (estimate.count, estimate.result) == (0, Result.NO_TOUCH)
    assert estimate.xy.shape == (0, 2)
    assert estimate.covariance.shape == (0, 0)


def test_a_pull_is_no_touch_but_not_explained_either():
    estimate = models.solve(strain([(40.0, 60.0, -1.0)]), INFLUENCE, SIGMA)
    assert estimate.p_value < 1e-6


@pytest.mark.parametrize("count", [1, 2, 3])
def test_the_count_is_found_under_noise(count):
    rng = np.random.default_rng(30 + count)
    right = 0
    for _ in range(30):
        touches = draw(rng, count)
        measured = strain(touches) + rng.normal(0, SIGMA, (len(RING), 3))
        estimate = find(FORWARD.whiten(measured), SEARCH)
        right += estimate.count == count
    assert right >= 29


def test_the_end_of_a_narrow_valley_is_reached():
    # Four in a row; the descent once stopped half way, 60 above the least χ² in 2 of 1000 scenes.
    forward = models.gauge_forward(INFLUENCE, 0.02 * SIGMA)
    search = models.prepare_candidates(forward)
    rng = np.random.default_rng(14)
    for _ in range(12):
        touches = np.array([(52.0, 44.0, 4.0), (58.0, 50.0, 3.0), (64.0, 56.0, 4.0), (76, 62, 5)])
        touches[:, :2] += rng.uniform(-2, 2, (4, 2))
        measured = forward.read(touches)[0] + rng.normal(size=3 * len(RING))
        estimate = find(measured, search, count=4)
        assert estimate.chi2 <= ((measured - forward.read(touches)[0]) ** 2).sum()


def test_a_fit_that_did_not_converge_says_so():
    class Slow:
        """The same measurement as by a theory that is not compiled."""

        plate, freedom, model_error = PLATE, FORWARD.freedom, 0.0
        read = staticmethod(FORWARD.read)
        own_error = staticmethod(FORWARD.own_error)
        response = staticmethod(FORWARD.response)

    measured, start = FORWARD.whiten(strain([(60.0, 40.0, 2.0)])), [(55.0, 44.0, 1.5)]
    search = models.with_forward(SEARCH, Slow())
    assert find(measured, search, start=start).result is Result.FOUND
    for candidates in (search, SEARCH):
        stopped = models.LevenbergMarquardt(max_steps=1)
        estimate = find(measured, candidates, start=start, solver=stopped)
        assert (estimate.result, estimate.stats.converged) == (Result.UNRESOLVABLE, False)


def test_p_value_is_even_where_model_and_noise_are_right():
    rng, values = np.random.default_rng(8), []
    truth = strain([(52.0, 33.0, 2.0)])
    for _ in range(200):
        measured = truth + rng.normal(0, SIGMA, truth.shape)
        values.append(find(FORWARD.whiten(measured), SEARCH).p_value)
    counts = np.histogram(values, 5, (0, 1))[0]
    assert chi2.sf(((counts - 40) ** 2 / 40).sum(), 4) > 1e-3


@pytest.mark.slow
@pytest.mark.parametrize("count", [1, 2])
def test_scatter_is_the_covariance_that_is_stated(count):
    rng = np.random.default_rng(50 + count)
    touches = draw(rng, count)
    truth, deviations, squares = strain(touches), [], []
    for _ in range(400):
        measured = truth + rng.normal(0, SIGMA, truth.shape)
        estimate = find(FORWARD.whiten(measured), SEARCH)
        error = (found(estimate) - touches).ravel()
        deviations.append(error / np.sqrt(np.diag(estimate.covariance)))
        squares.append(error @ np.linalg.solve(estimate.covariance, error))
    deviations = np.array(deviations)
    assert np.sqrt((deviations**2).mean()) == pytest.approx(1.0, abs=0.05)
    assert np.abs(deviations.mean(axis=0)).max() < 0.2  # bias, 4 standard errors
    for sigmas, fraction in ((1, 0.683), (2, 0.954)):
        assert (np.abs(deviations) < sigmas).mean() == pytest.approx(fraction, abs=0.03)
    assert np.mean(squares) == pytest.approx(3 * count, rel=0.1)


def test_covariance_is_the_inverse_fisher_matrix_in_the_order_of_the_touches():
    touches = np.array([[40.0, 70.0, 2.0], [100.0, 30.0, 1.0]])
    estimate = models.solve(strain(touches), INFLUENCE, SIGMA)
    columns = []
    for n in range(2):
        for k in range(3):
            step = np.zeros((2, 3))
            step[n, k] = 1e-4
            columns.append((strain(touches + step) - strain(touches - step)).ravel() / 2e-4)
    jacobian = np.array(columns).T / SIGMA
    truth = np.linalg.inv(jacobian.T @ jacobian)
    np.testing.assert_allclose(estimate.covariance, truth, rtol=1e-4, atol=1e-6 * truth.max())
    np.testing.assert_array_equal(estimate.touch_covariance(1), estimate.covariance[3:, 3:])


@settings(max_examples=20)
@given(st.permutations([0, 1, 2]), st.integers(0, 10**6), st.floats(-6, 6), st.floats(-6, 6))
def test_order_and_translation_of_the_start_do_not_matter(order, seed, dx, dy):
    touches = np.array([[30.0, 40.0, 2.0], [75.0, 70.0, 1.0], [115.0, 35.0, 3.0]])
    noise = np.random.default_rng(seed).normal(0, SIGMA, (len(RING), 3))
    measured = FORWARD.whiten(strain(touches) + noise)
    afresh = find(measured, SEARCH)
    followed = find(measured, SEARCH, start=touches[order] + [dx, dy, 0.0])
    np.testing.assert_allclose(found(followed), found(afresh), atol=1e-3)
    assert followed.result is afresh.result is Result.FOUND


@pytest.mark.parametrize("start", [[(-50.0, 500.0, 1.0)], [(60.0, 50.0, 0.0)], [(9, 9, 1)] * 4])
def test_a_useless_start_does_no_harm(start):
    touches = [(60.0, 40.0, 2.0)]
    estimate = find(FORWARD.whiten(strain(touches)), SEARCH, start=start)
    np.testing.assert_allclose(found(estimate), touches, atol=1e-6)


def test_a_finger_that_lifts_and_one_that_jumps_are_followed_within_the_frame():
    before = [(40.0, 60.0, 2.0), (100.0, 40.0, 1.0)]
    for now in ([before[0]], [before[1]], [before[0], (120.0, 80.0, 1.5)], []):
        noise = np.random.default_rng(3).normal(0, SIGMA, (len(RING), 3))
        estimate = find(FORWARD.whiten(strain(now) + noise), SEARCH, start=before)
        assert estimate.count == len(now)
        np.testing.assert_allclose(found(estimate), np.array(now).reshape(-1, 3), atol=1.0)


def test_missing_channels_are_left_out():
    touches = [(60.0, 40.0, 2.0)]
    rng = np.random.default_rng(6)
    measured = strain(touches) + rng.normal(0, SIGMA, (len(RING), 3))
    measured[rng.random(measured.shape) < 0.2] = np.nan
    measured[:10] = np.inf
    estimate = models.solve(measured, INFLUENCE, SIGMA)
    error = (found(estimate) - touches)[0]
    assert (np.abs(error) < 4 * np.sqrt(np.diag(estimate.covariance))).all()
    assert estimate.dof == np.isfinite(measured).sum() - 3
    assert 1e-3 < estimate.p_value < 0.999


def test_a_missing_side_is_seen_in_the_covariance():
    touches = [(120.0, 40.0, 2.0)]
    measured = strain(touches)
    whole = models.solve(measured, INFLUENCE, SIGMA)
    measured[RING[:, 0] > 130] = np.nan
    part = models.solve(measured, INFLUENCE, SIGMA)
    np.testing.assert_allclose(found(part), touches, atol=1e-5)
    assert (np.diag(part.covariance) > np.diag(whole.covariance)).all()


@pytest.mark.parametrize(
    "sigma", [SIGMA, np.full(len(RING), SIGMA), np.full((len(RING), 3), SIGMA)]
)
def test_sigma_is_one_for_all_or_one_a_gauge_or_one_a_channel(sigma):
    touches = [(60.0, 40.0, 2.0)]
    estimate = models.solve(strain(touches), INFLUENCE, sigma)
    np.testing.assert_allclose(found(estimate), touches, atol=1e-6)


def test_two_touches_too_close_to_separate_are_unresolvable():
    rng = np.random.default_rng(7)
    close = strain([(70.0, 50.0, 1.0), (71.0, 50.5, 1.0)])
    far = strain([(40.0, 50.0, 1.0), (110.0, 50.5, 1.0)])
    for _ in range(20):
        noise = rng.normal(0, 10 * SIGMA, close.shape)
        apart = models.solve(far + noise, INFLUENCE, 10 * SIGMA, count=2)
        assert apart.result is Result.FOUND
        merged = models.solve(close + noise, INFLUENCE, 10 * SIGMA, count=2)
        assert merged.result is Result.UNRESOLVABLE
        assert np.isfinite(merged.covariance).all()


def test_a_touch_that_is_asked_for_but_not_there_is_unresolvable():
    rng = np.random.default_rng(9)
    for _ in range(20):
        measured = strain([(60.0, 40.0, 1.0)]) + rng.normal(0, SIGMA, (len(RING), 3))
        estimate = models.solve(measured, INFLUENCE, SIGMA, count=2)
        assert estimate.result is Result.UNRESOLVABLE


def test_a_touch_near_the_clamped_edge_is_found_and_one_on_it_is_not_invented():
    near = [(3.0, 60.0, 2.0)]  # 2 % of the side
    np.testing.assert_allclose(found(models.solve(strain(near), INFLUENCE, SIGMA)), near, atol=1e-5)
    on = models.solve(strain([(0.0, 60.0, 50.0)]), INFLUENCE, SIGMA)
    assert on.result is Result.NO_TOUCH


def test_count_zero_only_says_how_well_nothing_explains():
    estimate = models.solve(strain([(60.0, 40.0, 1.0)]), INFLUENCE, SIGMA, count=0)
    assert (estimate.count, estimate.result) == (0, Result.NO_TOUCH)
    assert estimate.p_value < 1e-6


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"strain": np.zeros((5, 3))}, r"^strain must have shape \(60, 3\), .* got \(5, 3\)"),
        ({"strain": np.zeros(180)}, r"^strain must have shape \(60, 3\)"),
        ({"strain": np.full((60, 3), np.nan)}, "^every strain channel is missing"),
        ({"sigma": np.inf}, "^every strain channel is missing"),
        ({"sigma": 0.0}, "^sigma of strain must be positive, got 0"),
        ({"sigma": -1.0}, "^sigma of strain must be positive, got -1"),
        ({"sigma": np.nan}, "^sigma of strain must be positive, got nan"),
        ({"sigma": np.ones(7)}, r"^sigma has shape \(7,\) for 60 gauges; give one number"),
        ({"count": -1}, "^number of touches must be a whole number of 0 or more, got -1"),
    ],
)
def test_bad_input_is_refused_in_one_sentence(change, sentence):
    given = {"strain": np.zeros((60, 3)), "sigma": SIGMA} | change
    with pytest.raises(ValueError, match=sentence) as refusal:
        models.solve(given.pop("strain"), INFLUENCE, **given)
    assert "\n" not in str(refusal.value)


@pytest.mark.parametrize(
    ("measured", "sentence"),
    [
        (np.zeros(7), r"^measurement must have shape \(180,\) as the forward model, got \(7,\)"),
        (np.full(180, np.nan), "^measurement holds NaN or infinite values"),
    ],
)
def test_a_measurement_that_does_not_fit_is_refused(measured, sentence):
    with pytest.raises(ValueError, match=sentence):
        find(measured, SEARCH)


@pytest.mark.parametrize(
    ("start", "sentence"),
    [
        ([1.0, 2.0], r"^start must be \(n, 3\), x, y, F of each touch, got shape \(2,\)"),
        ([[1.0, 2.0, 3.0, 4.0]], r"^start must be \(n, 3\), .* got shape \(1, 4\)"),
        ([[60.0, np.nan, 1.0]], "^start holds NaN or infinite values"),
    ],
)
def test_a_start_that_is_no_touches_is_refused(start, sentence):
    with pytest.raises(ValueError, match=sentence):
        find(np.zeros(180), SEARCH, start=start)


def test_a_touch_is_not_split_in_two():
    # Two touches in nearly one place explain these as well as one does.
    exact = models.gauge_forward(INFLUENCE, 1e-13)
    search = models.prepare_candidates(exact)
    for seed in range(20):
        touches = draw(np.random.default_rng(seed), 3, apart=8.0)
        estimate = find(exact.read(touches)[0], search)
        assert (estimate.count, estimate.result) == (3, Result.FOUND)
        np.testing.assert_allclose(found(estimate), touches, atol=1e-6)


def test_a_prior_draws_an_estimate_by_the_fraction_of_its_information():
    touches = [(60.0, 40.0, 2.0)]
    plain = models.solve(strain(touches), INFLUENCE, 10 * SIGMA)
    known = models.prior(force=2.2, force_sigma=0.01)
    drawn = models.solve(strain(touches), INFLUENCE, 10 * SIGMA, prior=known)
    information = np.linalg.inv(plain.covariance) + np.diag(known.precision)
    np.testing.assert_allclose(drawn.covariance, np.linalg.inv(information), rtol=0.05)
    truth = np.linalg.solve(information, [0, 0, 0.2 * known.precision[2]])
    error = (found(drawn) - touches)[0]
    np.testing.assert_allclose(error, truth, rtol=0.05, atol=1e-3 * np.abs(truth).max())
    assert drawn.dof == plain.dof + 1


def test_a_prior_on_the_place_holds_where_the_noise_is_large():
    known, noise = models.prior(place=(60.0, 40.0), place_sigma=0.5), 2e-5
    rng = np.random.default_rng(13)
    measured = strain([(60.0, 40.0, 1.0)]) + rng.normal(0, noise, (len(RING), 3))
    free = models.solve(measured, INFLUENCE, noise, count=1)
    held = models.solve(measured, INFLUENCE, noise, count=1, prior=known)
    assert (np.diag(held.covariance)[:2] < 0.5**2).all()
    assert (np.diag(free.covariance)[:2] > 4 * 0.5**2).all()
    np.testing.assert_allclose(held.xy, [[60.0, 40.0]], atol=1.5)


def test_a_prior_without_spread_is_refused():
    with pytest.raises(ValueError, match=r"^sigma of the force expected must be positive, got 0"):
        models.prior(force=1.0, force_sigma=0.0)


def test_bending_and_twist_of_the_base_cost_little_and_mislead_nobody():
    middle = RING - np.array(PLATE.size) / 2
    bend, twist = np.zeros((2, len(RING), 3))
    bend[:, 0], twist[:, 2] = 1e-5, 1e-7 * (middle[:, 0] + middle[:, 1])
    forward = FORWARD.setting_aside(np.stack([bend, twist]))
    touches = [(60.0, 40.0, 2.0)]
    bent = forward.whiten(strain(touches) + 3 * bend - 2 * twist)
    estimate = find(bent, models.prepare_candidates(forward))
    np.testing.assert_allclose(found(estimate), touches, atol=1e-6)
    assert estimate.dof == 3 * len(RING) - 2 - 3
    flat = models.solve(strain(touches), INFLUENCE, SIGMA)
    widening = np.sqrt(np.diag(estimate.covariance) / np.diag(flat.covariance))
    assert (widening > 1.0).all()
    assert (widening < 1.2).all()


def test_correlated_noise_is_weighed_as_such():
    rng = np.random.default_rng(12)
    block = SIGMA**2 * np.array([[1.0, 0.8, 0.0], [0.8, 1.0, 0.3], [0.0, 0.3, 2.0]])
    root, touches, squares = np.linalg.cholesky(block), np.array([[60.0, 40.0, 2.0]]), []
    for _ in range(100):
        noisy = strain(touches) + rng.normal(size=(len(RING), 3)) @ root.T
        estimate = models.solve(
            noisy, INFLUENCE, covariance=np.broadcast_to(block, (len(RING), 3, 3)), count=1
        )
        error = (found(estimate) - touches)[0]
        squares.append(error @ np.linalg.solve(estimate.covariance, error))
    assert np.mean(squares) == pytest.approx(3.0, abs=4 * np.sqrt(6 / 100))
