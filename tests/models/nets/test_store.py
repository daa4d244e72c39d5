"""Stored nets: what is read is what was written, or one sentence."""

import h5py
import numpy as np
import pytest

from models.nets.net import Net, NetOptions, Scaling, initial, predict
from models.nets.store import load_net, save_net
from models.nets.train import Trained

ABOUT = {"scene": {"plate": {"size": [60.0, 40.0]}, "title": "µ-bench"}}


def some_net():
    rng = np.random.default_rng(0)
    scaling = Scaling(rng.normal(size=6), rng.uniform(1.0, 2.0, 6))
    net = Net(NetOptions((5, 4), "silu"), scaling, initial((6, 5, 4, 2), rng))
    return Trained(net, rng.uniform(size=(10, 2)))


@pytest.fixture
def path(tmp_path):
    where = tmp_path / "new" / "model.h5"
    save_net(where, some_net(), ABOUT)
    return where


def test_a_stored_net_predicts_to_the_last_bit_what_it_did(path):
    trained, about = load_net(path)
    strain = np.random.default_rng(1).normal(size=(9, 6))
    np.testing.assert_array_equal(predict(trained.net, strain), predict(some_net().net, strain))
    np.testing.assert_array_equal(trained.history, some_net().history)
    assert trained.net.options == NetOptions((5, 4), "silu")
    assert about == ABOUT


def test_a_net_without_an_order_is_read_as_it_was(tmp_path):
    net = some_net().net
    layers = (*net.layers[:-1], initial((4, 7), np.random.default_rng(2))[0])
    unordered = Net(NetOptions((5, 4), "silu", poles=2), net.scaling, layers)
    save_net(tmp_path / "pair.h5", Trained(unordered, np.zeros((1, 2))), ABOUT)
    found = load_net(tmp_path / "pair.h5")[0].net
    assert found.options.poles == 2
    strain = np.random.default_rng(1).normal(size=(9, 6))
    reported = predict(found, strain)
    assert reported.shape == (9, 6)  # two places and two magnitudes
    np.testing.assert_array_equal(reported, predict(unordered, strain))


def test_the_file_holds_plain_float_arrays_and_text_only(path):
    with h5py.File(path) as file:
        assert {item.dtype.kind for item in file.values()} == {"f"}
        assert sorted(file.attrs) == ["checksum", "format", "options", "version"]


def test_saving_replaces_the_file_and_leaves_nothing_beside_it(path):
    save_net(path, some_net(), {"second": 2})
    assert [entry.name for entry in path.parent.iterdir()] == ["model.h5"]
    assert load_net(path)[1] == {"second": 2}


def test_a_save_that_fails_leaves_the_old_file_whole(path):
    before = path.read_bytes()
    with pytest.raises(TypeError):
        save_net(path, some_net(), {"about": object()})
    broken = Trained(some_net().net, np.array([object()]))
    with pytest.raises(TypeError):
        save_net(path, broken, ABOUT)
    assert path.read_bytes() == before
    assert len(list(path.parent.iterdir())) == 1


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(FileNotFoundError, match=r"model\.h5 does not exist; train the model first"):
        load_net(tmp_path / "model.h5")


@pytest.mark.parametrize("keep", [0, 10, 600, -1])
def test_a_truncated_file_is_called_damaged(path, keep):
    path.write_bytes(path.read_bytes()[:keep])
    with pytest.raises(ValueError, match=r"is damaged .*; .*train the model again"):
        load_net(path)


def test_no_flipped_byte_changes_what_is_read_unseen(path):
    whole = path.read_bytes()
    for place in np.random.default_rng(2).integers(0, len(whole), 150):
        path.write_bytes(whole[:place] + bytes([whole[place] ^ 0xFF]) + whole[place + 1 :])
        said = outcome(path)
        assert said == "as written" or str(path) in said  # the first where it lay in padding


def outcome(path):
    """Say how a load ends: as written, changed unseen, or with which sentence."""
    try:
        trained, about = load_net(path)
    except ValueError as error:
        return str(error)
    strain = np.ones((1, 6))
    same = np.array_equal(predict(trained.net, strain), predict(some_net().net, strain))
    return "as written" if same and about == ABOUT else "changed"


def test_changed_weights_or_options_do_not_pass(path):
    for change in (lambda file: file["weights0"].__setitem__((0, 0), 1.0), _swap_activation):
        save_net(path, some_net(), ABOUT)
        with h5py.File(path, "r+") as file:
            change(file)
        with pytest.raises(ValueError, match="is damaged; delete it and train the model again"):
            load_net(path)


def zero_scale(net):
    return Net(net.options, Scaling(net.scaling.centre, 0 * net.scaling.scale), net.layers)


def diverged(net):
    (weights, biases), *others = net.layers
    return Net(net.options, net.scaling, ((np.nan * weights, biases), *others))


def of_another_shape(net):
    (weights, biases), *others = net.layers
    return Net(net.options, net.scaling, ((weights.T, biases), *others))


def without_a_layer(net):
    return Net(net.options, net.scaling, net.layers[:1])


@pytest.mark.parametrize("change", [zero_scale, diverged, of_another_shape, without_a_layer])
def test_a_whole_file_that_holds_no_net_is_refused(path, change):
    save_net(path, Trained(change(some_net().net), np.zeros((1, 2))), ABOUT)
    with pytest.raises(ValueError, match=r"holds no net that can be run \(.*\); train the model"):
        load_net(path)


def _swap_activation(file):
    file.attrs["options"] = file.attrs["options"].replace(b"silu", b"tanh")


def test_another_version_and_foreign_files_are_distinguished(path, tmp_path):
    with h5py.File(path, "r+") as file:
        file.attrs["version"] = 99
    with pytest.raises(ValueError, match="has version 99, this release reads 1; train"):
        load_net(path)
    with h5py.File(tmp_path / "other.h5", "w") as file:
        file["data"] = np.zeros(3)
        file.create_group("a group")
    with pytest.raises(ValueError, match="holds something else"):
        load_net(tmp_path / "other.h5")
    (tmp_path / "text.h5").write_text("not HDF5")
    with pytest.raises(ValueError, match="damaged or no HDF5 file"):
        load_net(tmp_path / "text.h5")
