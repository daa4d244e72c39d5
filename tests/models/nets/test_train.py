"""Training: it learns, repeats, and stops where it cannot go on."""

import numpy as np
import pytest

from models.data import dataset
from models.nets.batches import superposed_batches
from models.nets.checkpoint import Checkpoint
from models.nets.net import NetOptions, predict
from models.nets.set_encoding import encode
from models.nets.train import Recipe, device_for, train_net
from models.scores.score import matched_error, position_error

torch = pytest.importorskip("torch")

SIZE = (60.0, 40.0)
TANH = NetOptions((16, 16), "tanh")


class Bumps:
    """Gauges that feel a touch by its distance: smooth, one to one, in closed form."""

    gauges = dataset.grid_places(SIZE, spacing=20.0, margin=0.0)

    def strain(self, xy):
        apart = np.linalg.norm(xy[:, None] - self.gauges, axis=2)
        bump = 1e-4 * np.exp(-((apart / 30.0) ** 2))
        return np.stack([bump, -0.5 * bump, np.zeros_like(bump)], axis=2)


TRAINING = dataset.simulate_dataset(Bumps(), dataset.grid_places(SIZE, spacing=5.0, margin=5.0))
VALIDATION = dataset.simulate_dataset(
    Bumps(), dataset.midpoint_places(SIZE, spacing=5.0, margin=5.0, count=6)
)


def trained(epochs=400, options=TANH, seed=0, **more):
    recipe = Recipe(epochs, more.pop("learning_rate", 1e-2))
    return train_net(TRAINING, VALIDATION, options, recipe, np.random.default_rng(seed), **more)


@pytest.mark.parametrize("activation", ["relu", "tanh", "silu"])
def test_a_net_learns_to_place_touches_that_it_has_not_seen(activation):
    result = trained(1500, NetOptions((16, 16), activation))
    error = position_error(VALIDATION.targets, predict(result.net, VALIDATION.strain))
    assert error.mean() < 1.0  # measured 0.2 to 0.6 mm; a guess at the middle is off by 17 mm
    assert error.max() < 4.0


def test_the_history_is_the_loss_of_equation_1_on_both_sets():
    result = trained(200, learning_rate=1e-9)
    for column, data in enumerate([TRAINING, VALIDATION]):
        loss = position_error(data.targets, predict(result.net, data.strain)).mean()
        assert result.history.shape == (200, 2)
        assert result.history[-1, column] == pytest.approx(loss, rel=1e-5)


def test_the_same_generator_gives_the_same_net_and_another_another():
    first, again, other = trained(20), trained(20), trained(20, seed=1)
    for (weights, biases), (weights_again, biases_again) in zip(
        first.net.layers, again.net.layers, strict=True
    ):
        np.testing.assert_array_equal(weights, weights_again)
        np.testing.assert_array_equal(biases, biases_again)
    assert not np.array_equal(first.net.layers[0][0], other.net.layers[0][0])


def test_a_gpu_takes_large_steps_where_there_is_one(monkeypatch):
    wide, small = (144, *(256,) * 8, 6), (144, 32, 32, 2)
    monkeypatch.setattr(torch.cuda, "is_available", lambda: True)
    assert [device_for(wide, 512), device_for(small, 441)] == ["cuda", "cpu"]
    monkeypatch.setattr(torch.cuda, "is_available", lambda: False)
    assert device_for(wide, 512) == "cpu"


@pytest.mark.gpu
def test_a_large_net_learns_on_a_gpu_what_it_learns_on_a_cpu(monkeypatch, tmp_path):
    wide = NetOptions((512,) * 4, "tanh")
    place = Checkpoint(tmp_path / "half.npz", 10)
    there = trained(30, wide, learning_rate=1e-3, checkpoint=place)
    monkeypatch.setattr(torch.cuda, "is_available", lambda: False)
    here = trained(30, wide, learning_rate=1e-3)
    np.testing.assert_allclose(there.history, here.history, rtol=1e-2)
    assert not place.path.exists()


