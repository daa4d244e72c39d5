"""The touch net: touches, their number and their scatter from the amplitudes of a pattern."""

from dataclasses import replace

import numpy as np
import pytest

import fe
import models
from models import DescribedBench, TouchNetRecipe, TouchRange
from models.touch_net.maps import prepare_maps
from models.touch_net.network import COUNT, PROPOSE, TOUCH, first_weights, run, run_torch
from models.touch_net.posterior import Mixture, mixture
from models.touch_net.unrolled import fit_number, folded

PLATE = fe.Plate((254.0, 254.0), 2.0, 3000.0, 0.38)
BENCH = DescribedBench(PLATE, 500.0, (512, 512), 16, 0.038)
TOUCHES = TouchRange((254.0, 254.0), 0.1, (0.5, 4.0))
TINY = TouchNetRecipe(steps=3, head_steps=2, seed=5, batch=8, head_batch=16, benches=0)
APART = np.array([[60.0, 70.0, 1.5], [180.0, 90.0, 2.5], [120.0, 190.0, 3.0]])


@pytest.fixture(scope="module")
def forward():
    return models.bench_forward(BENCH)


@pytest.fixture(scope="module")
def net():
    return models.shipped_touch_net()


@pytest.fixture(scope="module")
def reader(net, forward):
    return models.prepare_reader(net, forward)


@pytest.fixture(scope="module")
def trained():
    pytest.importorskip("torch")
    return models.train_touch_net(BENCH, TOUCHES, TINY)


def test_a_folded_forward_model_reads_the_same(forward):
    measured, jacobian = forward.read(APART)
    again, slopes = folded(forward).read(APART)
    np.testing.assert_allclose(again, measured, rtol=0, atol=1e-4)
    np.testing.assert_allclose(slopes, jacobian, rtol=0, atol=1e-4)


def test_one_map_peaks_where_a_touch_presses_and_the_other_reads_its_force_there(forward):
    place = np.array([[106.68, 160.86]])  # of the grid
    shown = prepare_maps(forward, TOUCHES).read(2.0 * forward.response(place)[0])
    sharp, smooth = shown[:256].reshape(16, 16), shown[256:512].reshape(16, 16)
    assert np.unravel_index(sharp.argmax(), sharp.shape) == (10, 6)
    assert smooth[10, 6] == pytest.approx(0.25 * 2.0, rel=1e-4)


def test_the_steps_end_at_the_touches_where_there_is_no_noise(forward):
    whole = folded(forward)
    measured = whole.read(APART)[0]
    begun = APART + np.array([[6.0, -4.0, 0.2], [-5.0, 5.0, -0.4], [3.0, 6.0, 0.3]])
    found = fit_number(whole.table, measured, begun, TOUCHES, 10)
    # The wide prior that holds them on the plate moves them by a thousandth of their σ.
    np.testing.assert_allclose(found, APART, atol=0.02)


@pytest.mark.slow
@pytest.mark.parametrize("number", [0, 1, 2, 3])
def test_it_finds_touches_that_stand_apart(reader, forward, number):
    rng, truth = np.random.default_rng(number), APART[:number]
    truth = truth[np.argsort(truth[:, 0])]
    measured = rng.standard_normal(200) + (forward.read(truth)[0] if number else 0.0)
    found = reader.read(measured)
    assert found.count == number
    assert not found.reason
    assert found.probability[number] > 0.9
    sigma = np.sqrt(np.diag(found.estimate.covariance)).reshape(-1, 3)
    assert (np.abs(found.start - truth) < 5.0 * sigma).all()
    if number:
        bound = np.sqrt(np.diag(models.covariance(forward.read(truth)[1]))).reshape(-1, 3)
        assert (sigma < 1.5 * bound).all()


def test_more_touches_than_it_is_asked_for_are_not_known(net, forward):
    reader = models.prepare_reader(net, forward, 1)
    found = reader.read(forward.read(APART)[0])
    assert found.count <= 1
    assert "seen nothing like this frame" in found.reason
    assert found.estimate.result is models.Result.UNRESOLVABLE
    assert len(found.start) == 0


def test_what_no_touches_do_is_not_known(reader):
    found = reader.read(np.random.default_rng(0).normal(0.0, 30.0, 200))
    assert "seen nothing like this frame" in found.reason


def test_a_measurement_that_is_none_is_refused(reader):
    with pytest.raises(ValueError, match=r"must be \(200,\) finite numbers, got \(10,\)"):
        reader.read(np.zeros(10))
    with pytest.raises(ValueError, match="finite"):
        reader.read(np.full(200, np.nan))


def test_another_plate_another_bench_and_too_many_touches_are_refused(net, forward):
    with pytest.raises(ValueError, match="knows 1 to 4 touches, got max_touches 5"):
        models.prepare_reader(net, forward, 5)
    other = models.bench_forward(replace(BENCH, plate=replace(PLATE, size=(254.0, 180.0))))
    with pytest.raises(ValueError, match="a plate of 254 × 254 mm, and this one has 254 × 180 mm"):
        models.prepare_reader(net, other)
    soft = models.bench_forward(replace(BENCH, noise=0.001))
    with pytest.raises(ValueError, match="train another"):
        models.prepare_reader(net, soft)


