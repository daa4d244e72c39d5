"""Exported nets predict as ours, in an independent runtime."""

import numpy as np
import onnxruntime
import pytest

from models.data.dataset import Dataset
from models.nets.net import Net, NetOptions, Scaling, initial, predict
from models.nets.onnx import two_step_to_onnx, write_model_onnx, write_onnx
from models.nets.regression import Regression
from models.nets.set_encoding import encode
from models.nets.two_step import TwoStep, predict_two_step


@pytest.mark.parametrize("activation", ["relu", "tanh", "silu"])
@pytest.mark.parametrize(("knee", "relative"), [(None, False), (2e-5, False), (None, True)])
def test_an_exported_net_equals_ours_in_another_runtime(tmp_path, activation, knee, relative):
    rng = np.random.default_rng(0)
    options = NetOptions((9, 5), activation)
    scaling = Scaling(rng.normal(size=6), rng.uniform(0.5, 2.0, 6), knee, relative)
    net = Net(options, scaling, initial((6, 9, 5, 2), rng))
    strain = 1e-4 * rng.normal(size=(11, 6))
    strain[3] = 0.0  # nothing presses
    path = tmp_path / "net.onnx"
    write_onnx(path, net)
    session = onnxruntime.InferenceSession(path)
    (places,) = session.run(["targets"], {"strain": strain})
    np.testing.assert_allclose(places, predict(net, strain), rtol=1e-12, atol=1e-12)


def test_a_place_that_cannot_be_written_is_said(tmp_path):
    net = Net(
        NetOptions((2,)),
        Scaling(np.zeros(1), np.ones(1)),
        initial((1, 2, 2), np.random.default_rng(0)),
    )
    with pytest.raises(OSError, match=r"none/net.onnx cannot be written .* choose another place"):
        write_onnx(tmp_path / "none" / "net.onnx", net)


@pytest.mark.slow
@pytest.mark.parametrize("magnitudes", [False, True])
@pytest.mark.parametrize("touches", [1, 2, 3])
def test_touches_without_an_order_are_the_same_in_another_runtime(tmp_path, touches, magnitudes):
    """The code of random touches passes a net of one layer that hands it on."""
    rng = np.random.default_rng(touches)
    targets = rng.uniform(10.0, 90.0, (300, 2 * touches))
    if magnitudes:
        targets = np.column_stack([targets, rng.uniform(1.0, 10.0, (300, touches))])
    code = encode(targets, touches)
    columns = code.shape[1]
    scaling = Scaling(np.zeros(columns), np.ones(columns))
    layers = ((np.eye(columns), np.zeros(columns)),)
    net = Net(NetOptions((), poles=touches), scaling, layers)
    write_onnx(tmp_path / "net.onnx", net)
    session = onnxruntime.InferenceSession(tmp_path / "net.onnx")
    (found,) = session.run(["targets"], {"strain": code})
    ours, places = predict(net, code), slice(0, 2 * touches)
    apart = targets[:, places].reshape(-1, touches, 1, 2) - targets[:, places].reshape(
        -1, 1, touches, 2
    )
    close = np.linalg.norm(apart, axis=3) + 1e9 * np.eye(touches)
    clear = close.min(axis=(1, 2)) > 1.0  # mm; where two touches meet, a root amplifies rounding
    assert clear.sum() > 280
    np.testing.assert_allclose(found[clear][:, places], ours[clear][:, places], atol=1e-8)
    np.testing.assert_allclose(found[clear], ours[clear], atol=1e-6)


@pytest.mark.slow
def test_touches_at_one_place_keep_finite_in_another_runtime(tmp_path):
    code = encode(np.array([[30.0, 20.0, 30.0, 20.0, 70.0, 20.0]]), 3)
    net = Net(
        NetOptions((), poles=3), Scaling(np.zeros(6), np.ones(6)), ((np.eye(6), np.zeros(6)),)
    )
    write_onnx(tmp_path / "net.onnx", net)
    session = onnxruntime.InferenceSession(tmp_path / "net.onnx")
    (found,) = session.run(["targets"], {"strain": code})
    np.testing.assert_allclose(found, [[30.0, 20.0, 30.0, 20.0, 70.0, 20.0]], atol=1e-4)


@pytest.mark.parametrize("strain", ["total", "change", "direction"])
def test_a_net_of_two_steps_is_the_same_in_another_runtime(tmp_path, strain):
    rng = np.random.default_rng(3)
    shape, place = (
        Net(
            NetOptions((5,), "silu"),
            Scaling(rng.normal(size=fed), rng.uniform(0.5, 2.0, fed)),
            initial((fed, 5, 2), rng),
        )
        for fed in (6, 8)
    )
    nets = TwoStep(shape, place, strain)
    before, loaded = rng.normal(size=(2, 11, 6))
    path = tmp_path / "two.onnx"
    path.write_bytes(two_step_to_onnx(nets).SerializeToString())
    session = onnxruntime.InferenceSession(path)
    (found,) = session.run(["targets"], {"before": before, "strain": loaded})
    np.testing.assert_allclose(found, predict_two_step(nets, before, loaded), rtol=1e-11)


def test_a_regression_is_refused(tmp_path):
    data = Dataset(np.eye(3), np.zeros((3, 2)))
    with pytest.raises(ValueError, match=r"is no net and cannot be exported .*; leave --onnx out"):
        write_model_onnx(tmp_path / "net.onnx", Regression("linear", data))
