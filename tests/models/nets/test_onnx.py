"""Exported nets predict as ours, in an independent runtime."""

import numpy as np
import onnxruntime
import pytest

from models.nets.net import Net, NetOptions, Scaling, initial, predict
from models.nets.onnx import to_onnx, write_onnx


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


def test_a_net_without_an_order_is_refused():
    layers = initial((1, 2, 4), np.random.default_rng(0))
    net = Net(NetOptions((2,), poles=2), Scaling(np.zeros(1), np.ones(1)), layers)
    with pytest.raises(ValueError, match=r"cannot be exported, .*; train one with poles = 0"):
        to_onnx(net)
