"""The paper's figures of a deformable surface: 5A, 5C and 5D."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

import fe
from rig.report.figure import Figure, at_most
from rig.studies.deformable.tangent import Tangent
from rig.studies.paper.drawn import plots
from rig.studies.paper.drawn.rows import seeds
from rig.studies.paper.drawn.trainings import KeptTraining, train_kept
from rig.studies.study import line
from rig.system.arrays import F64
from rig.training.bases import RATIOS
from rig.training.model_score import base_report

TITLE = "Figures 5C and 5D: a deformable surface"
SYSTEMS = {
    "1 step, 64×4": ("paper-deformable-one-step", 5, 1.58, "tab:orange"),
    "2 steps, 64×4 and 128×4": ("paper-deformable", 3, 0.48, "tab:blue"),
    "2 steps, direction of the change": ("paper-deformable-best", 5, None, "tab:green"),
}
"""Scene, seeds, the paper's loss at the load that was learnt, colour."""

BEST = at_most(0.1)
SOLVED = 8  # touches of each test base that the solver is given
NOISE = 0.01  # over the root mean square strain of a touch of 1 N
RAISED = 3  # times the heights of figure 5A are enlarged
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
    """Solve on the tangent of each test base, which is known, without noise and with it."""
    plan, test = kept.plan, kept.bent.test
    plate, gauges = plan.plate.build(), plan.gauges.build(plan.plate)
    side = plan.training.bases.elements if plan.training.bases else 20
    shell = fe.Shell(plate, fe.Mesh(plate.size, (side, side)))
    sigma = NOISE * float(np.sqrt(np.mean(test.touch**2)))
    rng, off, noisy = np.random.default_rng(6), list[float](), list[float]()
    limits: list[float] = []
    for base, places, touch in zip(test.bases, test.places, test.touch, strict=True):
        response = fe.shell_influence(shell.at(fe.Base(*base)), gauges)
        solve = Tangent(response, plate.size)
        for place, strain in zip(places[:SOLVED], touch[:SOLVED], strict=True):
            off.append(float(np.hypot(*(solve.fit(strain)[:2] - place))))
            draw = sigma * rng.normal(size=len(strain))
            noisy.append(float(np.sum((solve.fit(strain + draw)[:2] - place) ** 2)))
            jacobian = solve.read(np.array([*place, 1.0]))[1]
            variances = np.linalg.inv(jacobian.T @ jacobian)
            limits.append(sigma**2 * float(np.trace(variances[:2, :2])))
    bound = float(np.sqrt(np.mean(limits)))
    said = "solver on the change of strain, base known, any load: "
    largest = {"largest": (max(off), "mm")}
    yield from line(
        TITLE, f"{said}loss", here=(float(np.mean(off)), "mm", None, len(off)), **largest
    )
    ratio = float(np.sqrt(np.mean(noisy))) / bound
    crb = {"bound at 1 % noise": (bound, "mm")}
    here = ratio, "", at_most(1.1), len(noisy)
    yield from line(TITLE, f"{said}÷ CRB at 1 % noise", here=here, **crb)


def shapes(folder: Path) -> Iterator[Figure]:
    """Draw a plate that is bent, twisted, and both, heights enlarged, from the shell (5A)."""
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
        panel.set_box_aspect(np.ptp(place.reshape(-1, 3), axis=0) * (1.0, 1.0, RAISED), zoom=1.15)
        panel.set_zticks([0.0, round(float(place[..., 2].max()), 1)])
        high = float(np.abs(moved[..., 2]).max())
        said = f"bend {bend:g} mm, twist {twist:g}°: largest deflection"
        rows += line(title, said, here=(high, "mm", None, 1))
    yield plots.keep(
        drawn, folder, "paper-5a.png", title, f"from the nonlinear shell, heights {RAISED} times"
    )
    yield from rows
