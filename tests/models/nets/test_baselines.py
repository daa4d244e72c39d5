"""The convolutional and the adversarial net learn, each from its seed, and end as plain nets."""

import numpy as np
import pytest

from models.data import dataset
from models.data.gauge_layout import gauges_on_edges
from models.nets.baselines import train_adversarial, train_convolutional
from models.nets.net import predict
from models.nets.recipe import Recipe
from models.scores.score import position_error

pytest.importorskip("torch")

SIZE = (60.0, 40.0)
GAUGES = gauges_on_edges(SIZE, spacing=10.0)


class Bumps:
    """A ring of gauges that feel a touch by its distance, in closed form."""

    def strain(self, xy):
        apart = np.linalg.norm(xy[:, None] - GAUGES, axis=2)
        bump = 1e-4 * np.exp(-((apart / 30.0) ** 2))
        return np.stack([bump, -0.5 * bump, np.zeros_like(bump)], axis=2)


TRAINING = dataset.simulate_dataset(Bumps(), dataset.grid_places(SIZE, spacing=5.0, margin=5.0))
TEST = dataset.simulate_dataset(
    Bumps(), dataset.midpoint_places(SIZE, spacing=5.0, margin=5.0, count=6)
)


def trained(train, epochs, seed=0):
    rng = np.random.default_rng(seed)
    return train(TRAINING, TEST, Recipe(epochs, 1e-2), rng)


@pytest.mark.parametrize("train", [train_convolutional, train_adversarial])
def test_it_learns_to_place_touches_and_repeats(train):
    done = trained(train, 400)
    error = position_error(TEST.targets, predict(done.net, TEST.strain))
    assert error.mean() < 3.0  # a guess at the middle is off by 17 mm
    assert done.history.shape == (400, 2)
    short = [predict(trained(train, 20, seed).net, TEST.strain) for seed in (0, 0, 1)]
    np.testing.assert_array_equal(short[0], short[1])
    assert not np.array_equal(short[0], short[2])


def test_kernels_written_out_are_the_same_in_every_turn_of_the_ring():
    net = trained(train_convolutional, 5).net
    first = net.layers[0][0]  # three numbers a gauge to eight channels a gauge
    turned = np.roll(first, (3, 8), axis=(0, 1))
    np.testing.assert_array_equal(first, turned)
    assert np.count_nonzero(first[:, :8]) == 5 * 3 * 8


def test_the_plain_net_reports_what_was_trained():
    """The loss that training saw last is that of the net with its kernels written out."""
    done = trained(train_convolutional, 60)
    again = trained(train_convolutional, 61)
    error = position_error(TEST.targets, predict(done.net, TEST.strain))
    np.testing.assert_allclose(again.history[60, 1], error.mean(), rtol=1e-4)
