"""A training is kept under what its scene says, and read the second time."""

import csv

import numpy as np
import pytest

import rig
from rig.studies.paper.drawn import trainings
from rig.studies.paper.drawn.plots import keep_losses, thinned


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.setattr(trainings, "FOLDER", tmp_path)
    return tmp_path


def test_what_is_kept_is_read_and_not_trained_again(folder, monkeypatch):
    settings = {"estimator.epochs": 40, "training.test_samples": 50}
    first = trainings.train_kept("paper-one", settings, 3)
    assert len(list(folder.iterdir())) == 1

    def trained_again(*arguments):
        raise AssertionError

    monkeypatch.setattr(trainings, "train_model", trained_again)
    again = trainings.train_kept("paper-one", settings, 3)
    np.testing.assert_array_equal(first.test()[1], again.test()[1])
    np.testing.assert_array_equal(first.curves()[""][:, 0], np.arange(1, 41))
    assert first.cpu == again.cpu > 0


def test_other_values_and_other_seeds_have_other_files(folder):
    one = rig.load("paper-one")
    same = rig.load("paper-one", {"estimator.decay": "constant"})  # as when nothing is said
    others = [
        rig.load("paper-one", changed)
        for changed in ({"estimator.seed": 1}, {"estimator.epochs": 7}, {"training.margin": 15})
    ]
    places = {trainings.place("paper-one", scene) for scene in (one, *others)}
    assert len(places) == 4
    assert trainings.place("paper-one", same) == trainings.place("paper-one", one)


def test_a_training_of_another_scene_in_its_place_is_refused(folder):
    settings = {"estimator.epochs": 20, "training.test_samples": 50}
    trainings.train_kept("paper-one", settings)
    (path,) = folder.iterdir()
    trainings.train_kept("paper-one", settings | {"estimator.layers": [8]})
    (other,) = set(folder.iterdir()) - {path}
    other.replace(path)
    with pytest.raises(ValueError, match="made for another scene; delete it, and it is made again"):
        trainings.train_kept("paper-one", settings)


@pytest.mark.parametrize("content", [b"", b"no archive", b"PK\x03\x04cut off"])
def test_a_damaged_checkpoint_is_named(folder, content):
    settings = {"estimator.epochs": 20, "training.test_samples": 50}
    path = trainings.place("paper-one", rig.load("paper-one", settings | {"estimator.seed": 0}))
    path.with_suffix(".part.npz").write_bytes(content)
    with pytest.raises(ValueError, match="is damaged; delete it, and training begins anew"):
        trainings.train_kept("paper-one", settings)
    assert not path.is_file()


def test_a_regression_has_no_curves_and_no_seed(folder):
    kept = trainings.train_kept("paper-regression", {"training.test_samples": 50}, 5)
    assert kept.curves() == {}
    with pytest.raises(TypeError, match="is no single net"):
        _ = kept.net


def test_a_curve_is_thinned_evenly_in_the_logarithm():
    epochs = np.arange(1.0, 10001.0)
    curve = np.column_stack([epochs, 5.0 / epochs, 7.0 / epochs])
    thin = thinned(curve)
    assert 40 < len(thin) <= 60
    np.testing.assert_allclose(thin[:, 0] * thin[:, 1], 5.0, rtol=1e-9)
    apart = np.diff(np.log(thin[20:, 0]))
    np.testing.assert_allclose(apart, np.median(apart), rtol=0.5)


def test_losses_travel_with_a_drawing_net_by_net_and_seed_by_seed(tmp_path):
    steps = np.arange(1.0, 5001.0)
    curves = [np.column_stack([steps, rate / steps, 2.0 * rate / steps]) for rate in (3.0, 4.0)]
    keep_losses(tmp_path, "losses.csv", {"4×64": curves, "8×256": curves[:1]})
    with (tmp_path / "losses.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert {(row["net"], row["seed"]) for row in rows} == {
        ("4×64", "0"),
        ("4×64", "1"),
        ("8×256", "0"),
    }
    second = [row for row in rows if row["seed"] == "1"]
    read = np.array([[float(r[key]) for key in ("step", "training", "validation")] for r in second])
    np.testing.assert_allclose(read, thinned(curves[1]), rtol=1e-5)
    assert len(read) <= 60
