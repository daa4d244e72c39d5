"""Which of the paper's choices matter on a plate: gauges, order, strain without noise."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

import models
import rig
from models import gauge_forward, position_error
from rig.plates.cached import influence
from rig.report.figure import Figure
from rig.studies.paper.drawn import plots
from rig.studies.paper.drawn.one import SPAN, trained_one
from rig.studies.paper.drawn.rows import seeds
from rig.studies.paper.drawn.several import errors
from rig.studies.paper.drawn.trainings import KeptTraining, train_kept
from rig.studies.study import line, part
from rig.system.arrays import F64
from rig.training.model_score import predictor

SPACINGS = (18, 9, 5, 3, 2, 1)  # mm, of the gauges; all divide the 90 mm between the first and last
NOISES = np.array([0.0, 1e-5, 1e-4, 1e-3, 3e-3, 0.01, 0.03, 0.1])
PLACES, ASKED = 200, 150
NEAR = 40.0  # mm along x, over which two touches are shown


def choices(folder: Path) -> Iterator[Figure]:
    """Four figures, one a choice."""
    yield from readings(folder)
    yield from gauges(folder)
    yield from order(folder)
    yield from noise_free(folder)


def readings(folder: Path) -> Iterator[Figure]:
    """Compare the same net on both readings of where the gauges are."""
    title = "Choice 1: gauges on the edge (B) or inside it (A)"
    drawn, axes = plots.canvas(2, width=4.4)
    rows: list[Figure] = []
    for panel, (name, place) in zip(axes[0], (("B", "edges"), ("A", "inside")), strict=True):
        kept = (
            trained_one()
            if name == "B"
            else [train_kept("paper-one", {"gauges.placement": place}, seed) for seed in range(5)]
        )
        off = [position_error(*each.test()) for each in kept]
        middle = int(np.argsort([each.mean() for each in off])[len(off) // 2])
        plots.plate_map(panel, kept[middle].test()[0], off[middle], f"reading {name}", SPAN)
        losses = [float(each.mean()) for each in off]
        rows += seeds(title, f"reading {name}, paper's recipe: loss", losses, "mm", 0.38)
        bound = (_bound({"gauges.placement": place}), "mm")
        rows += line(title, f"reading {name}: bound at 1 % noise", here=bound)
    yield plots.keep(drawn, folder, "paper-choice-readings.png", title, "3000 random touches")
    yield from rows


def gauges(folder: Path) -> Iterator[Figure]:
    """Give the bound by the number of gauges."""
    title = "Choice 2: how many gauges"
    drawn, axes = plots.canvas(1, width=5.0)
    rows: list[Figure] = []
    counts: list[int] = []
    bounds: list[float] = []
    for spacing in SPACINGS:
        scene = rig.load("paper-one", {"gauges.spacing": f"{spacing} mm"})
        counts.append(len(part(scene.gauges).build(part(scene.plate))))
        bounds.append(_bound({"gauges.spacing": f"{spacing} mm"}))
        bound = {"bound at 1 % noise": (bounds[-1], "mm")}
        rows += line(title, f"{counts[-1]} gauges, Ls {spacing} mm", **bound)
    axes[0, 0].loglog(counts, bounds, "o-", label="bound on one touch, noise 1 %")
    guide = bounds[2] * np.sqrt(counts[2] / np.array(counts, float))
    axes[0, 0].loglog(counts, guide, **plots.PAPER, label="as 1/√(number of gauges)")
    axes[0, 0].axvline(72, color="tab:red", linewidth=0.8, label="the paper's 72")
    axes[0, 0].set(xlabel="gauges", ylabel="error of the place, rms, mm")
    axes[0, 0].legend(fontsize="small")
    yield plots.keep(drawn, folder, "paper-choice-gauges.png", title, "bound by number of gauges")
    yield from rows


def _bound(settings: dict[str, object]) -> float:
    """Bound on the root mean square of the place of a touch of unknown force, noise 1 %, mm."""
    scene = rig.load("paper-one", settings)
    plate = part(scene.plate)
    response = influence(plate.build(), part(scene.gauges).build(plate), lambda done, total: None)
    rng, size = np.random.default_rng(0), plate.size
    places = models.random_places(size, part(scene.training).margin, PLACES, rng)
    # σ is that of gauges on the edge, 5 mm apart, so that all rows have the same noise.
    forward = gauge_forward(response, 0.01 * _unit())
    found: list[float] = []
    for place in places:
        jacobian = forward.read(np.array([[*place, 1.0]]))[1]
        found.append(float(np.trace(np.linalg.inv(jacobian @ jacobian.T)[:2, :2])))
    return float(np.sqrt(np.mean(found)))


def _unit() -> float:
    strain = train_kept("paper-one", {}, 0).flat.training.strain
    return float(np.sqrt(np.mean(strain**2)))


def order(folder: Path) -> Iterator[Figure]:
    """Error of two touches by how far they are apart along x, by which the paper sorts them."""
    title = "Choice 3: touches in an order, or without one"
    drawn, axes = plots.canvas(1, width=5.2)
    edges = np.array([0, 1, 2, 4, 7, 12, 20, NEAR])
    rows: list[Figure] = []
    systems = {
        "sorted, 4×64 (the paper's way)": ("paper-two", 3, "tab:blue"),
        "no order, best recipe": ("paper-two-best", 1, "tab:green"),
    }
    for name, (scene, number, colour) in systems.items():
        kept = [train_kept(scene, {}, seed) for seed in range(number)]
        values = np.array([_by_distance(*_apart(each), edges) for each in kept])
        middle = np.median(values, axis=0)
        axes[0, 0].plot(0.5 * (edges[1:] + edges[:-1]), middle, "o-", color=colour, label=name)
        for low, high, column in zip(edges[:-1], edges[1:], values.T, strict=True):
            said = f"{name}, {low} to {high} mm apart along x: loss"
            rows += seeds(title, said, column.tolist(), "mm")
    axes[0, 0].set(xlabel="distance of both touches along x, mm", ylabel="loss, mm", yscale="log")
    axes[0, 0].legend(fontsize="small")
    yield plots.keep(drawn, folder, "paper-choice-order.png", title, "loss by distance along x")
    yield from rows


def _apart(kept: KeptTraining) -> tuple[F64, F64]:
    true, _ = kept.test()
    return np.abs(true[:, 0] - true[:, 2]), errors(kept)[0].mean(axis=1)


def _by_distance(apart: F64, error: F64, edges: F64) -> F64:
    """Mean error between each two edges."""
    which = np.digitize(apart, edges) - 1
    return np.array([error[which == k].mean() for k in range(len(edges) - 1)])


def noise_free(folder: Path) -> Iterator[Figure]:
    """Give noise to what was trained without: nets, a regression; solver and bound beside."""
    title = "Choice 4: strain without noise"
    kept = {
        "paper's recipe": [train_kept("paper-one", {}, seed) for seed in range(5)],
        "best recipe": [train_kept("paper-one-best", {}, seed) for seed in range(5)],
        "quadratic regression": [train_kept("paper-regression", {"estimator.fit": "quadratic"})],
    }
    test, unit = kept["paper's recipe"][0].flat.test, _unit()
    strain, true = test.strain[:ASKED], test.targets[:ASKED]
    draws = np.random.default_rng(5).normal(size=strain.shape)
    drawn, axes = plots.canvas(1, width=5.4, height=4.0)
    shown = np.maximum(NOISES, 3e-6)
    rows: list[Figure] = []
    for name, group in kept.items():
        values = np.array(
            [
                [
                    position_error(
                        true, predictor(each.model)(strain + level * unit * draws)
                    ).mean()
                    for level in NOISES
                ]
                for each in group
            ]
        )
        axes[0, 0].loglog(100 * shown, np.median(values, axis=0), "o-", label=name)
        for level, column in zip(NOISES, values.T, strict=True):
            rows += seeds(title, f"{name}, noise {100 * level:g} %: loss", column.tolist(), "mm")
    solved, bound = _solved(strain, true, unit, draws), _bound({})
    axes[0, 0].loglog(100 * shown[1:], solved[1:], "k.-", label="solver")
    axes[0, 0].loglog(100 * shown[1:], bound * 100 * NOISES[1:], **plots.PAPER, label="bound (rms)")
    for level, value in zip(NOISES, solved, strict=True):
        crb = {"bound, rms": (bound * 100 * level, "mm")}
        said = f"solver, noise {100 * level:g} %: loss"
        rows += line(title, said, here=(float(value), "mm", None, ASKED), **crb)
    axes[0, 0].set(xlabel="noise, % of the strain of 1 N (first: none)", ylabel="loss, mm")
    axes[0, 0].legend(fontsize="small")
    yield plots.keep(drawn, folder, "paper-choice-noise.png", title, "loss by noise")
    yield from rows


def _solved(strain: F64, true: F64, unit: float, draws: F64) -> F64:
    """Mean errors of the solver at each noise, mm."""
    scene = rig.load("paper-one")
    plate = part(scene.plate)
    response = influence(plate.build(), part(scene.gauges).build(plate), lambda done, total: None)
    means: list[float] = []
    for level in NOISES:
        estimator = models.Estimator(gauge_forward(response, max(level, 1e-6) * unit))
        found = [
            estimator.fit(row.reshape(-1, 3), count=1).xy[0]
            for row in (strain + level * unit * draws).astype(np.float64)
        ]
        means.append(float(position_error(true, np.array(found)).mean()))
    return np.array(means)
