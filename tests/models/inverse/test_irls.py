"""Touches are found although a part of the measurement is false."""

import numpy as np
import pytest

import fe
import models
from models import Result
from models.inverse.irls import HUBER, TUKEY, huber, spread, tukey

PLATE = fe.Plate((150.0, 100.0), 1.0, 3000.0, 0.38)
X, Y = np.linspace(7.5, 142.5, 18), np.linspace(7.5, 92.5, 12)
RING = np.vstack(
    [[(x, y) for x in X for y in (5.0, 95.0)], [(x, y) for x in (5.0, 145.0) for y in Y]]
)
INFLUENCE = fe.influence(PLATE, RING, fe.Mesh(PLATE.size, (30, 20)))
SEARCH = models.prepare_candidates(
    models.gauge_forward(INFLUENCE, 1e-6)
)  # a touch of 1 N gives 4e-5
TOUCHES = np.array([[42.0, 63.0, 3.0], [104.0, 37.0, 2.0]])


def draw(count, rng, fraction):
    """Whitened strains under noise, a fraction of them false by 30 σ, and which."""
    white = rng.normal(size=SEARCH.response.shape[1])
    if count:
        white += SEARCH.forward.read(TOUCHES[:count])[0]
    false = rng.permutation(len(white))[: int(fraction * len(white))]
    white[false] += 30.0 * rng.choice([-1.0, 1.0], len(false))
    return white, false


@pytest.mark.parametrize("count", [1, 2])
@pytest.mark.parametrize("known", [True, False])
def test_a_fifth_of_false_channels_does_not_move_the_touches(count, known):
    rng = np.random.default_rng(count)
    for _ in range(3):
        white, false = draw(count, rng, 0.2)
        estimate = models.find_robust(white, SEARCH, count=count if known else None)
        assert (estimate.result, estimate.count) == (Result.FOUND, count)
        error = np.column_stack([estimate.xy, estimate.force]) - TOUCHES[:count]
        # 5 σ of six numbers drawn three times; those left out cost a few per cent.
        assert (np.abs(error).ravel() < 5 * np.sqrt(np.diag(estimate.covariance))).all()
        assert len(white) - len(false) - 3 * count - 3 <= estimate.dof <= len(white) - len(false)


def test_without_false_channels_nothing_is_lost():
    white, _ = draw(2, np.random.default_rng(5), 0.0)
    plain, robust = models.find(white, SEARCH), models.find_robust(white, SEARCH)
    np.testing.assert_allclose(robust.xy, plain.xy, atol=1e-3)
    np.testing.assert_allclose(robust.force, plain.force, atol=1e-3)
    assert robust.p_value > 1e-3


def test_false_channels_alone_are_no_touch():
    white, _ = draw(0, np.random.default_rng(6), 0.2)
    assert models.find_robust(white, SEARCH).result is Result.NO_TOUCH


def test_an_ordinary_fit_is_led_astray_where_the_robust_fit_is_not():
    white, _ = draw(1, np.random.default_rng(7), 0.2)
    plain = models.find(white, SEARCH, count=1)
    robust = models.find_robust(white, SEARCH, count=1)
    away = [np.linalg.norm(estimate.xy[0] - TOUCHES[0, :2]) for estimate in (plain, robust)]
    assert away[1] < 0.3 * away[0]
    assert plain.p_value < 1e-12


def test_a_measurement_that_does_not_fit_is_refused():
    with pytest.raises(ValueError, match=r"^measurement must have shape .* got \(7,\)"):
        models.find_robust(np.zeros(7), SEARCH)


def test_spread_is_that_of_the_honest_part_and_never_below_the_noise():
    rng = np.random.default_rng(8)
    residual = 3.0 * rng.standard_normal(4001)
    residual[:200] *= 100.0
    assert spread(residual) == pytest.approx(3.0, rel=0.1)
    assert spread(0.1 * residual) == 1.0


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_weights_fall_as_theirs_who_proposed_them(sign):
    at = sign * np.array([0.0, 0.5, 1.0, 2.0])
    np.testing.assert_allclose(huber(at * HUBER), [1.0, 1.0, 1.0, 0.5])
    np.testing.assert_allclose(tukey(at * TUKEY), [1.0, 0.5625, 0.0, 0.0])