def test_a_mixture_says_the_same_as_its_draws():
    rng = np.random.default_rng(2)
    out = rng.normal(0.0, 0.4, (2, 40))
    factors = np.array([np.diag([0.5, 0.7, 0.05]), [[1, 0, 0], [0.4, 1, 0], [0.1, -0.2, 0.3]]])
    found = mixture(out, APART[:2], factors)
    drawn = found.draw(rng, 40000)
    mean, covariance = found.moments()
    np.testing.assert_allclose(found.weight.sum(axis=1), 1.0)
    for i in range(2):
        sampled = np.cov(drawn[:, i].T)
        scale = np.sqrt(np.outer(np.diag(covariance[i]), np.diag(covariance[i])))
        assert (np.abs(drawn[:, i].mean(axis=0) - mean[i]) < 0.03 * np.sqrt(np.diag(scale))).all()
        assert (np.abs(sampled - covariance[i]) < 0.2 * scale).all()
    place = APART[:2] + 0.3
    np.testing.assert_allclose(found.below(place), (drawn < place).mean(axis=0), atol=0.01)


def test_no_touch_has_no_scatter():
    none = Mixture(np.empty((0, 1)), np.empty((0, 1, 3)), np.empty((0, 1, 3, 3)))
    mean, covariance = none.moments()
    assert mean.shape == (0, 3)
    assert covariance.shape == (0, 3, 3)


def test_torch_and_numpy_run_the_same_net():
    torch = pytest.importorskip("torch")
    weights = first_weights(np.random.default_rng(1))
    tensors = {name: torch.tensor(array) for name, array in weights.items()}
    for hidden, out, size in (
        (PROPOSE, "propose", 513),
        (COUNT, "count", 32),
        (TOUCH, "touch", 27),
    ):
        x = np.random.default_rng(3).normal(0.0, 1.0, (4, size)).astype(np.float32)
        there = run_torch(tensors, hidden, out, torch.tensor(x)).numpy()
        np.testing.assert_allclose(run(weights, hidden, out, x), there, rtol=1e-4, atol=1e-4)


def test_another_runtime_reads_the_same_numbers(net, tmp_path):
    runtime = pytest.importorskip("onnxruntime")
    path = tmp_path / "net.onnx"
    models.write_touch_onnx(path, net)
    session = runtime.InferenceSession(str(path))
    rng = np.random.default_rng(4)
    given = {"maps": (3, 513), "fits": (2, 32), "touches": (4, 27)}
    given = {name: rng.normal(0.0, 1.0, size).astype(np.float32) for name, size in given.items()}
    found = session.run(["proposals", "numbers", "scatter"], given)
    ways = (("maps", PROPOSE, "propose"), ("fits", COUNT, "count"), ("touches", TOUCH, "touch"))
    for there, (name, hidden, out) in zip(found, ways, strict=True):
        here = run(net.weights, hidden, out, given[name])
        np.testing.assert_allclose(there, here, rtol=1e-4, atol=1e-4)


def test_a_training_that_was_stopped_goes_on_as_if_it_had_not(trained, tmp_path):
    class StoppedError(Exception):
        pass

    def stop(step, _):
        if step == 4:
            raise StoppedError

    place = models.Checkpoint(tmp_path / "part.npz", 1)
    with pytest.raises(StoppedError):
        models.train_touch_net(BENCH, TOUCHES, TINY, place, stop)
    steps = []
    after = models.train_touch_net(BENCH, TOUCHES, TINY, place, lambda step, _: steps.append(step))
    assert steps == [4, 5]  # the step in which it was stopped was not kept
    np.testing.assert_array_equal(after.history, trained.history)
    for name, array in trained.net.weights.items():
        np.testing.assert_array_equal(after.net.weights[name], array)


def test_a_stored_net_reads_the_same(trained, tmp_path):
    path = tmp_path / "net.npz"
    models.save_touch_net(path, trained.net)
    again = models.load_touch_net(path)
    assert again.touches == TOUCHES
    assert again.about["recipe"]["seed"] == 5
    for name, array in trained.net.weights.items():
        np.testing.assert_array_equal(again.weights[name], array)


def test_a_damaged_file_another_version_and_none_at_all_are_refused(net, tmp_path, monkeypatch):
    path = tmp_path / "net.npz"
    with pytest.raises(FileNotFoundError, match="touchplate train touch-net"):
        models.load_touch_net(path)
    models.save_touch_net(path, net)
    whole = path.read_bytes()
    for broken in (b"", whole[: len(whole) // 2], whole[:-400] + bytes(400), b"no net"):
        path.write_bytes(broken)
        with pytest.raises(ValueError, match="damaged"):
            models.load_touch_net(path)
    weights = net.weights | {"propose.bias": np.full_like(net.weights["propose.bias"], np.nan)}
    models.save_touch_net(path, replace(net, weights=weights))
    with pytest.raises(ValueError, match="damaged"):
        models.load_touch_net(path)
    monkeypatch.setattr("models.touch_net.store.VERSION", 2)
    models.save_touch_net(path, net)
    monkeypatch.undo()
    with pytest.raises(ValueError, match="of version 2"):
        models.load_touch_net(path)
