"""One touch: the paper's net, the best recipe, regressions, noise and spacing."""

import time
from collections.abc import Iterable
from dataclasses import replace
from functools import partial
from itertools import product

import numpy as np

from models import NetOptions, Recipe, position_error, predict, train_net, tune_net
from models.data import dataset
from models.nets import baselines, regression
from models.nets.recipe import BEST, BEST_NET
from models.nets.regression import Predictor
from rig.report.figure import at_least, at_most
from rig.studies.paper.sets import Effort, Samples, errors, sets
from rig.studies.paper.table import Sample
from rig.training.data import TrainingSets


def one(effort: Effort) -> Samples:
    """One touch, the paper's recipe, both readings of where the gauges are."""
    recipe = Recipe(effort.epochs(30000))
    for reading in ("B", "A"):
        data = sets(f"gauges.reading={reading}")
        for seed in range(effort.seeds):
            rng = np.random.default_rng(seed)
            net = train_net(data.training, data.validation, NetOptions(), recipe, rng).net
            watched, tested = errors(net, data.validation), errors(net, data.test)
            for what, unit, paper, value in (
                ("training loss", "mm", "< 0.3", errors(net, data.training).mean()),
                ("validation loss", "mm", "< 0.3", watched.mean()),
                ("largest of 196", "mm", "0.78", watched.max()),
                ("3000 random: loss", "mm", "0.38", tested.mean()),
                ("3000 random: below 0.5 mm", "%", "> 80", 100 * np.mean(tested < 0.5)),
                ("3000 random: below 1 mm", "%", "100", 100 * np.mean(tested < 1.0)),
                ("3000 random: largest", "mm", "< 1", tested.max()),
            ):
                bar = at_least(80.0) if (reading, paper) == ("B", "> 80") else None
                of = f"one touch, gauges {reading}", what, unit, paper
                yield Sample(*of, recipe.epochs, seed, float(value), bar)


def best(effort: Effort) -> Samples:
    """One touch, the paper's samples and size of net, the best recipe."""
    data = sets()
    for seed in range(effort.seeds):
        began, rng = time.process_time(), np.random.default_rng(seed)
        net = train_net(data.training, data.validation, BEST_NET, BEST, rng).net
        spent, tested = time.process_time() - began, errors(net, data.test)
        for what, unit, value, most in (
            ("3000 random: loss", "mm", tested.mean(), 0.03),
            ("3000 random: largest", "mm", tested.max(), 0.3),
            ("training", "CPU s", spent, 60.0),
        ):
            of = "one touch, best recipe", what, unit, ""
            yield Sample(*of, BEST.epochs, seed, value, at_most(most))


def without(effort: Effort) -> Samples:
    """One touch by the best recipe less one of its parts each."""
    data = sets()
    for name, options, recipe in (
        ("ReLU", replace(BEST_NET, activation="relu"), BEST),
        ("tanh", replace(BEST_NET, activation="tanh"), BEST),
        ("no asinh", replace(BEST_NET, inputs="standard"), BEST),
        ("no finish", BEST_NET, replace(BEST, lbfgs_steps=0)),
    ):
        for seed in range(effort.seeds):
            rng = np.random.default_rng(seed)
            tested = errors(
                train_net(data.training, data.validation, options, recipe, rng).net, data.test
            )
            what = f"{name}: 3000 random: loss"
            yield Sample("best recipe changed", what, "mm", "", BEST.epochs, seed, tested.mean())


def other(effort: Effort) -> Samples:
    """One touch by regressions and by the other two kinds of net."""
    data = sets()
    for fit, paper in (
        (regression.linear, "fails at the edge"),
        (regression.quadratic, "fails at the edge"),
        (regression.ridge, ""),
        (regression.gaussian_process, ""),
        (regression.nearest, ""),
    ):
        yield from _tested(fit.__name__.replace("_", " "), paper, 0, 0, fit(data.training), data)
    recipe = Recipe(effort.epochs(10000))
    for name, train in (
        ("convolutional net", baselines.train_convolutional),
        ("adversarial net", baselines.train_adversarial),
    ):
        for seed in range(effort.seeds):
            net = train(data.training, data.validation, recipe, np.random.default_rng(seed)).net
            predictor = partial(predict, net)
            yield from _tested(name, "worse", recipe.epochs, seed, predictor, data)


