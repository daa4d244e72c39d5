"""The convolutional and the adversarial net learn, each from its seed."""

import numpy as np
import pytest

from models.data import dataset
from models.data.gauge_layout import gauges_on_edges
from models.nets import baselines
from models.scores.score import position_error

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


@pytest.mark.parametrize("fit", [baselines.convolutional, baselines.adversarial])
def test_it_learns_to_place_touches_and_repeats(fit):
    predict = fit(TRAINING, 400, seed=0, learning_rate=1e-2)
    error = position_error(TEST.targets, predict(TEST.strain))
    assert error.mean() < 3.0  # a guess at the middle is off by 17 mm
    short = [fit(TRAINING, 20, seed)(TEST.strain) for seed in (0, 0, 1)]
    np.testing.assert_array_equal(short[0], short[1])
    assert not np.array_equal(short[0], short[2])
