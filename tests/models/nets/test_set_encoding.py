"""Touches without an order: codes and back, and the loss that pairs nothing."""

import itertools

import numpy as np
import pytest
from hypothesis import given, strategies as st

from models.nets.set_encoding import decode, encode, permutation_invariant_loss
from models.scores.score import matched_error

torch = pytest.importorskip("torch")

SIZE = (60.0, 40.0)


def drawn(touches, magnitudes=False, count=50, seed=0):
    """Return touches on an oblong plate, sorted by x."""
    rng = np.random.default_rng(seed)
    places = rng.uniform(0.0, SIZE, (count, touches, 2))
    order = places[..., 0].argsort(axis=1)
    places = np.take_along_axis(places, order[..., None], axis=1).reshape(count, -1)
    if not magnitudes:
        return places
    return np.column_stack([places, rng.uniform(1.0, 10.0, (count, touches))])


@given(st.integers(1, 3), st.booleans(), st.integers(0, 99))
def test_a_code_decodes_to_the_touches_that_it_was_made_from(touches, magnitudes, seed):
    targets = drawn(touches, magnitudes, seed=seed)
    np.testing.assert_allclose(decode(encode(targets, touches), touches), targets, atol=1e-5)


def test_the_order_of_the_touches_is_not_in_the_code():
    targets = drawn(3, magnitudes=True)
    code = encode(targets, 3)
    assert code.shape == (50, 11)
    for order in itertools.permutations(range(3)):
        turned = np.column_stack(
            [targets[:, :6].reshape(-1, 3, 2)[:, order].reshape(-1, 6), targets[:, 6:][:, order]]
        )
        np.testing.assert_allclose(encode(turned, 3), code, atol=1e-8)


def test_touches_at_one_place_divide_their_magnitude():
    together = np.array([[30.0, 20.0, 30.0, 20.0, 2.0, 4.0]])
    np.testing.assert_allclose(decode(encode(together, 2), 2), [[30, 20, 30, 20, 3, 3]])


@pytest.mark.parametrize("touches", [1, 2, 3])
def test_the_loss_is_the_mean_distance_where_errors_are_small(touches):
    true = drawn(touches, count=200)
    far = np.array(
        [
            touches == 1 or min(np.hypot(*(a - b)) for a, b in itertools.combinations(row, 2)) > 5
            for row in true.reshape(len(true), touches, 2)
        ]
    )
    true = true[far]
    reported = true + np.random.default_rng(1).normal(0.0, 1e-3, true.shape)
    loss = permutation_invariant_loss(touches)(
        torch.tensor(encode(reported, touches)), torch.tensor(true)
    ).item()
    error, _ = matched_error(true.reshape(-1, touches, 2), reported.reshape(-1, touches, 2))
    assert loss == pytest.approx(error.mean(), rel=5e-3)


def test_the_loss_weighs_the_relative_error_of_magnitudes_by_k():
    true = np.array([[10.0, 10.0, 40.0, 30.0, 2.0, 8.0]])
    reported = np.array([[10.0, 10.0, 40.0, 30.0, 2.1, 8.8]])  # 5 % and 10 % too much
    losses = [
        permutation_invariant_loss(2, k)(
            torch.tensor(encode(reported, 2)), torch.tensor(true)
        ).item()
        for k in (0.0, 1.0, 10.0)
    ]
    np.testing.assert_allclose(losses, [0.0, 0.075, 0.75], atol=1e-12)


def test_the_loss_stays_finite_with_its_gradient_where_touches_meet():
    true = torch.tensor([[30.0, 20.0, 30.0, 20.0]])
    reported = torch.tensor(encode(true.numpy() + 0.5, 2), requires_grad=True)
    loss = permutation_invariant_loss(2)(reported, true.double())
    loss.backward()
    assert np.isfinite(loss.item())
    assert reported.grad.isfinite().all()
