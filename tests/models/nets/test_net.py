"""Nets as plain arrays."""

import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given, strategies as st

from models.nets import net


def made(options, inputs=7, seed=0):
    rng = np.random.default_rng(seed)
    scaling = net.Scaling(rng.normal(size=inputs), rng.uniform(0.5, 2.0, inputs))
    return net.Net(options, scaling, net.initial((inputs, *options.layers, 2), rng))


def in_torch(made_net, strain):
    """Build the same net from torch's own layers."""
    torch = pytest.importorskip("torch")
    modules = []
    acts = {"relu": torch.nn.ReLU, "tanh": torch.nn.Tanh, "silu": torch.nn.SiLU}
    for weights, biases in made_net.layers:
        linear = torch.nn.Linear(*weights.shape, dtype=torch.float64)
        linear.weight.data = torch.tensor(weights.T.astype(float))
        linear.bias.data = torch.tensor(biases.astype(float))
        modules += [linear, acts[made_net.options.activation]()]
    inputs = (strain - made_net.scaling.centre) / made_net.scaling.scale
    return torch.nn.Sequential(*modules[:-1])(torch.tensor(inputs)).detach().numpy()


@pytest.mark.parametrize("activation", ["relu", "tanh", "silu"])
@pytest.mark.parametrize("layers", [(32, 32), (5,), (4, 9, 3)])
def test_the_numpy_net_equals_the_same_net_in_torch(activation, layers):
    made_net = made(net.NetOptions(layers, activation))
    strain = np.random.default_rng(1).normal(size=(11, 7))
    np.testing.assert_allclose(net.predict(made_net, strain), in_torch(made_net, strain), atol=1e-6)


def test_activations_stay_finite_for_huge_inputs():
    for activation in ("relu", "tanh", "silu"):
        places = net.predict(made(net.NetOptions((8,), activation)), np.full((1, 7), -1e6))
        assert np.all(np.isfinite(places))


def test_a_relu_net_without_hidden_biases_is_homogeneous():
    made_net = made(net.NetOptions((16, 16), "relu"))
    strain = np.random.default_rng(2).normal(size=(5, 7))
    doubled = 2.0 * (strain - made_net.scaling.centre) + made_net.scaling.centre
    np.testing.assert_allclose(
        net.predict(made_net, doubled), 2.0 * net.predict(made_net, strain), rtol=1e-6, atol=1e-6
    )


@given(st.integers(0, 2**32 - 1), st.floats(1e-7, 1e3))
def test_standardised_inputs_have_mean_0_and_deviation_1_at_any_force(seed, force):
    strain = force * np.random.default_rng(seed).normal(3.0, 2.0, (40, 6))
    scaling = net.scaling(strain)
    inputs = (strain - scaling.centre) / scaling.scale
    np.testing.assert_allclose(inputs.mean(axis=0), 0.0, atol=1e-9)
    np.testing.assert_allclose(inputs.std(axis=0), 1.0, rtol=1e-9)


def test_inputs_that_hold_only_rounding_are_not_blown_up():
    strain = 1e-4 * np.random.default_rng(0).normal(size=(40, 6))
    strain[:, 2] *= 1e-14
    strain[:, 4] = 0.0
    scaling = net.scaling(strain)
    inputs = (strain - scaling.centre) / scaling.scale
    assert np.abs(inputs[:, [2, 4]]).max() < 1e-12


def test_initial_weights_are_glorot_uniform_with_zero_biases():
    (weights, biases), _ = net.initial((300, 200, 2), np.random.default_rng(0))
    limit = np.sqrt(6.0 / 500.0)
    assert np.abs(weights).max() <= limit
    assert weights.std() == pytest.approx(limit / np.sqrt(3.0), rel=0.01)
    assert weights.mean() == pytest.approx(0.0, abs=0.01 * limit)
    assert not biases.any()


def test_strains_of_other_gauges_are_refused():
    with pytest.raises(ValueError, match="must be 7, got 6; use the gauges"):
        net.predict(made(net.NetOptions((3,))), np.zeros((2, 6)))


def test_options_that_make_no_net_are_refused():
    with pytest.raises(ValueError, match=r"at least 1, got layers \[32, 0\]"):
        net.NetOptions((32, 0))
    with pytest.raises(ValueError, match="one of relu, tanh, silu, got 'step'"):
        net.NetOptions((32,), "step")


def test_running_and_loading_a_net_imports_no_torch():
    code = (
        "import sys, models.nets.net, models.nets.store, models.scores.score;"
        "sys.exit('torch' in sys.modules)"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_first_weights_keep_the_size_that_their_rule_says():
    sizes = (300, 200, 2)
    glorot, he = (
        net.initial(sizes, np.random.default_rng(0), rule)[0][0] for rule in ("glorot", "he")
    )
    np.testing.assert_allclose(glorot.std(), np.sqrt(2.0 / 500), rtol=0.02)
    np.testing.assert_allclose(he.std(), np.sqrt(2.0 / 300), rtol=0.02)
