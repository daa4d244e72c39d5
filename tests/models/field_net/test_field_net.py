"""The field net: drawn fields, training that goes on, files, ONNX, and what it does not know."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.ndimage import fourier_shift, gaussian_filter, map_coordinates

import dic
import models
from models.field_net.drawn_fields import draw_field, draw_noise
from models.field_net.field_net import evaluate
from models.field_net.plates import draw_plates
from models.field_net.random_speckle import draw_speckle
from models.field_net.rendered import rendered_batch, tile_truth
from models.field_net.rendered_pairs import draw_pairs
from models.field_net.unet import INPUTS, STRIDE
from models.nets.checkpoint import Checkpoint

torch = pytest.importorskip("torch")

DEVICES = ["cpu", pytest.param("cuda", marks=pytest.mark.gpu)]
SHAPE = (44, 52)  # tiles
TINY = models.FieldNetRecipe(
    steps=3, seed=3, pairs=1, side=32, plates=1, rendered=2, rendered_side=160, patterns=1
)


@pytest.fixture(scope="module")
def trained():
    return models.train_field_net(TINY)


def seen(truth, noise, seed, valid=None):
    """Tiles of drawn fields (2, R, C) with white noise."""
    rng = np.random.default_rng(seed)
    known = np.ones(truth.shape[1:], bool) if valid is None else valid
    return dic.denoised_tiles(truth + noise * rng.standard_normal(truth.shape), noise, known)


def waves():
    y, x = np.indices(SHAPE).astype(float)
    return np.stack([3.0 * np.cos(2 * np.pi * (x + y) / 12), np.sin(2 * np.pi * y / 25)])


def test_slopes_of_drawn_fields_are_their_derivatives():
    off = []
    for seed in range(30):
        values, torn = (
            (drawn := draw_field((40, 48), [], np.random.default_rng(seed))).values,
            drawn.torn,
        )
        if torn.any():
            continue
        # Fourth-order differences; waves of less than five tiles are beyond them.
        for axis, slope in ((1, values[1]), (0, values[2])):
            f = np.moveaxis(values[0], axis, 0)
            by_steps = (f[:-4] - 8 * f[1:-3] + 8 * f[3:-1] - f[4:]) / 12
            true = np.moveaxis(slope, axis, 0)[2:-2]
            off.append(np.abs(by_steps - true).mean() / (np.abs(true).mean() + 1e-3))
    assert np.median(off) < 0.01
    assert len(off) > 30


def test_slopes_of_plates_are_their_derivatives():
    plate = draw_plates(1, 96, np.random.default_rng(0))[0]
    assert np.abs(plate[0]).max() == pytest.approx(1.0)
    by_steps = np.gradient(plate[0], axis=(1, 0))
    for known, true in zip(by_steps, plate[1:], strict=True):
        assert np.abs(known - true)[2:-2, 2:-2].max() < 0.02 * np.abs(true).max()


def test_noise_is_drawn_about_one():
    noise = draw_noise(SHAPE, np.random.default_rng(1))
    assert noise.shape == SHAPE
    assert noise.min() > 0.3
    assert noise.max() < 3


@pytest.mark.slow
def test_rendered_images_have_the_displacement_and_slopes_that_they_state():
    """Subsets, which know nothing of the truth, find the same where it is smooth."""
    rng = np.random.default_rng(11)
    pool, plates = draw_speckle(1, 230, rng, "cpu"), draw_plates(1, 160, rng)
    off, spread = [], []
    for _ in range(8):
        pair = draw_pairs(pool, plates, 1, 160, rng)[0]
        found = dic.correlate(dic.prepare(pair.first, 21, roi=pair.roi), pair.second)
        tiles = dic.adaptive_tiles(dic.prepare(pair.first, 21, roi=pair.roi), pair.second, found)
        truth = tile_truth(pair, tiles)
        at = tiles.lattice.nearest(found.xy)
        smooth = np.abs(truth[:, 1:]).reshape(4, -1)[:, at].max(axis=0) < 0.02 * 5
        here = found.valid & smooth
        slopes = truth[:, 1:].reshape(2, 2, -1)[..., at] / 5  # px per px
        off.append((found.gradient - slopes.transpose(2, 0, 1))[here].ravel())
        spread.append((found.sigma_gradient)[here].ravel())
    off, spread = np.concatenate(off), np.concatenate(spread)
    assert len(off) > 1000
    assert abs(np.mean(off)) < 5e-4
    assert np.median(np.abs(off)) < 2 * np.median(spread)


def test_a_rendered_batch_states_what_its_adaptive_fields_lack():
    rng = np.random.default_rng(12)
    pool, plates = draw_speckle(1, 230, rng, "cpu"), draw_plates(1, 160, rng)
    batch = rendered_batch(pool, plates, 2, 160, rng)
    assert batch.inputs.shape[:2] == (4, INPUTS)
    assert batch.error.shape == (4, 3, *batch.inputs.shape[2:])
    assert not any(n % STRIDE for n in batch.inputs.shape[2:])
    counted = batch.counted[:, 0] > 0
    assert counted.mean() > 0.5
    assert 0.3 < np.median(np.abs(batch.error[:, 0][counted])) < 3.0


def test_a_training_that_was_stopped_goes_on_to_the_same_weights(tmp_path, trained):
    place = Checkpoint(tmp_path / "part.npz", 2)

    def stop(step, _):
        if step == 4:  # of those on images the first
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        models.train_field_net(TINY, place, stop)
    steps = []
    after = models.train_field_net(TINY, place, lambda step, _: steps.append(step))
    assert steps == [3, 4, 5]
    assert all(np.array_equal(after.weights[name], w) for name, w in trained.weights.items())
    assert np.array_equal(after.history, trained.history)


def test_a_net_is_stored_as_it_is_and_a_damaged_file_is_refused(tmp_path, trained):
    path = tmp_path / "net.npz"
    models.save_field_net(path, trained.net)
    again = models.load_field_net(path)
    assert all(np.array_equal(again.weights[name], w) for name, w in trained.weights.items())
    assert again.about["seed"] == 3
    assert again.about["cpu_seconds"] >= 0
    whole = path.read_bytes()
    for damaged in (whole[: len(whole) // 2], b"", whole.replace(b"down0a", b"down9a")):
        path.write_bytes(damaged)
        with pytest.raises(ValueError, match="damaged"):
            models.load_field_net(path)
    with pytest.raises(FileNotFoundError, match="touchplate train dic-net"):
        models.load_field_net(tmp_path / "none.npz")


def test_weights_that_are_no_numbers_are_refused(tmp_path, trained):
    weights = trained.net.weights | {"out.bias": np.full(6, np.nan, np.float32)}
    models.save_field_net(tmp_path / "net.npz", replace(trained.net, weights=weights))
    with pytest.raises(ValueError, match="damaged"):
        models.load_field_net(tmp_path / "net.npz")


def test_a_net_of_another_version_is_refused(tmp_path, trained, monkeypatch):
    monkeypatch.setattr("models.field_net.store.VERSION", 7)
    models.save_field_net(tmp_path / "net.npz", trained.net)
    monkeypatch.undo()
    with pytest.raises(ValueError, match="version 7"):
        models.load_field_net(tmp_path / "net.npz")


def test_onnx_says_the_same_numbers(tmp_path):
    runtime = pytest.importorskip("onnxruntime")
    net = models.shipped_net()
    models.write_field_onnx(tmp_path / "net.onnx", net)
    session = runtime.InferenceSession(str(tmp_path / "net.onnx"))
    inputs = models.net_inputs(seen(waves(), np.ones((2, *SHAPE)), 2))
    found = session.run(None, {"tiles": inputs})[0]
    assert np.abs(found - evaluate(net, inputs)).max() < 1e-4


@pytest.mark.parametrize("device", DEVICES)
def test_a_device_says_the_same_numbers(device):
    net, inputs = models.shipped_net(), models.net_inputs(seen(waves(), np.ones((2, *SHAPE)), 2))
    assert np.abs(evaluate(net, inputs, device) - evaluate(net, inputs)).max() < 1e-4


def shifted(pattern):
    """Pattern that has moved by u = 0.4, v = -0.7 px, and repeats."""
    return np.fft.ifft2(fourier_shift(np.fft.fft2(pattern), (-0.7, 0.4))).real


@pytest.mark.parametrize("device", DEVICES)
def test_a_field_by_the_net_is_the_same_on_a_device(device):
    rng = np.random.default_rng(5)
    pattern = 128 + 250 * gaussian_filter(rng.normal(0, 1, (130, 170)), 1.8, mode="wrap")
    image, moved = (each + rng.normal(0, 2, each.shape) for each in (pattern, shifted(pattern)))
    here = models.net_field(dic.prepare(image), moved)
    there = models.net_field(dic.prepare(image), moved, device=device)
    follows = models.net_field(dic.prepare(image, device=device), moved)  # that of the reference
    for found, atol in ((there, 1e-5), (follows, 1e-3)):
        assert np.mean(found.by_net != here.by_net) < 0.01
        both = found.by_net & here.by_net
        assert both.sum() > 100
        assert np.abs(found.field.v - here.field.v)[both].max() < atol  # px


def test_a_device_that_is_not_there_is_refused():
    image = np.random.default_rng(5).normal(128, 40, (96, 120))
    for name in ("nowhere", 3, "cuda:99"):
        with pytest.raises(ValueError, match="device"):
            models.net_field(dic.prepare(image), image, device=name)


def test_what_it_has_not_seen_stays_the_adaptive_field():
    tiles = seen(waves(), np.ones((2, *SHAPE)), 3)
    net = models.shipped_net()
    nothing = np.zeros_like(net.low)
    better, by_net = models.correct_tiles(tiles, replace(net, low=nothing, high=nothing))
    assert not by_net.any()
    assert np.array_equal(better.values, tiles.values, equal_nan=True)
    wild = {name: 30 * array for name, array in net.weights.items()}
    better, by_net = models.correct_tiles(tiles, replace(net, weights=wild))
    off = np.abs(better.values - tiles.values)[:, 0][:, by_net]
    assert np.all(off <= 6 * tiles.sigma[:, 0][:, by_net])


def test_the_shipped_net_is_no_worse_than_the_adaptive_field_and_states_its_error():
    net = models.shipped_net()
    assert net.about["seed"] == models.FieldNetRecipe().seed
    plates = draw_plates(2, 64, np.random.default_rng(50))
    errors, stated = [], []
    for seed in range(50, 62):
        rng = np.random.default_rng(seed)
        drawn = [draw_field(SHAPE, plates, rng) for _ in range(2)]
        noise = np.stack([draw_noise(SHAPE, rng)] * 2)
        truth, torn = np.stack([d.values for d in drawn]), drawn[0].torn | drawn[1].torn
        tiles = seen(truth[:, 0], noise, seed, ~torn)
        better, _ = models.correct_tiles(tiles, net)
        before, after = (np.square(t.values[:, 0] - truth[:, 0]) for t in (tiles, better))
        errors.append((np.nanmean(before), np.nanmean(after)))
        stated.append(np.nanmean(np.square(better.sigma[:, 0])) / np.nanmean(after))
    before, after = np.array(errors).T
    assert np.sqrt(np.max(after / before)) < 1.05
    assert 0.7 < np.sqrt(np.median(stated)) < 1.4


def test_a_hole_and_a_size_that_is_no_multiple_of_four_are_no_error():
    valid = np.ones(SHAPE, bool)
    valid[10:20, 12:30] = False
    truth = waves()[:, :43, :50]
    tiles = seen(truth, np.ones_like(truth), 4, valid[:43, :50])
    better, by_net = models.correct_tiles(tiles, models.shipped_net())
    assert by_net.shape == (43, 50)
    assert not by_net[12:18, 15:25].any()
    assert np.array_equal(np.isfinite(better.values), np.isfinite(tiles.values))


def test_weights_that_cannot_be_read_leave_the_adaptive_field_and_say_so(
    tmp_path, monkeypatch, trained
):
    image = np.random.default_rng(5).normal(128, 40, (96, 120))
    ref, path = dic.prepare(image), tmp_path / "net.npz"
    adaptive = dic.adaptive_field(ref, image + 1.0)
    models.save_field_net(path, trained.net)
    whole = path.read_bytes()
    for version, content, why in ((7, whole, "version 1"), (1, whole[:500], "damaged")):
        path.write_bytes(content)
        monkeypatch.setattr("models.field_net.store.VERSION", version)
        monkeypatch.setattr("models.field_net.field_net.SHIPPED", path)
        models.shipped_net.cache_clear()
        found = models.net_field(ref, image + 1.0)
        assert not found.by_net.any()
        assert np.array_equal(found.field.v, adaptive.v, equal_nan=True)
        assert np.array_equal(found.field.sigma_gradient, adaptive.sigma_gradient, equal_nan=True)
        assert "adaptive field" in found.reason
        assert why in found.reason
        assert "install touchplate again" in found.reason
    models.shipped_net.cache_clear()


def test_a_field_by_the_net_says_what_is_not_its_own():
    image = np.random.default_rng(5).normal(128, 40, (96, 120))
    found = models.net_field(dic.prepare(image), image + 1.0)
    assert found.field.valid.any()
    assert "points" in found.reason
    small = models.net_field(dic.prepare(image[:36, :40], 11), image[:36, :40])
    assert not small.by_net.any()
    assert "too small" in small.reason
    lost = models.net_field(dic.prepare(image), np.random.default_rng(6).normal(128, 40, (96, 120)))
    assert not lost.by_net.any()
    assert lost.reason.endswith("nothing was found again")
    with pytest.raises(ValueError, match="prepare a grid"):
        models.net_field(dic.prepare(image, points=[[50, 50]]), image)


def moved_speckle(field):
    """Two images of 180 x 230 px of spots whose material has moved by field(x, y), with noise."""
    rng, shape = np.random.default_rng(9), (180, 230)
    y, x = np.indices(shape).astype(float)
    first = gaussian_filter(rng.normal(0, 1, shape), 1.9)
    first *= 50 / first.std()
    from_x, from_y = x, y
    for _ in range(60):
        u, v = field(from_x, from_y)
        from_x, from_y = x - u, y - v
    second = map_coordinates(first, [from_y, from_x], order=5, mode="reflect")
    return [128 + image + rng.normal(0, 2.0, shape) for image in (first, second)]


def test_a_wave_shorter_than_it_has_seen_is_not_stated_to_be_known():
    def wave(x, y):
        return 0 * x, 0.5 * np.cos(2 * np.pi * (0.96 * y + 0.29 * x) / 14)

    first, second = moved_speckle(wave)
    found = models.net_field(dic.prepare(first), second)
    here = found.by_net & np.all(np.abs(found.field.xy - (115, 90)) < (95, 70), axis=1)
    off = np.column_stack([found.field.u, found.field.v])[here]
    off -= np.column_stack(wave(*found.field.xy[here].T))
    stated = np.column_stack([found.field.sigma_u, found.field.sigma_v])[here]
    assert here.sum() > 500
    assert 0.65 < np.sqrt(np.mean(stated**2) / np.mean(off**2)) < 2.0
    assert np.mean(np.abs(off / stated) > 3) < 0.04
    assert np.abs(off.mean(axis=0)).max() < 0.01  # px, bias


def test_bumps_stay_those_of_the_net():
    def bumps(x, y):
        far = (x - 90) ** 2 + (y - 80) ** 2, (x - 160) ** 2 + (y - 110) ** 2
        return 0.6 * np.exp(-far[0] / 800), 0.4 * np.exp(-far[1] / 400)

    first, second = moved_speckle(bumps)
    found = models.net_field(dic.prepare(first), second)
    assert found.field.valid.mean() > 0.99
    assert found.by_net[found.field.valid].mean() > 0.99
    stated = np.sqrt(np.mean(np.square([found.field.sigma_u, found.field.sigma_v])))
    off = np.column_stack([found.field.u, found.field.v]) - np.column_stack(
        bumps(*found.field.xy.T)
    )
    assert np.sqrt(np.nanmean(off**2)) < 0.012
    assert stated < 0.012
