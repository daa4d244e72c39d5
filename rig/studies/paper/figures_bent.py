"""The paper's figures of a deformable surface: 5A, 5C and 5D."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

import fe
import models
from rig.report.figure import Figure, at_most
from rig.studies.paper import plots
from rig.studies.paper.rows import EXACT, seeds
from rig.studies.paper.trainings import KeptTraining, train_kept
from rig.studies.study import Cell, line
from rig.system.arrays import F64
from rig.training.bases import RATIOS
from rig.training.model_score import base_report

TITLE = "Figures 5C and 5D: a deformable surface"
SYSTEMS = {
    "1 step, 64×4": ("paper-deformable-one-step", 3, 1.58, "tab:orange"),
    "2 steps, 64×4 and 128×4": ("paper-deformable", 3, 0.48, "tab:blue"),
    "2 steps, direction of the change": ("paper-deformable-best", 3, None, "tab:green"),
}
"""Scene, seeds, the paper's loss at the load that was learnt, colour."""

BEST = at_most(0.1)
SOLVED = 20  # touches of each test base that the solver is given
SHAPES = ((4.0, 0.0), (0.5, 2.0), (4.0, 2.0))  # mm and degrees of figure 5A


def deformable(folder: Path) -> Iterator[Figure]:
    """Losses on the way (5C), and loss against load (5D), with the solver beside."""
    drawn, axes = plots.canvas(2, width=5.0, height=4.0)
    rows: list[Figure] = []
    found: dict[str, list[KeptTraining]] = {}
    for name, (scene, number, paper, colour) in SYSTEMS.items():
        kept = found[name] = [train_kept(scene, {}, seed) for seed in range(number)]
        for step, style in (("", name), ("place", name)):
            curves = [each.curves()[step] for each in kept if step in each.curves()]
            if curves:
                plots.losses(axes[0, 0], curves, colour, style)
        losses = np.array([[loss_at_load(each, ratio) for ratio in RATIOS] for each in kept])
        axes[0, 1].plot(RATIOS, np.median(losses, axis=0), "o-", color=colour, label=name)
        axes[0, 1].fill_between(
            RATIOS, losses.min(axis=0), losses.max(axis=0), color=colour, alpha=0.2
        )
        if paper:
            axes[0, 1].plot(1.0, paper, "x", color=colour, ms=9, label=f"paper: {paper:g} mm")
        rows += _rows(name, losses, paper, kept)
    axes[0, 0].set(title="5C: losses on the way to the place")
    axes[0, 1].set(
        title="5D: loss against load", xlabel="load, Δ0", ylabel="loss, mm", yscale="log"
    )
    for panel in axes[0]:
        panel.legend(fontsize="xx-small")
    yield plots.keep(drawn, folder, "paper-5cd.png", TITLE, "median and range of the seeds")
    yield from rows
    yield from _solver(found["2 steps, direction of the change"][0])


def _rows(
    name: str, losses: F64, paper: float | None, kept: list[KeptTraining]
) -> Iterator[Figure]:
    for ratio, values in zip(RATIOS, losses.T, strict=True):
        learnt = ratio == 1.0 and paper is not None
        bar = at_most(paper) if learnt and paper else (BEST if paper is None else None)
        said = f"{name}, load {ratio:g} Δ0: loss"
        yield from seeds(TITLE, said, values.tolist(), "mm", paper if learnt else None, bar)
    spent = float(np.median([each.cpu for each in kept]))
    yield from line(TITLE, f"{name}: training", here=(spent, "CPU s", None, len(kept)))


def loss_at_load(kept: KeptTraining, ratio: float) -> float:
    """Return the mean error of places at a load over the one that was learnt, mm."""
    test = kept.bent.test.surface(ratio * kept.bent.load)
    return float(np.hypot(*(base_report(kept.model, test)[:, :2] - test.xy).T).mean())


def _solver(kept: KeptTraining) -> Iterator[Figure]:
    """Run the solver on the tangent of each test base, which it knows, and the bound."""
    plan, test = kept.plan, kept.bent.test
    plate, gauges = plan.plate.build(), plan.gauges.build(plan.plate)
    side = plan.training.bases.elements if plan.training.bases else 20
    shell = fe.Shell(plate, fe.Mesh(plate.size, (side, side)))
    unit = float(np.sqrt(np.mean(test.touch**2)))
    off: list[float] = []
    limits: list[float] = []
    for base, places, touch in zip(test.bases, test.places, test.touch, strict=True):
        response = fe.shell_influence(shell.at(fe.Base(*base)), gauges)
        estimator = models.Estimator(models.gauge_forward(response, EXACT * unit))
        for place, strain in zip(places[:SOLVED], touch[:SOLVED], strict=True):
            estimate = estimator.fit(strain.reshape(-1, 3), count=1)
            off.append(float(np.hypot(*(estimate.xy[0] - place))))
            jacobian = estimator.forward.read(np.array([[*place, 1.0]]))[1]
            covariance = np.linalg.inv(jacobian @ jacobian.T)
            limits.append(float(np.trace(covariance[:2, :2])) * (0.01 / EXACT) ** 2)
    cells: dict[str, Cell] = {
        "largest": (max(off), "mm"),
        "bound at 1 % noise": (float(np.sqrt(np.mean(limits))), "mm"),
    }
    said = "solver on the change of strain, base known, any load: loss"
    yield from line(TITLE, said, here=(float(np.mean(off)), "mm", None, len(off)), **cells)


def shapes(folder: Path) -> Iterator[Figure]:
    """Draw a plate that is bent, twisted, and both, true to scale, from the shell (5A)."""
    title = "Figure 5A: bending and torsion"
    kept = train_kept("paper-deformable-best", {}, 0)
    plate = kept.plan.plate.build()
    shell = fe.Shell(plate, fe.Mesh(plate.size, (20, 20)))
    along = np.linspace(0.0, 100.0, 33)
    xy = np.stack(np.meshgrid(along, along), axis=-1)
    drawn, axes = plots.canvas(3, width=3.8, height=3.3)
    rows: list[Figure] = []
    for number, (bend, twist) in enumerate(SHAPES):
        state = shell.at(fe.Base(bend, twist))
        moved = state.displacement(xy.reshape(-1, 2)).reshape(*xy.shape[:2], 3)
        axes[0, number].remove()
        panel = drawn.add_subplot(1, 3, number + 1, projection="3d")
        place = np.concatenate([xy, np.zeros((*xy.shape[:2], 1))], axis=2) + moved
        panel.plot_surface(*np.moveaxis(place, 2, 0), cmap="viridis", linewidth=0)
        panel.set(title=f"Δl {bend:g} mm, Δθ {twist:g}°", xlabel="x, mm", ylabel="y, mm")
        panel.set_box_aspect(np.ptp(place.reshape(-1, 3), axis=0))
        high = float(np.abs(moved[..., 2]).max())
        said = f"bend {bend:g} mm, twist {twist:g}°: largest deflection"
        rows += line(title, said, here=(high, "mm", None, 1))
    yield plots.keep(drawn, folder, "paper-5a.png", title, "from the nonlinear shell")
    yield from rows
