"""Run the paper's systems, and write each figure beside the paper's own.

Usage: ``python benchmarks/paper.py [--quick | --cut N] [--seeds N] [SYSTEM ...]``; the systems are
the keys of SYSTEMS, all of them if none is named. ``--cut N`` takes an Nth of the epochs,
``--quick`` a tenth. Figures go to docs/paper.csv, where those of the same system and effort are
replaced, and the table of all that is there to docs/paper.md.
"""

import argparse
import sys
import time
from collections.abc import Iterator
from dataclasses import replace
from functools import cache
from typing import NamedTuple

import numpy as np
import paper_base
from paper_table import Figure, store, write

import models
import rig
from models import alternatives, batches, dataset, loss, regression
from models.net import NetOptions, predict
from models.recipe import BEST, BEST_NET, Recipe
from models.refine import refine
from models.score import matched_error, position_error
from models.train import train
from models.two_step import predict_two_step, train_two_step
from rig.simulated import influence, lesson, simulate

STREAMED = 20000  # unit touches that several are drawn from
TESTED = 2000  # samples of several touches in the test


class Effort(NamedTuple):
    """How much is spent: seeds, and by how much epochs are cut."""

    seeds: int
    cut: int

    def epochs(self, whole: int) -> int:
        """Epochs of a training that has `whole` of them."""
        return max(whole // self.cut, 1)


Figures = Iterator[Figure]


@cache
def sets(*settings: str):
    """Training, validation and test touches of paper-one, changed by key=value."""
    scene = rig.load("paper-one", dict(setting.split("=") for setting in settings))
    return simulate(lesson(scene), lambda done, total: None)


def pressed(name: str):
    """Return the plate of a scene, and what a touch on it does to its gauges."""
    scene = rig.load(name)
    plate = scene.plate.build()
    return plate, influence(plate, scene.gauges.build(scene.plate), lambda done, total: None)


@cache
def several(touches: int):
    """Return a pool of unit touches, samples of several to scale by, and others for the test."""
    plate, answer = pressed({1: "paper-one", 2: "paper-two", 3: "paper-three"}[touches])
    rng = np.random.default_rng(1)
    pools = [
        dataset.simulate(answer, dataset.random_places(plate.size, 10.0, STREAMED, rng))
        for _ in range(2)
    ]
    first, test = (
        next(batches.superposed(pool, touches, count, rng))
        for pool, count in zip(pools, (4096, TESTED), strict=True)
    )
    return pools[0], first, test


def errors(net, data):
    """Distance of every touch of a data set of single touches, mm."""
    return position_error(data.targets, predict(net, data.strain))


def one(effort: Effort) -> Figures:
    """One touch, the paper's recipe, both readings of where the gauges are."""
    recipe = Recipe(effort.epochs(30000))
    for reading in ("B", "A"):
        data = sets(f"gauges.reading={reading}")
        for seed in range(effort.seeds):
            rng = np.random.default_rng(seed)
            net = train(data.training, data.validation, NetOptions(), recipe, rng).net
            watched, tested = errors(net, data.validation), errors(net, data.test)
            for what, paper, value in (
                ("training loss, mm", "< 0.3", errors(net, data.training).mean()),
                ("validation loss, mm", "< 0.3", watched.mean()),
                ("largest of 196, mm", "0.78", watched.max()),
                ("3000 random: loss, mm", "0.38", tested.mean()),
                ("3000 random: below 0.5 mm, %", "> 80", 100 * np.mean(tested < 0.5)),
                ("3000 random: below 1 mm, %", "100", 100 * np.mean(tested < 1.0)),
                ("3000 random: largest, mm", "< 1", tested.max()),
            ):
                yield Figure(
                    f"one touch, gauges {reading}", what, paper, recipe.epochs, seed, value
                )


def best(effort: Effort) -> Figures:
    """One touch, the paper's samples and size of net, the best recipe."""
    data = sets()
    for seed in range(effort.seeds):
        began, rng = time.process_time(), np.random.default_rng(seed)
        net = train(data.training, data.validation, BEST_NET, BEST, rng).net
        spent, tested = time.process_time() - began, errors(net, data.test)
        for what, value in (
            ("3000 random: loss, mm", tested.mean()),
            ("3000 random: largest, mm", tested.max()),
            ("training, CPU s", spent),
        ):
            yield Figure("one touch, best recipe", what, "", BEST.epochs, seed, value)


def without(effort: Effort) -> Figures:
    """One touch by the best recipe less one of its parts each."""
    data = sets()
    for name, options, recipe in (
        ("ReLU", replace(BEST_NET, activation="relu"), BEST),
        ("tanh", replace(BEST_NET, activation="tanh"), BEST),
        ("no asinh", replace(BEST_NET, inputs="standard"), BEST),
        ("no finish", BEST_NET, replace(BEST, finish=0)),
    ):
        for seed in range(effort.seeds):
            rng = np.random.default_rng(seed)
            tested = errors(
                train(data.training, data.validation, options, recipe, rng).net, data.test
            )
            what = f"{name}: 3000 random: loss, mm"
            yield Figure("best recipe changed", what, "", BEST.epochs, seed, tested.mean())


def bound(effort: Effort) -> Figures:
    """Compare a net trained with noise, and two solver steps after it, with the bound."""
    pool, first, test = several(1)
    answer = pressed("paper-one")[1]
    unit = float(np.sqrt(np.mean(first.strain**2)))
    recipe = Recipe(effort.epochs(10000), 2e-3, "cosine", "scaled", check=10000)
    options = NetOptions((64, 64), "silu")
    for seed in range(effort.seeds):
        for noise in (0.01, 0.05):
            rng = np.random.default_rng(seed)
            sigma, square = noise * unit, loss.mean_square()
            stream = batches.noisy(batches.superposed(pool, 1, 512, rng), sigma, rng)
            net = train(first, test, options, recipe, rng, loss=square, batches=stream).net
            seen = next(batches.noisy(iter([test]), sigma, rng))
            forward = models.gauges(answer, sigma)
            for what, value in _over_bound(forward, predict(net, seen.strain), seen):
                system = f"trained with noise of {noise:.0%}"
                yield Figure(system, what, "", recipe.epochs, seed, value)


def _over_bound(forward, told, seen):
    """Root mean squares of a net and of solver steps after it, over that of the bound."""
    of_net, limit, known, stepped = np.empty((4, len(seen)))
    for n, (strain, true) in enumerate(zip(seen.strain, seen.targets, strict=True)):
        fisher = forward.read(np.array([[*true, 1.0]]))[1]
        limit[n] = np.trace(np.linalg.inv(fisher @ fisher.T)[:2, :2])
        known[n] = np.trace(np.linalg.inv(fisher[:2] @ fisher[:2].T))
        measured = forward.whiten(strain.reshape(-1, 3).astype(float))
        found = refine(measured, forward, np.array([[*told[n], 1.0]]))
        stepped[n] = np.sum((found[0, :2] - true) ** 2)
        of_net[n] = np.sum((told[n] - true) ** 2)
    for what, square, least in (
        ("net: RMS ÷ bound, force unknown", of_net, limit),
        ("net: RMS ÷ bound, force known", of_net, known),
        ("net and 2 solver steps: RMS ÷ bound, force unknown", stepped, limit),
    ):
        yield what, np.sqrt(np.mean(square) / np.mean(least))


def other(effort: Effort) -> Figures:
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
    epochs = effort.epochs(10000)
    for fit in (alternatives.convolutional, alternatives.adversarial):
        for seed in range(effort.seeds):
            predictor = fit(data.training, epochs, seed)
            yield from _tested(f"{fit.__name__} net", "worse", epochs, seed, predictor, data)


def _tested(name, paper, epochs, seed, predictor, data) -> Figures:
    tested = position_error(data.test.targets, predictor(data.test.strain))
    yield Figure(f"one touch, {name}", "3000 random: loss, mm", paper, epochs, seed, tested.mean())
    largest = tested.max()
    yield Figure(f"one touch, {name}", "3000 random: largest, mm", "", epochs, seed, largest)


def noise(effort: Effort) -> Figures:
    """Loss against measurement error for loads of several sizes (figure S4)."""
    data, recipe = sets(), Recipe(effort.epochs(30000))
    unit = np.sqrt(np.mean(data.training.strain**2))
    for seed in range(effort.seeds):
        rng = np.random.default_rng(seed)
        net = train(data.training, data.validation, NetOptions(), recipe, rng).net
        for share in (0.0, 0.01, 0.03, 0.1):
            error = share * unit * rng.normal(size=data.test.strain.shape)
            for load in (1, 2, 5, 10):
                seen = dataset.Dataset(data.test.strain + error / load, data.test.targets)
                what = f"load {load}, error {share:.0%} of the strain of load 1: loss, mm"
                paper = "0.38" if share == 0.0 else ""
                value = errors(net, seen).mean()
                yield Figure("measurement error (S4)", what, paper, recipe.epochs, seed, value)


def spacing(effort: Effort) -> Figures:
    """Loss by the spacing of gauges and of training touches (figure 3D)."""
    recipe = Recipe(effort.epochs(30000))
    for apart in (10, 5, 2):
        for touches in (10, 5, 2):
            data = sets(f"gauges.spacing={apart} mm", f"training.spacing={touches} mm")
            for seed in range(effort.seeds):
                rng = np.random.default_rng(seed)
                net = train(data.training, data.validation, NetOptions(), recipe, rng).net
                paper = "0.38" if (apart, touches) == (5, 5) else ""
                what = f"Ls {apart}, Lt {touches} mm: loss, mm"
                value = errors(net, data.test).mean()
                yield Figure("spacing (3D)", what, paper, recipe.epochs, seed, value)


def two(effort: Effort) -> Figures:
    """Two equal touches, all pairs of the grid, equation 2 (figure S5)."""
    yield from _equal(2, {(32, 32): 20000, (64,) * 4: 20000, (256,) * 8: 5000}, "", effort)


def three(effort: Effort) -> Figures:
    """Three equal touches, equation 2 (figures 4A and 4B)."""
    steps = {(32, 32): 20000, (64,) * 4: 20000, (256,) * 8: 5000}
    yield from _equal(3, steps, "0.43", effort)


def _equal(touches: int, steps, paper: str, effort: Effort) -> Figures:
    """Nets of the paper's three sizes on touches of equal force, streamed."""
    pool, first, test = several(touches)
    for layers, whole in steps.items():
        recipe = Recipe(effort.epochs(whole), 1e-3, "cosine", "scaled", check=whole)
        for seed in range(effort.seeds):
            rng = np.random.default_rng(seed)
            stream = batches.superposed(pool, touches, 512, rng)
            options = NetOptions(layers)
            net = train(
                first, test, options, recipe, rng, loss=loss.distance(touches), batches=stream
            ).net
            name = f"{len(layers)}×{layers[0]}"
            yield from _pressed(f"{touches} equal touches", name, paper, recipe, seed, net, test)


def _pressed(system, name, paper, recipe, seed, net, test) -> Figures:
    touches = test.targets.shape[1] // 2
    true = test.targets.reshape(-1, touches, 2)
    predicted = predict(net, test.strain).reshape(-1, touches, 2)
    sorted_loss = np.linalg.norm(predicted - true, axis=2).mean()
    matched = matched_error(true, predicted)[0].mean(axis=1)
    for what, value in (("loss, mm", sorted_loss), ("loss of paired touches, mm", matched.mean())):
        given = paper if name == "8×256" else ""
        yield Figure(system, f"{name}: {what}", given, recipe.epochs, seed, value)
    share = 100 * np.mean(matched < 0.8)
    expected = "100" if touches == 3 and name == "8×256" else ""
    yield Figure(system, f"{name}: below 0.8 mm, %", expected, recipe.epochs, seed, share)


def doubled(effort: Effort) -> Figures:
    """Two equal touches, each sample written both ways round (figure S6)."""
    pool, first, test = several(2)
    recipe = Recipe(effort.epochs(20000), 1e-3, "cosine", "scaled", check=20000)

    def both_ways(stream, rng):
        for batch in stream:
            swap = rng.random(len(batch)) < 0.5
            turned = np.where(swap[:, None], np.roll(batch.targets, 2, axis=1), batch.targets)
            yield dataset.Dataset(batch.strain, turned)

    for seed in range(effort.seeds):
        rng = np.random.default_rng(seed)
        stream = batches.superposed(pool, 2, 512, rng)
        for name, taken in (("sorted", stream), ("doubled", both_ways(stream, rng))):
            net = train(
                first,
                test,
                NetOptions((64,) * 4),
                recipe,
                rng,
                loss=loss.distance(2),
                batches=taken,
            ).net
            predicted = predict(net, test.strain)
            apart = (predicted - test.targets).reshape(-1, 2, 2)
            value = np.linalg.norm(apart, axis=2).mean()
            paper = "fails" if name == "doubled" else ""
            what = f"4×64, {name} samples: loss, mm"
            yield Figure("doubled samples (S6)", what, paper, recipe.epochs, seed, value)


def magnitudes(effort: Effort) -> Figures:
    """Two touches of magnitudes 1 to 10, equation 3 with three weights k (figure 4C)."""
    scene = rig.load("paper-two-magnitudes")
    random = {"dataset.places": "random", "dataset.seed": 1, "dataset.samples": TESTED}
    drawn = rig.load("paper-two-magnitudes", random)
    answer = models.superpose(pressed("paper-two-magnitudes")[1].strain)
    training, test = (_samples(bench, answer) for bench in (scene, drawn))
    recipe = Recipe(effort.epochs(10000), 1e-3, "cosine", "scaled", check=10000)
    for k in (0.1, 1.0, 10.0):
        for seed in range(effort.seeds):
            rng = np.random.default_rng(seed)
            net = train(
                training,
                test,
                NetOptions((128,) * 4),
                recipe,
                rng,
                loss=loss.magnitudes_too(2, k),
                batches=batches.shuffled(training, 512, rng),
            ).net
            error = predict(net, test.strain) - test.targets
            place = np.linalg.norm(error[:, :4].reshape(-1, 2, 2), axis=2).mean()
            for what, paper, value in (
                ("position loss, mm", "< 0.5" if k == 1 else "", place),
                ("magnitude error, Δ0", "< 0.4" if k == 1 else "", np.abs(error[:, 4:]).mean()),
            ):
                name = f"4×128, k {k:g}: {what}"
                yield Figure("two magnitudes (4C)", name, paper, recipe.epochs, seed, value)


def deformable(effort: Effort) -> Figures:
    """One touch on a bent and twisted plate: a net of one step and one of two (figure 5)."""
    training, validation, *tests = paper_base.surfaces()
    recipe = Recipe(effort.epochs(10000), 1e-3, "cosine", "scaled", check=10000)
    shallow, wide = NetOptions((64,) * 4), NetOptions((128,) * 4)
    for seed in range(effort.seeds):
        rng = np.random.default_rng(seed)
        once = train(
            training.together,
            validation.together,
            shallow,
            recipe,
            rng,
            loss=loss.base_too(1.0),
            batches=batches.shuffled(training.together, 512, rng),
        ).net
        twice = train_two_step(training, validation, (shallow, wide), recipe, rng)
        for ratio, test in zip(paper_base.RATIOS, tests, strict=True):
            for name, paper, told in (
                ("1 step, 64×4", "1.58", predict(once, test.loaded)[:, :2]),
                ("2 steps", "0.48", predict_two_step(twice, test.before, test.loaded)),
            ):
                value = position_error(test.xy, told).mean()
                paper = paper if ratio == 1.0 else ""
                what = f"{name}, load {ratio:g} Δ0: loss, mm"
                yield Figure("deformable (5D)", what, paper, recipe.epochs, seed, value)


def change(effort: Effort) -> Figures:
    """Run the two steps again, the second on what the touch changed of the strain."""
    training, validation, *tests = (
        replace(each, loaded=each.loaded - each.before) for each in paper_base.surfaces()
    )
    recipe = Recipe(effort.epochs(10000), 1e-3, "cosine", "scaled", check=10000)
    options = NetOptions((64,) * 4), NetOptions((128,) * 4)
    for seed in range(effort.seeds):
        nets = train_two_step(training, validation, options, recipe, np.random.default_rng(seed))
        for ratio, test in zip(paper_base.RATIOS, tests, strict=True):
            told = predict_two_step(nets, test.before, test.loaded)
            what = f"2 steps on the change, load {ratio:g} Δ0: loss, mm"
            value = position_error(test.xy, told).mean()
            yield Figure("deformable, change of strain", what, "", recipe.epochs, seed, value)


def _samples(scene, answer):
    """All samples of a scene's data set, as a net learns them."""
    plan = scene.dataset.build(scene.plate)
    parts = [plan.block(number) for number in range(plan.blocks)]
    touches = np.concatenate(parts)
    strain = np.concatenate([answer(part).astype(np.float32) for part in parts])
    return dataset.flatten(strain, touches, scene.dataset.force)


SYSTEMS = {
    "one": one,
    "best": best,
    "without": without,
    "bound": bound,
    "other": other,
    "noise": noise,
    "spacing": spacing,
    "two": two,
    "three": three,
    "doubled": doubled,
    "magnitudes": magnitudes,
    "deformable": deformable,
    "change": change,
}


def main(*arguments: str) -> None:
    """Run the systems asked for, and write the table."""
    parser = argparse.ArgumentParser(description="The paper's systems in one table.")
    parser.add_argument("systems", nargs="*", metavar="SYSTEM", help=", ".join(SYSTEMS))
    parser.add_argument("--seeds", type=int, default=1)
    parser.add_argument("--cut", type=int, default=1)
    parser.add_argument("--quick", dest="cut", action="store_const", const=10)
    asked = parser.parse_args(arguments)
    effort = Effort(asked.seeds, asked.cut)
    for name in asked.systems or SYSTEMS:
        figures = []
        for figure in SYSTEMS[name](effort):
            print(f"{figure.system:32s} {figure.what:60s} {figure.value:9.3f}", flush=True)
            figures.append(figure)
        store(figures)
        write()


if __name__ == "__main__":
    main(*sys.argv[1:])
