"""The losses of equations 1 to 4, beside sums written out."""

import numpy as np
import pytest

from models.nets import loss

torch = pytest.importorskip("torch")

RNG = np.random.default_rng(0)
TRUE = RNG.uniform(1.0, 9.0, (7, 6))
PREDICTED = TRUE + RNG.normal(size=TRUE.shape)


def value(kind, columns=6):
    tensors = (torch.tensor(array[:, :columns]) for array in (PREDICTED, TRUE))
    return kind(*tensors).item()


def apart(first, last):
    return np.hypot(*(PREDICTED - TRUE)[:, first:last].T)


def test_one_touch_is_judged_by_its_mean_distance():
    assert value(loss.distance_loss(), 2) == pytest.approx(apart(0, 2).mean())


def test_several_touches_are_judged_by_the_mean_of_theirs():
    distances = [apart(0, 2), apart(2, 4), apart(4, 6)]
    assert value(loss.distance_loss(3)) == pytest.approx(np.mean(distances))


def test_magnitudes_count_by_their_relative_error():
    relative = np.abs(PREDICTED[:, 4:] / TRUE[:, 4:] - 1.0).mean()
    expected = np.mean([apart(0, 2), apart(2, 4)]) + 3.0 * relative
    assert value(loss.magnitude_loss(2, 3.0)) == pytest.approx(expected)


def test_bend_and_twist_count_by_the_sum_of_their_errors():
    off = np.abs(PREDICTED - TRUE)[:, 2:4].sum(axis=1).mean()
    assert value(loss.base_loss(0.5), 4) == pytest.approx(apart(0, 2).mean() + 0.5 * off)


def test_the_mean_square_is_that_of_all_targets():
    assert value(loss.mean_square()) == pytest.approx(np.mean((PREDICTED - TRUE) ** 2))
