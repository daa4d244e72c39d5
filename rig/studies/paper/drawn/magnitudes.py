"""The paper's figures of two touches that press differently hard: 4C and 4D."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from models import matched_error
from rig.report.figure import Figure, at_most
from rig.studies.paper.drawn import plots
from rig.studies.paper.drawn.rows import beside, seeds
from rig.studies.paper.drawn.several import WHOLE, WIDE, extrapolated, spent
from rig.studies.paper.drawn.trainings import KeptTraining, train_kept
from rig.studies.study import Cell
from rig.system.arrays import F64, AnyArray

WEIGHTS = (0.1, 1.0, 10.0)
SMALLER, STEPS, SEEDS = (128,) * 4, 1500, 5
LONG = 2000  # steps of the paper's 8×256 at k 1
LONG_SEEDS = 3
"""Of that net, and of the best recipe: two minutes and more each."""
PLACE, MAGNITUDE = 0.5, 0.4  # mm and Δ0, the paper's at k 1


def scored(kept: KeptTraining) -> tuple[float, float]:
    """Mean error of paired places, mm, and of their magnitudes, Δ0."""
    true, found = kept.test()
    error, order = matched_error(true[:, :4].reshape(-1, 2, 2), found[:, :4].reshape(-1, 2, 2))
    force = np.take_along_axis(found[:, 4:], order, axis=1) - true[:, 4:]
    return float(error.mean()), float(np.abs(force).mean())


def _trained(layers: tuple[int, ...], k: float, steps: int, seed: int) -> KeptTraining:
    settings = {
        "estimator.layers": list(layers),
        "estimator.magnitude_weight": k,
        "estimator.epochs": steps,
        "estimator.decay": "constant",
    }
    return train_kept("paper-two-magnitudes", settings, seed)


def weights(folder: Path) -> Iterator[Figure]:
    """Loss of two magnitudes by the weight k, and the paper's net extrapolated (4C)."""
    yield from _weights(folder, LONG, LONG_SEEDS)


def weights_whole(folder: Path) -> Iterator[Figure]:
    """Do the same with the steps of a night; it goes on where it was killed."""
    yield from _weights(folder, WHOLE, LONG_SEEDS)


def _weights(folder: Path, long: int, number: int) -> Iterator[Figure]:
    title = "Figure 4C: two touches of ten magnitudes"
    drawn, axes = plots.canvas(2, width=4.8, height=4.0)
    rows: list[Figure] = []
    pairs = {k: [_trained(SMALLER, k, STEPS, seed) for seed in range(SEEDS)] for k in WEIGHTS}
    found = {k: np.array([scored(each) for each in group]) for k, group in pairs.items()}
    for (k, group), colour in zip(
        pairs.items(), ("tab:blue", "tab:orange", "tab:green"), strict=True
    ):
        plots.losses(axes[0, 0], [each.curves()[""] for each in group], colour, f"4×128, k {k:g}")
        for column, (what, unit) in enumerate((("place", "mm"), ("magnitude", "Δ0"))):
            said = f"4×128, k {k:g}, {STEPS} steps: {what}"
            rows += seeds(title, said, found[k][:, column].tolist(), unit)
    colours: list[str] = []
    for column, (what, limit) in enumerate((("place, mm", PLACE), ("magnitude, Δ0", MAGNITUDE))):
        values = np.array([found[k][:, column] for k in WEIGHTS])
        (curve,) = axes[0, 1].plot(WEIGHTS, np.median(values, axis=1), "o-", label=f"4×128: {what}")
        spread = values.min(axis=1), values.max(axis=1)
        axes[0, 1].fill_between(WEIGHTS, *spread, color=curve.get_color(), alpha=0.2)
        colours.append(curve.get_color())
        axes[0, 1].plot(1.0, limit, "x", color=curve.get_color(), ms=9, label=f"paper: {what}")
    wide = [_trained(WIDE, 1.0, long, seed) for seed in range(number)]
    slow = [each.curves()[""] for each in wide]
    plots.losses(axes[0, 0], slow, "tab:red", "8×256, k 1")
    for values, colour in zip(np.transpose([scored(each) for each in wide]), colours, strict=True):
        axes[0, 1].plot(1.0, np.median(values), "s", color=colour, label="8×256")
    solver = beside(wide[0])  # the test of all these is the same
    rows += _against(title, f"8×256, k 1, {long} steps", wide, solver)
    ahead, said = extrapolated(title, "8×256, k 1", slow[0], PLACE + MAGNITUDE)
    axes[0, 0].fill_between(ahead.steps, ahead.low, ahead.high, color="tab:red", alpha=0.15)
    axes[0, 0].plot(ahead.steps, ahead.middle, ":", color="tab:red", label="extrapolated")
    rows += _against(title, "best recipe", _best(), solver)
    axes[0, 0].set(title="loss of equation 3")
    axes[0, 1].set(title="error by k", xlabel="k, mm", xscale="log", yscale="log")
    for panel in axes[0]:
        panel.legend(fontsize="xx-small")
    curves = {
        f"4×128, k {k:g}": [each.curves()[""] for each in group] for k, group in pairs.items()
    }
    curves["8×256, k 1"] = slow
    plots.keep_losses(folder, "paper-4c-losses.csv", curves)
    yield plots.keep(drawn, folder, "paper-4c.png", title, "losses on the way, and errors by k")
    yield from rows
    yield from said