def _tested(
    name: str, paper: str, epochs: int, seed: int, predictor: Predictor, data: TrainingSets
) -> Samples:
    tested = position_error(data.test.targets, predictor(data.test.strain))
    system, mean, largest = f"one touch, {name}", tested.mean(), tested.max()
    yield Sample(system, "3000 random: loss", "mm", paper, epochs, seed, mean)
    yield Sample(system, "3000 random: largest", "mm", "", epochs, seed, largest)


def noise(effort: Effort) -> Samples:
    """Loss against measurement error for loads of several sizes (figure S4)."""
    data, recipe = sets(), Recipe(effort.epochs(30000))
    unit = np.sqrt(np.mean(data.training.strain**2))
    for seed in range(effort.seeds):
        rng = np.random.default_rng(seed)
        net = train_net(data.training, data.validation, NetOptions(), recipe, rng).net
        for level in (0.0, 0.01, 0.03, 0.1):
            error = level * unit * rng.normal(size=data.test.strain.shape)
            for load in (1, 2, 5, 10):
                seen = dataset.Dataset(data.test.strain + error / load, data.test.targets)
                what = f"load {load}, error {level:.0%} of the strain of load 1: loss"
                paper = "0.38" if level == 0.0 else ""
                value = errors(net, seen).mean()
                of = "measurement error (S4)", what, "mm", paper
                yield Sample(*of, recipe.epochs, seed, value)


def spacing(effort: Effort) -> Samples:
    """Loss by the spacing of gauges and of training touches (figure 3D)."""
    yield from _spaced(product((10, 5, 2), (10, 5, 2)), effort)


def finest(effort: Effort) -> Samples:
    """Loss with 360 gauges and 6561 training touches, the last point of figure 3D."""
    yield from _spaced([(1, 1)], effort)


def _spaced(pairs: Iterable[tuple[int, int]], effort: Effort) -> Samples:
    recipe = Recipe(effort.epochs(30000))
    for apart, touches in pairs:
        data = sets(f"gauges.spacing={apart} mm", f"training.spacing={touches} mm")
        for seed in range(effort.seeds):
            rng = np.random.default_rng(seed)
            net = train_net(data.training, data.validation, NetOptions(), recipe, rng).net
            paper = {(5, 5): "0.38", (1, 1): "0.06"}.get((apart, touches), "")
            bar = at_most(0.06) if (apart, touches) == (1, 1) else None
            of = "spacing (3D)", f"Ls {apart}, Lt {touches} mm: loss", "mm", paper
            yield Sample(*of, recipe.epochs, seed, errors(net, data.test).mean(), bar)


def search(effort: Effort) -> Samples:
    """Fifty nets of random layers (Table S1), and the smallest of the table."""
    data, recipe = sets(), Recipe(effort.epochs(30000))

    def judge(layers: tuple[int, ...]) -> float:
        rng = np.random.default_rng(0)
        net = train_net(data.training, data.validation, NetOptions(layers), recipe, rng).net
        return float(errors(net, data.validation).mean())

    for seed in range(effort.seeds):
        losses = [candidate.loss for candidate in tune_net(judge, 50, seed=seed)]
        for what, paper, value in (
            ("best of 50: validation loss", "0.24", losses[0]),
            ("median of 50: validation loss", "0.30", np.median(losses)),
            ("worst of 50: validation loss", "1.38", losses[-1]),
            ("one layer of 128: validation loss", "0.26", judge((128,))),
            ("one layer of 4: validation loss", "1.38", judge((4,))),
        ):
            yield Sample("search (S1)", what, "mm", paper, recipe.epochs, seed, value)