def test_the_force_of_the_training_touches_does_not_matter():
    strong = dataset.Dataset(1000.0 * TRAINING.strain, TRAINING.targets)
    result = train_net(strong, strong, NetOptions((8,)), Recipe(50), np.random.default_rng(0))
    plain = train_net(TRAINING, TRAINING, NetOptions((8,)), Recipe(50), np.random.default_rng(0))
    np.testing.assert_allclose(
        predict(result.net, strong.strain), predict(plain.net, TRAINING.strain), rtol=1e-3
    )


@pytest.mark.parametrize("inputs", ["standard", "asinh"])
def test_noise_in_a_channel_that_was_dead_in_training_does_not_matter(inputs):
    result = trained(20, NetOptions((8,), "silu", inputs))
    noise = np.zeros_like(VALIDATION.strain)
    noise[:, 2::3] = 1e-5  # of the shear, which `Bumps` does not have
    reported = predict(result.net, VALIDATION.strain + noise)
    np.testing.assert_array_equal(reported, predict(result.net, VALIDATION.strain))


def test_every_epoch_is_reported_with_its_loss():
    heard = []
    result = trained(5, on_epoch=lambda epoch, loss: heard.append((epoch, loss)))
    assert heard == [(number + 1, loss) for number, loss in enumerate(result.history[:, 0])]


def test_training_that_runs_away_ends_in_one_sentence():
    with pytest.raises(ValueError, match=r"training loss became (nan|inf) mm .* use a smaller one"):
        trained(50, learning_rate=1e30)


def test_a_recipe_that_goes_nowhere_is_refused():
    with pytest.raises(ValueError, match="epochs must be at least 1, got 0"):
        Recipe(epochs=0)
    with pytest.raises(ValueError, match="learning rate must be positive, got -1"):
        Recipe(learning_rate=-1.0)


def test_training_leaves_the_threads_of_torch_as_they_were():
    torch = pytest.importorskip("torch")
    before = torch.get_num_threads()
    trained(2)
    assert torch.get_num_threads() == before


@pytest.mark.slow
def test_a_net_learns_touches_without_an_order():
    rng = np.random.default_rng(0)
    pool = dataset.simulate_dataset(Bumps(), dataset.random_places(SIZE, 5.0, 2000, rng))
    stream = superposed_batches(pool, 2, 128, rng)
    first, test = (
        next(superposed_batches(pool, 2, 1000, rng)),
        next(superposed_batches(pool, 2, 500, rng)),
    )
    options = NetOptions((32, 32), "silu", poles=2)
    recipe = Recipe(1500, 5e-3, "cosine", "scaled", check=1500)
    net = train_net(first, test, options, recipe, rng, batches=stream).net
    reported = predict(net, test.strain)
    error, _ = matched_error(test.targets.reshape(-1, 2, 2), reported.reshape(-1, 2, 2))
    assert np.median(error) < 1.5  # measured 0.75 mm; a guess at the middle is off by 16 mm
    assert (np.diff(reported[:, ::2], axis=1) >= 0.0).all()


def test_a_finish_brings_the_codes_of_touches_nearer():
    pool = dataset.simulate_dataset(Bumps(), dataset.grid_places(SIZE, spacing=10.0, margin=5.0))
    pairs = next(superposed_batches(pool, 2, 200, np.random.default_rng(0)))
    errors = []
    for steps in (0, 200):
        recipe = Recipe(100, 5e-3, "cosine", "scaled", lbfgs_steps=steps)
        options = NetOptions((8,), "silu", poles=2)
        net = train_net(pairs, pairs, options, recipe, np.random.default_rng(0)).net
        reported = predict(net, pairs.strain)
        errors.append(np.square(encode(reported, 2) - encode(pairs.targets, 2)).mean())
    assert errors[1] < 0.5 * errors[0]
