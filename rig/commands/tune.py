"""`touchplate tune SCENE`: search over layers and their sizes, as the paper's Table S1."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rig.commands.output import emit, progress, warn
from rig.scene import load, parse_overrides
from rig.training.data import TrainingSets, simulate_sets
from rig.training.descend import descend
from rig.training.model_score import figures
from rig.training.plan import TrainingPlan, training_plan

if TYPE_CHECKING:
    from rich.table import Table

    from models import NetCandidate


def tune(
    scene: Annotated[str, typer.Argument(help="Name of a shipped scene, or path of a TOML file.")],
    trials: Annotated[int, typer.Option(help="Architectures in all, earlier runs counted.")] = 50,
    storage: Annotated[
        str | None,
        typer.Option(help="Data base of the search; sqlite:///results/SCENE/search.db by default."),
    ] = None,
    settings: Annotated[
        list[str] | None, typer.Option("--set", help="Replace a value: section.key=value.")
    ] = None,
    scheduler: Annotated[
        str | None, typer.Option(help="Dask scheduler, tcp://host:8786; this process by default.")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Train nets of random sizes; a search that was cut off goes on where it ended."""
    from models import tune_net, workers

    bench = load(scene, parse_overrides(settings or []))
    plan = training_plan(bench)
    if storage is None:
        home = Path("results") / Path(scene).stem
        home.mkdir(parents=True, exist_ok=True)
        storage = f"sqlite:///{home / 'search.db'}"
    with workers(scheduler, warn) as each:
        with progress("influence") as report:
            sets = simulate_sets(plan, report)
        with progress("search") as report:
            found = tune_net(
                partial(_loss, plan, sets),
                trials,
                storage,
                _study(plan),
                plan.descent.seed,
                lambda done, last: report(done, trials, f"{list(last.layers)}: {last.loss:.3f} mm"),
                each,
            )
    rows = [{"loss": each.loss, "layers": list(each.layers)} for each in found]
    emit(_table(bench.title, found), {"storage": storage, "candidates": rows}, as_json)


def _loss(plan: TrainingPlan, sets: TrainingSets, layers: tuple[int, ...]) -> float:
    """Train a net with these layers by the recipe of the scene; return its validation loss."""
    return figures(descend(plan, sets, layers), sets, plan.touches)["validation"]["mean"]


def _study(plan: TrainingPlan) -> str:
    """Name a study by all that its losses depend on, so that no two kinds mix."""
    from rig.system.cache import key

    sections = (plan.plate, plan.gauges, plan.training, plan.net, plan.samples)
    return key("search", [part and part.model_dump(mode="json") for part in sections])[:16]


def _table(title: str, found: list[NetCandidate]) -> Table:
    from rich.table import Table

    shown = Table("rank", "loss mm", "layers", title=title)
    for rank, each in enumerate(found, 1):
        shown.add_row(f"{rank}", f"{each.loss:.3f}", " ".join(map(str, each.layers)))
    return shown
