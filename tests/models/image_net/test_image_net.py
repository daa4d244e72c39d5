"""The image net: rendered pairs, training that goes on, files, ONNX, and what it does not know."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import pytest

import dic
import models
from models.field_net.plates import draw_plates
from models.field_net.random_speckle import draw_speckle
from models.field_net.rendered_pairs import draw_pairs
from models.image_net import image_net
from models.image_net.features import INPUTS, STRIDE, WINDOWS, pair_features
from models.image_net.loader import AGAIN, Loader
from models.image_net.refine import evaluate, refine
from models.image_net.warped_pair import CELL, first_motion, image_pair
from models.nets.checkpoint import Checkpoint

torch = pytest.importorskip("torch")

TINY = models.ImageNetRecipe(steps=3, seed=3, pairs=1, side=96, patterns=1, plates=1, horizon=3)
DEVICES = ["cpu", pytest.param("cuda", marks=pytest.mark.gpu)]
SHAPE = (138, 177)  # px
SPOT = 1.8  # px
NOISE = 2.0  # grey levels


@pytest.fixture(scope="module")
def trained():
    return models.train_image_net(TINY)


@pytest.fixture(scope="module")
def shipped():
    return models.shipped_image_net()


def speckle(origin=None, seed=1):
    """Gaussian spots in closed form, read where they came from: no pattern of the training."""
    rng = np.random.default_rng(seed)
    y, x = np.indices(SHAPE).astype(float)
    if origin is not None:
        x, y = origin(x, y)
    total = np.zeros(SHAPE)
    size = np.array(SHAPE[::-1]) + 40
    for (left, top), height in zip(
        rng.uniform(0, 1, (2600, 2)) * size - 20, rng.choice((-1.0, 1.0), 2600), strict=True
    ):
        near = np.s_[
            max(int(top) - 9, 0) : max(int(top) + 10, 0),
            max(int(left) - 9, 0) : max(int(left) + 10, 0),
        ]
        away = np.square(x[near] - left) + np.square(y[near] - top)
        total[near] += height * np.exp(-away / (2 * SPOT**2))
    return 128 + 60 * total


def seen(image, seed):
    noise = np.random.default_rng(seed).normal(0, NOISE, image.shape)
    return np.clip(np.rint(image + noise), 0, 255).astype(np.uint8)


def waved(x, y):
    """Where the material came from under v = 0.4 cos(2π y/17), u = 0.2: by iteration."""
    there = y
    for _ in range(30):
        there = y - 0.4 * np.cos(2 * np.pi * there / 17)
    return x - 0.2, there


@pytest.fixture(scope="module")
def pair():
    return seen(speckle(), 5), seen(speckle(waved), 6)


def test_a_rendered_pair_has_the_displacement_that_it_states():
    rng = np.random.default_rng(2)
    pool, plates = draw_speckle(1, 224, rng, "cpu"), draw_plates(1, 40, rng)
    off, size = [], []
    for drawn in draw_pairs(pool, plates, 8, 96, rng):
        ref = dic.prepare(drawn.first, 15, roi=drawn.roi)
        found = dic.correlate(ref, drawn.second)
        row, column = ((found.xy[:, ::-1] - (CELL - 1) / 2) / CELL).round().astype(int).T
        true = drawn.truth[:, row, column]
        here = found.valid & (np.ptp(drawn.truth, axis=(1, 2)).max() < 0.5)
        off.append(np.abs(np.stack([found.u, found.v]) - true)[:, here].ravel())
        size.append(np.abs(true)[:, here].ravel())
    # A subset knows it to its noise, and to what it flattens of short waves.
    assert np.median(np.concatenate(off)) < 0.03
    assert np.median(np.concatenate(size)) > 0.2


def test_what_the_windows_read_is_the_motion_left_over(pair):
    """Of an image that has moved by a known shift, from a start that is wrong by a known amount."""
    first, moved = speckle(), speckle(lambda x, y: (x - 0.12, y + 0.07))
    ref = dic.prepare(first)
    motion = first_motion(dic.correlate(ref, moved), SHAPE)
    wrong = motion.pixels + np.array([0.05, -0.03], np.float32).reshape(2, 1, 1)
    found = pair_features(image_pair(ref, moved), replace(motion, pixels=wrong))
    left = found.windows[:, : len(WINDOWS), 8:-8, 8:-8].mean(axis=(2, 3))
    assert np.abs(left - [[-0.05], [0.03]]).max() < 3e-3  # differences of five pixels lose 1 to 3 %
    means = found.windows[:, len(WINDOWS) :, 20:-20, 20:-20]
    assert np.abs(means).max() < 3e-3  # the motion so far is even
    assert found.inputs.shape[0] == INPUTS
    assert not any(n % STRIDE for n in found.inputs.shape[1:])


def test_light_that_changes_changes_little_of_what_the_net_reads():
    first, moved = speckle(), speckle(lambda x, y: (x - 0.12, y + 0.07))
    ref = dic.prepare(first)
    motion = first_motion(dic.correlate(ref, moved), SHAPE)
    x = np.arange(SHAPE[1])
    plain, lit = (
        pair_features(image_pair(ref, image), motion)
        for image in (moved, moved * (0.8 + 0.001 * x) + 9)
    )
    off = (plain.windows - lit.windows)[:, 3, 8:-8, 8:-8]
    assert np.sqrt(np.mean(off**2)) < 3e-3


def test_a_loader_makes_each_group_once_and_only_while_it_is_needed():
    made = []

    def make(number):
        made.append(number)
        return number

    with ThreadPoolExecutor(1) as thread:
        loader = Loader(make, thread)
        batches = [loader.batch(step) for step in range(50)]
        later = Loader(make, thread).batch(49)
    assert batches[49] == later == [49 - lag for lag in AGAIN]
    assert made[:51] == list(range(51))


def test_a_training_that_was_stopped_goes_on_to_the_same_weights(tmp_path, trained):
    place = Checkpoint(tmp_path / "part.npz", 2)

    def stop(step, _):
        if step == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        models.train_image_net(TINY, Checkpoint(place.path, 1), stop)
    steps = []
    after = models.train_image_net(TINY, place, lambda step, _: steps.append(step))
    assert steps == [2, 3]
    weights = trained.net.weights
    assert all(np.array_equal(after.net.weights[name], w) for name, w in weights.items())
    assert np.array_equal(after.history, trained.history)


def test_a_net_is_stored_as_it_is_and_a_damaged_file_is_refused(tmp_path, trained):
    path = tmp_path / "net.npz"
    models.save_image_net(path, trained.net)
    again = models.load_image_net(path)
    assert all(np.array_equal(again.weights[n], w) for n, w in trained.net.weights.items())
    assert again.about["seed"] == 3
    whole = path.read_bytes()
    for damaged in (whole[: len(whole) // 2], b"", whole.replace(b"down0a", b"down9a")):
        path.write_bytes(damaged)
        with pytest.raises(ValueError, match="damaged"):
            models.load_image_net(path)
    weights = trained.net.weights | {"out.bias": np.full_like(again.weights["out.bias"], np.nan)}
    models.save_image_net(path, replace(trained.net, weights=weights))
    with pytest.raises(ValueError, match="damaged"):
        models.load_image_net(path)
    with pytest.raises(FileNotFoundError, match="touchplate train image-net"):
        models.load_image_net(tmp_path / "none.npz")


def test_a_net_is_read_by_what_its_file_says_that_it_is(tmp_path, trained, shipped):
    models.save_image_net(tmp_path / "image.npz", trained.net)
    models.save_field_net(tmp_path / "field.npz", models.shipped_net())
    models.save_touch_net(tmp_path / "touch.npz", models.shipped_touch_net())
    image, field = (
        models.load_displacement_net(tmp_path / f"{name}.npz") for name in ("image", "field")
    )
    assert isinstance(image, models.ImageNet)
    assert isinstance(field, models.FieldNet)
    assert models.net_format(tmp_path / "touch.npz") == "touchplate touch net"
    with pytest.raises(ValueError, match="measures no displacement"):
        models.load_displacement_net(tmp_path / "touch.npz")
    np.savez(tmp_path / "other.npz", u=np.ones(3))
    with pytest.raises(ValueError, match="no net; train one"):
        models.load_displacement_net(tmp_path / "other.npz")


def test_onnx_says_the_same_numbers(tmp_path, shipped, pair):
    runtime = pytest.importorskip("onnxruntime")
    models.write_image_onnx(tmp_path / "net.onnx", shipped)
    session = runtime.InferenceSession(str(tmp_path / "net.onnx"))
    ref = dic.prepare(pair[0])
    motion = first_motion(dic.adaptive_field(ref, pair[1]), SHAPE)
    inputs = pair_features(image_pair(ref, pair[1]), motion).inputs[None]
    found = session.run(None, {"pair": inputs})[0]
    ours = evaluate(shipped, inputs)
    assert np.abs(found - ours).max() < 1e-4 * max(np.abs(ours).max(), 1.0)


@pytest.mark.parametrize("device", DEVICES)
def test_a_device_says_the_same_numbers(pair, shipped, device):
    ref = dic.prepare(pair[0])
    motion = first_motion(dic.adaptive_field(ref, pair[1]), SHAPE)
    inputs = pair_features(image_pair(ref, pair[1]), motion).inputs[None]
    here, there = (evaluate(shipped, inputs, place) for place in ("cpu", device))
    assert np.abs(there - here).max() < 1e-4 * max(np.abs(here).max(), 1.0)


def test_weights_that_cannot_be_read_leave_the_classical_field_and_say_so(
    tmp_path, monkeypatch, trained, pair
):
    ref, path = dic.prepare(pair[0]), tmp_path / "net.npz"
    classical = dic.adaptive_field(ref, pair[1])
    models.save_image_net(path, trained.net)
    whole = path.read_bytes()
    for version, content, why in ((2, whole, "version 1"), (1, whole[:500], "damaged")):
        path.write_bytes(content)
        monkeypatch.setattr("models.image_net.store.VERSION", version)
        monkeypatch.setattr(image_net, "SHIPPED", path)
        image_net.shipped_image_net.cache_clear()
        found = models.image_net_field(ref, pair[1])
        assert not found.by_net.any()
        assert np.array_equal(found.field.v, classical.v, equal_nan=True)
        assert "adaptive field" in found.reason
        assert why in found.reason
        assert "install touchplate again" in found.reason
    image_net.shipped_image_net.cache_clear()


def test_images_beyond_what_it_has_seen_leave_the_classical_field_and_say_so(pair, shipped):
    ref = dic.prepare(pair[0])
    other = seen(speckle(seed=9), 7)  # another pattern: nothing to follow
    found = models.image_net_field(ref, other, shipped)
    assert not found.by_net.any()
    assert "adaptive field" in found.reason
    hidden = pair[1].copy()
    hidden[40:100, 60:130] = 90  # no pattern
    found = models.image_net_field(ref, hidden, shipped)
    inside = np.all(np.abs(found.field.xy - (95, 70)) < (25, 20), axis=1)
    assert not found.by_net[inside].any()
    assert "adaptive field" in found.reason
    with pytest.raises(ValueError, match="deformed image"):
        models.image_net_field(ref, np.where(pair[1] > 200, np.nan, pair[1].astype(float)), shipped)
    with pytest.raises(ValueError, match="grid"):
        models.image_net_field(dic.prepare(pair[0], points=[[50, 50]]), pair[1], shipped)
    small = dic.prepare(pair[0][:48, :50], 11)
    assert "too small" in models.image_net_field(small, pair[1][:48, :50], shipped).reason


def test_a_net_that_says_nonsense_is_not_believed(pair, shipped):
    ref = dic.prepare(pair[0])
    classical = dic.adaptive_field(ref, pair[1])
    wild = {name: 4 * array for name, array in shipped.weights.items()}
    found = models.image_net_field(ref, pair[1], replace(shipped, weights=wild))
    off = np.hypot(found.field.u - classical.u, found.field.v - classical.v)
    assert np.nanmax(off[found.by_net], initial=0.0) < 0.5
    nothing = np.zeros_like(shipped.low)
    found = models.image_net_field(ref, pair[1], replace(shipped, low=nothing, high=nothing))
    assert not found.by_net.any()
    assert found.reason.startswith("100.0%")
    assert "it has not seen the like" in found.reason
    assert "changes nothing" not in found.reason


def short_wave(period):
    """Where the material came from under v = 0.4 cos(2π y/period), and that motion of points."""

    def origin(x, y):
        there = y
        for _ in range(60):
            there = y - 0.4 * np.cos(2 * np.pi * there / period)
        return x, there

    def motion(xy):
        return np.column_stack([0 * xy[:, 0], 0.4 * np.cos(2 * np.pi * xy[:, 1] / period)])

    return origin, motion


def both(shipped, period):
    """Errors (N, 2) of the net's field and of the adaptive one, and the net's own field."""
    origin, motion = short_wave(period)
    ref, image = dic.prepare(seen(speckle(), 5)), seen(speckle(origin), 6)
    found, classical = models.image_net_field(ref, image, shipped), dic.adaptive_field(ref, image)
    errors = [np.column_stack([f.u, f.v]) - motion(f.xy) for f in (found.field, classical)]
    return found, *errors, found.field.valid & classical.valid


@pytest.mark.parametrize("device", DEVICES)
def test_a_field_by_the_net_is_the_same_on_a_device(shipped, device):
    image, moved = seen(speckle(), 5), seen(speckle(short_wave(10)[0]), 6)
    here = models.image_net_field(dic.prepare(image), moved, shipped)
    there = models.image_net_field(dic.prepare(image), moved, shipped, device)
    assert np.mean(there.by_net != here.by_net) < 0.01
    same = there.by_net & here.by_net
    assert same.mean() > 0.2
    assert np.abs(there.field.v - here.field.v)[same].max() < 1e-4  # px
    # A reference on a device begins a little beside, and passes end within noise of one another.
    found = models.image_net_field(dic.prepare(image, device=device), moved, shipped)
    known = found.by_net & here.by_net
    assert known.mean() > 0.1
    apart = np.abs(found.field.v - here.field.v) / here.field.sigma_v
    assert np.median(apart[known]) < 0.5
    with pytest.raises(ValueError, match="device"):
        models.image_net_field(dic.prepare(image), moved, shipped, "nowhere")


def test_it_resolves_a_wave_of_two_tiles_better_than_the_adaptive_field(shipped):
    found, net, before, known = both(shipped, 10)
    here = found.by_net & known
    assert here.mean() > 0.25
    assert np.abs(net[here]).mean() < 0.9 * np.abs(before[here]).mean()
    stated = np.column_stack([found.field.sigma_u, found.field.sigma_v])[here]
    assert 0.6 < np.sqrt(np.mean(stated**2) / np.mean(net[here] ** 2)) < 1.7


def test_strain_of_what_it_resolves_is_of_its_own_slopes_and_states_its_error(shipped):
    """Windows of points would flatten the wave and state a hundredth of what they lose."""
    found, _, _, known = both(shipped, 12)
    here = found.by_net & known
    eyy = dic.strain(found.field)
    wave = -0.4 * 2 * np.pi / 12 * np.sin(2 * np.pi * found.field.xy[:, 1] / 12)
    error, stated = (eyy.eyy - wave)[here], eyy.sigma[here, 1]
    assert np.sqrt(np.mean(error**2)) < 0.75 * np.sqrt(np.mean(wave[here] ** 2))
    assert 0.5 < np.sqrt(np.mean(stated**2) / np.mean(error**2)) < 2
    rescued = found.by_net & ~known  # of which the adaptive field has no σ
    assert np.isfinite(eyy.sigma[eyy.valid]).all()
    assert rescued.any()


def test_where_the_net_adds_nothing_strain_and_its_sigma_are_those_of_the_adaptive_field(shipped):
    ref = dic.prepare(seen(speckle(), 5))
    image = seen(speckle(lambda x, y: (x - 0.3, y + 0.2)), 6)
    found, classical = models.image_net_field(ref, image, shipped), dic.adaptive_field(ref, image)
    assert found.by_net.mean() < 0.1
    assert "changes nothing" in found.reason
    ours, theirs = dic.strain(found.field), dic.strain(classical)
    same = ~found.by_net
    assert np.array_equal(ours.exx[same], theirs.exx[same], equal_nan=True)
    assert np.array_equal(ours.sigma[same], theirs.sigma[same], equal_nan=True)


@pytest.mark.parametrize("stretch", [0.1, 0.15])
def test_a_sheet_that_is_stretched_by_much_is_measured_to_its_rim(shipped, stretch):
    def moved(x, y):
        return (x + 88 * stretch) / (1 + stretch), y

    ref, image = dic.prepare(seen(speckle(), 5)), seen(speckle(moved), 6)
    found, classical = models.image_net_field(ref, image, shipped), dic.adaptive_field(ref, image)
    off, before = (
        np.hypot(f.u - stretch * (f.xy[:, 0] - 88), f.v)[found.field.valid & classical.valid]
        for f in (found.field, classical)
    )
    assert off.max() < before.max() + 0.03


def test_the_motion_of_a_field_goes_on_beyond_its_points():
    """Of a plane of which a rim and a middle were not measured, at every pixel."""
    ref = dic.prepare(speckle())
    found = dic.correlate(ref, speckle())
    x, y = ref.xy.T
    lost = (x > 120) | ((np.abs(x - 60) < 12) & (np.abs(y - 60) < 18))
    plane = replace(
        found,
        u=np.where(lost, np.nan, 0.1 * x - 0.02 * y),
        v=np.where(lost, np.nan, 0.05 * y),
        gradient=np.tile([[0.1, -0.02], [0.0, 0.05]], (len(x), 1, 1)),
        status=np.where(lost, dic.Status.OUTSIDE, dic.Status.OK).astype(np.int8),
    )
    rows, columns = np.indices(SHAPE)
    true = np.stack([0.1 * columns - 0.02 * rows, 0.05 * rows])
    assert np.abs(first_motion(plane, SHAPE).pixels - true).max() < 1e-4


def test_where_it_leaves_more_of_the_images_the_adaptive_field_stands(shipped):
    """A wave of 17 px, which the adaptive field holds to its noise, and the net would flatten."""
    found, net, before, known = both(shipped, 17)
    assert found.by_net.mean() < 0.2
    assert np.abs(net[known]).mean() < 1.02 * np.abs(before[known]).mean()


def test_an_roi_and_odd_sides_are_no_error(pair, shipped):
    roi = np.ones((137, 175), bool)
    roi[50:90, 60:100] = False
    images = [image[:137, :175] for image in pair]
    ref = dic.prepare(images[0], roi=roi)
    found = models.image_net_field(ref, images[1], shipped)
    assert not found.field.valid[~roi[tuple(found.field.xy.astype(int).T[::-1])]].any()
    assert np.array_equal(np.isfinite(found.field.u), found.field.valid)


def test_a_mask_over_more_than_half_of_the_images_does_not_switch_it_off(shipped):
    """The part that is looked at is measured as it is without the mask, at 60 % of the image."""
    origin, _ = short_wave(10)
    images = seen(speckle(), 5), seen(speckle(origin), 6)
    roi = np.ones(SHAPE, bool)
    roi[:, round(0.4 * SHAPE[1]) :] = False
    own = []
    for mask in (None, roi):
        found = models.image_net_field(dic.prepare(images[0], roi=mask), images[1], shipped)
        here = found.field.valid & (found.field.xy[:, 0] < 45)
        own.append(found.by_net[here].mean())
    assert own[0] > 0.2
    assert own[1] > 0.5 * own[0]


def test_cells_of_a_pair_keep_its_size(pair, shipped):
    ref = dic.prepare(pair[0])
    motion = first_motion(dic.adaptive_field(ref, pair[1]), SHAPE)
    cells = refine(shipped, image_pair(ref, pair[1]), motion)
    assert cells.motion.shape == (2, SHAPE[0] // CELL, SHAPE[1] // CELL)
    assert cells.sigma.shape == cells.motion.shape


def test_two_trainings_of_one_seed_say_nearly_the_same():
    here, again = (models.train_image_net(TINY) for _ in range(2))
    assert np.allclose(here.history, again.history, rtol=1e-2)


@pytest.mark.gpu
def test_a_training_on_a_gpu_says_nearly_what_one_on_a_cpu_does(monkeypatch):
    here = models.train_image_net(TINY)
    monkeypatch.setattr(torch.cuda, "is_available", lambda: False)
    on_cpu = models.train_image_net(TINY)
    assert np.allclose(here.history, on_cpu.history, rtol=1e-2)
