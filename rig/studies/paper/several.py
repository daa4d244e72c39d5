"""Several touches: equal ones, ordered and not, doubled samples, and those with magnitudes."""

import time
from collections.abc import Callable, Iterator, Mapping
from typing import cast

import numpy as np

import models
import rig
from models import Dataset, Net, NetOptions, Recipe, matched_error, predict, train_net
from models.data import dataset
from models.nets import batches, loss, set_encoding
from models.nets.loss import Loss
from rig.report.figure import at_most
from rig.scene import Scene
from rig.studies.paper.sets import TESTED, Effort, Samples, pressed, several
from rig.studies.paper.table import Sample, store_curve
from rig.studies.study import part
from rig.system.arrays import F64, AnyArray

LOOKS = 40
"""At the losses on the way, for figure 4A."""

_RANDOM = {"dataset.places": "random", "dataset.seed": 1, "dataset.samples": TESTED}
"""What makes samples for a test of a scene's training samples."""


def two(effort: Effort) -> Samples:
    """Two equal touches, all pairs of the grid, equation 2 (figure S5)."""
    yield from _equal(2, {(32, 32): 20000, (64,) * 4: 20000, (256,) * 8: 5000}, "", effort)


def three(effort: Effort) -> Samples:
    """Three equal touches, equation 2 (figures 4A and 4B)."""
    steps = {(32, 32): 20000, (64,) * 4: 20000, (256,) * 8: 5000}
    yield from _equal(3, steps, "0.43", effort)


def unordered(effort: Effort) -> Samples:
    """Two and three equal touches reported without an order: a smooth net, fresh samples."""
    for touches, whole in ((2, 10000), (3, 30000)):
        pool, first, test = several(touches)
        for seed in range(effort.seeds):
            rng = np.random.default_rng(seed)
            stream = batches.superposed_batches(pool, touches, 512, rng)
            began = time.process_time()
            net, recipe = _smooth(first, test, touches, effort.epochs(whole), rng, stream)
            spent = time.process_time() - began
            found = _predicted(net, test, touches)
            error = matched_error(_places(test.targets, touches), found)[0]
            of_three = touches == 3
            below = 100 * float(np.mean(cast(F64, error.mean(axis=1)) < 0.8))
            for what, unit, paper, value, most in (
                ("loss of paired touches", "mm", "0.43", error.mean(), 0.43),
                ("median", "mm", "", np.median(error), None),
                ("below 0.8 mm", "%", "100", below, None),
                ("training", "CPU s", "70 h of a GPU", spent, 1800.0),
            ):
                system = f"{touches} equal touches, no order"
                bar = at_most(most) if of_three and most else None
                of = system, what, unit, paper if of_three else ""
                yield Sample(*of, recipe.epochs, seed, value, bar)


def _smooth(
    first: Dataset,
    test: Dataset,
    touches: int,
    epochs: int,
    rng: np.random.Generator,
    stream: Iterator[Dataset],
    judge: Loss | None = None,
) -> tuple[Net, Recipe]:
    """Return a net that gives touches as poles, and its recipe."""
    options = NetOptions((256,) * 4, "silu", "asinh", poles=touches)
    recipe = Recipe(epochs, 2e-3, "cosine", "scaled", check=epochs)
    return train_net(first, test, options, recipe, rng, loss=judge, batches=stream).net, recipe


def _places(targets: AnyArray, touches: int) -> AnyArray:
    return targets[:, : 2 * touches].reshape(-1, touches, 2)


def _predicted(net: Net, test: Dataset, touches: int) -> AnyArray:
    return _places(predict(net, test.strain), touches)


