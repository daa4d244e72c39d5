"""`touchplate score MODEL`: repeat the test of a stored net."""

from __future__ import annotations

from dataclasses import asdict, fields
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from pydantic import ValidationError

from rig.commands.output import emit, progress
from rig.scene import Scene
from rig.scene.refusal import sentence
from rig.simulated import Sets, lesson, model_path, simulate

if TYPE_CHECKING:
    from rich.table import Table

    from models.net import Net


def score(
    model: Annotated[str, typer.Argument(help="Name of a trained scene, or path of a model file.")],
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Repeat the test of a stored net on the touches of the scene that it was trained for."""
    from models import store

    path = model_path(model) if Path(model).suffix in ("", ".toml") else Path(model)
    trained, about = store.load(path)
    bench = _bench(about, path)
    with progress("influence") as report:
        sets = simulate(lesson(bench), report)
    scores = figures(trained.net, sets)
    emit(table(bench.title, scores), {"model": str(path)} | scores, as_json)


def figures(net: Net, sets: Sets) -> dict[str, dict[str, float]]:
    """Return the score of `net` on each data set, as plain numbers by name."""
    from models.net import predict
    from models.score import position_error
    from models.score import score as judge

    named = {field.name: getattr(sets, field.name) for field in fields(sets)}
    return {
        name: asdict(judge(position_error(data.targets, predict(net, data.strain))))
        for name, data in named.items()
    }


def table(title: str, scores: dict[str, dict[str, float]]) -> Table:
    """Return the scores as a table, in mm."""
    from rich.table import Table

    limit = next(iter(scores.values()))["limit"]
    shown = Table(
        "touches",
        "number",
        "mean mm",
        "median mm",
        "95 % mm",
        "max mm",
        f"below {limit:g} mm",
        title=title,
    )
    for name, row in scores.items():
        distances = [f"{row[key]:.3f}" for key in ("mean", "p50", "p95", "max")]
        shown.add_row(name, f"{row['count']:g}", *distances, f"{row['share']:.1%}")
    return shown


def _bench(about: dict[str, Any], path: Path) -> Scene:
    try:
        return Scene.model_validate(about.get("scene"))
    except ValidationError as error:
        raise ValueError(
            f"model file {path} names a bench that this release does not know"
            f" ({sentence(error, Scene)}); train the model again"
        ) from error