def _best() -> list[KeptTraining]:
    return [train_kept("paper-two-magnitudes-best", {}, seed) for seed in range(LONG_SEEDS)]


def _against(
    title: str, name: str, kept: list[KeptTraining], solver: Mapping[str, Cell]
) -> list[Figure]:
    """Rows beside the paper's two figures."""
    places, forces = np.array([scored(each) for each in kept]).T
    place = seeds(
        *(title, f"{name}: place", places.tolist(), "mm", "< 0.5 mm", at_most(PLACE)),
        **solver,
        **spent(kept),
    )
    force = seeds(
        title, f"{name}: magnitude", forces.tolist(), "Δ0", "< 0.4 Δ0", at_most(MAGNITUDE)
    )
    return [*place, *force]


def six(folder: Path) -> Iterator[Figure]:
    """Six random samples, each touch in a square of 2 mm, dots as large as the magnitude (4D)."""
    title = "Figure 4D: six samples of two magnitudes"
    kept = _best()
    off = [float(_six_matched(each)[0].max()) for each in kept]
    true, found = (each[:6] for each in kept[0].test())
    drawn, axes = plots.canvas(6, 2, 2.1, 2.1)
    for sample, order in enumerate(_six_matched(kept[0])[1]):
        for touch in range(2):
            both = _one(true[sample], touch), _one(found[sample], order[touch])
            _block(axes[touch, sample], *both)
        axes[0, sample].set(title=f"sample {sample + 1}")
    yield plots.keep(
        drawn, folder, "paper-4d.png", title, "red: true, blue: predicted by the best recipe"
    )
    yield from seeds(title, "largest error of a place", off, "mm", "< 1 mm")


def _six_matched(kept: KeptTraining) -> tuple[F64, AnyArray]:
    """Errors of the paired touches of six samples, and which was found for which."""
    true, found = (each[:6, :4].reshape(-1, 2, 2) for each in kept.test())
    return matched_error(true, found)


def _one(touches: F64, which: int) -> F64:
    """x, y and magnitude of one of two touches."""
    return np.array([*touches[2 * which : 2 * which + 2], touches[4 + which]])


def _block(panel: Any, true: F64, found: F64) -> None:
    """Draw a square of 2 mm about a true touch."""
    corner = np.floor(true[:2]) - 0.5
    panel.scatter(*true[:2], s=14 * true[2], c="tab:red", alpha=0.6)
    panel.scatter(*found[:2], s=14 * found[2], c="tab:blue", alpha=0.6)
    panel.set(xlim=(corner[0], corner[0] + 2), ylim=(corner[1], corner[1] + 2), aspect="equal")
    panel.set_xticks(corner[0] + np.array([0, 2]))
    panel.set_yticks(corner[1] + np.array([0, 2]))
    panel.tick_params(labelsize="x-small")