def _equal(
    touches: int, steps: Mapping[tuple[int, ...], int], paper: str, effort: Effort
) -> Samples:
    """Nets of the paper's three sizes on touches of equal force, streamed."""
    pool, first, test = several(touches)
    for layers, whole in steps.items():
        epochs = effort.epochs(whole)
        recipe = Recipe(epochs, 1e-3, "cosine", "scaled", check=max(epochs // LOOKS, 1))
        for seed in range(effort.seeds):
            rng = np.random.default_rng(seed)
            stream = batches.superposed_batches(pool, touches, 512, rng)
            options, judge = NetOptions(layers), loss.distance_loss(touches)
            done = train_net(first, test, options, recipe, rng, loss=judge, batches=stream)
            name = f"{len(layers)}×{layers[0]}"
            if touches == 3 and seed == 0:
                store_curve(name, recipe.check, done.history)
            yield from _pressed(
                f"{touches} equal touches", name, paper, recipe, seed, done.net, test
            )


def _pressed(
    system: str, name: str, paper: str, recipe: Recipe, seed: int, net: Net, test: Dataset
) -> Samples:
    touches = test.targets.shape[1] // 2
    true = test.targets.reshape(-1, touches, 2)
    predicted = predict(net, test.strain).reshape(-1, touches, 2)
    sorted_loss = np.linalg.norm(predicted - true, axis=2).mean()
    matched: F64 = matched_error(true, predicted)[0].mean(axis=1)
    largest, three = name == "8×256", touches == 3
    for what, value in (("loss", sorted_loss), ("loss of paired touches", matched.mean())):
        bar = at_most(1.2 * 0.43) if three and largest and value is sorted_loss else None
        of = system, f"{name}: {what}", "mm", paper if largest else ""
        yield Sample(*of, recipe.epochs, seed, value, bar)
    below = 100 * float(np.mean(matched < 0.8))
    of = system, f"{name}: below 0.8 mm", "%", "100" if three and largest else ""
    yield Sample(*of, recipe.epochs, seed, below)


def doubled(effort: Effort) -> Samples:
    """Two equal touches, each sample written both ways round (figure S6)."""
    pool, first, test = several(2)
    recipe = Recipe(effort.epochs(20000), 1e-3, "cosine", "scaled", check=20000)

    def both_ways(stream: Iterator[Dataset], rng: np.random.Generator) -> Iterator[Dataset]:
        for batch in stream:
            swap = rng.random(len(batch)) < 0.5
            turned = np.where(swap[:, None], np.roll(batch.targets, 2, axis=1), batch.targets)
            yield dataset.Dataset(batch.strain, turned)

    for seed in range(effort.seeds):
        rng = np.random.default_rng(seed)
        stream = batches.superposed_batches(pool, 2, 512, rng)
        for name, taken in (("sorted", stream), ("doubled", both_ways(stream, rng))):
            net = train_net(
                first,
                test,
                NetOptions((64,) * 4),
                recipe,
                rng,
                loss=loss.distance_loss(2),
                batches=taken,
            ).net
            predicted = predict(net, test.strain)
            apart = (predicted - test.targets).reshape(-1, 2, 2)
            value = np.linalg.norm(apart, axis=2).mean()
            paper = "fails" if name == "doubled" else ""
            what = f"4×64, {name} samples: loss"
            yield Sample("doubled samples (S6)", what, "mm", paper, recipe.epochs, seed, value)


def magnitudes(effort: Effort) -> Samples:
    """Two touches of magnitudes 1 to 10, equation 3 with three weights k (figure 4C)."""
    scene = rig.load("paper-two-magnitudes")
    drawn = rig.load("paper-two-magnitudes", _RANDOM)
    answer = models.superpose(pressed("paper-two-magnitudes")[1].strain)
    training, test = (_samples(bench, answer) for bench in (scene, drawn))
    recipe = Recipe(effort.epochs(10000), 1e-3, "cosine", "scaled", check=10000)
    for k in (0.1, 1.0, 10.0):
        for seed in range(effort.seeds):
            rng = np.random.default_rng(seed)
            net = train_net(
                training,
                test,
                NetOptions((128,) * 4),
                recipe,
                rng,
                loss=loss.magnitude_loss(2, k),
                batches=batches.shuffled_batches(training, 512, rng),
            ).net
            error = predict(net, test.strain) - test.targets
            place = np.linalg.norm(error[:, :4].reshape(-1, 2, 2), axis=2).mean()
            force = np.abs(error[:, 4:]).mean()
            for what, unit, paper, value in (
                ("position loss", "mm", "< 0.5", place),
                ("magnitude error", "Δ0", "< 0.4", force),
            ):
                name = f"4×128, k {k:g}: {what}"
                of = "two magnitudes (4C)", name, unit, paper if k == 1 else ""
                yield Sample(*of, recipe.epochs, seed, value)


def magnitudes_unordered(effort: Effort) -> Samples:
    """Two touches of magnitudes 1 to 10 reported without order; touches and forces drawn anew."""
    pool, _, _ = several(2)
    scene = rig.load("paper-two-magnitudes", _RANDOM)
    answer = models.superpose(pressed("paper-two-magnitudes")[1].strain)
    # Strains of the pool are per newton, and magnitude 1 is the scene's force.
    drawn = part(scene.dataset)
    pool = dataset.Dataset(drawn.force * pool.strain, pool.targets)
    test, largest = _samples(scene, answer), float(drawn.magnitudes)
    for seed in range(effort.seeds):
        rng = np.random.default_rng(seed)
        stream = batches.superposed_batches(pool, 2, 512, rng, largest)
        first = next(batches.superposed_batches(pool, 2, 4096, rng, largest))
        began, judge = time.process_time(), set_encoding.permutation_invariant_loss(2, k=1.0)
        net, recipe = _smooth(first, test, 2, effort.epochs(30000), rng, stream, judge)
        spent, found = time.process_time() - began, predict(net, test.strain)
        error, order = matched_error(_places(test.targets, 2), _places(found, 2))
        force = np.take_along_axis(found[:, 4:], order, axis=1) - test.targets[:, 4:]
        for what, unit, paper, value in (
            ("position loss of paired touches", "mm", "< 0.5", error.mean()),
            ("magnitude error", "Δ0", "< 0.4", np.abs(force).mean()),
            ("training", "CPU s", "", spent),
        ):
            of = "two magnitudes, no order", what, unit, paper
            yield Sample(*of, recipe.epochs, seed, value)


def _samples(scene: Scene, answer: Callable[[AnyArray], AnyArray]) -> Dataset:
    """All samples of a scene's data set, as a net learns them."""
    drawn = part(scene.dataset)
    plan = drawn.build(part(scene.plate))
    parts = [plan.block(number) for number in range(plan.blocks)]
    touches = np.concatenate(parts)
    strain = np.concatenate([answer(part).astype(np.float32) for part in parts])
    return dataset.flatten_samples(strain, touches, drawn.force)
