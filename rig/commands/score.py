"""`touchplate score MODEL`: repeat the test of a stored net."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
import typer
from pydantic import ValidationError

from rig.commands.output import emit, progress
from rig.lesson import lesson
from rig.scene import Scene
from rig.scene.refusal import sentence
from rig.simulated import Sets, model_path, simulate

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
    taught = lesson(bench)
    with progress("influence") as report:
        sets = simulate(taught, report)
    scores = figures(trained.net, sets, taught.touches)
    emit(table(bench.title, scores), {"model": str(path)} | scores, as_json)


def figures(net: Net, sets: Sets, touches: int) -> dict[str, dict[str, float]]:
    """Return the score of `net` on each data set, as plain numbers by name.

    Touches of a sample are paired with the true ones before they are measured. Where the net tells
    magnitudes their mean error follows, in units of the smallest force.
    """
    from models.net import predict

    return {
        name: _judge(data.targets, predict(net, data.strain), touches)
        for name, data in sets.named().items()
    }


def _judge(true: np.ndarray, told: np.ndarray, touches: int) -> dict[str, float]:
    from models.score import matched_error
    from models.score import score as judge

    places = [each[:, : 2 * touches].reshape(-1, touches, 2) for each in (true, told)]
    error, order = matched_error(*places)
    rows = asdict(judge(error.ravel()))
    if true.shape[1] > 2 * touches:
        forces = np.take_along_axis(told[:, 2 * touches :], order, axis=1)
        rows["magnitude"] = float(np.abs(forces - true[:, 2 * touches :]).mean())
    return rows


def table(title: str, scores: dict[str, dict[str, float]]) -> Table:
    """Return the scores as a table, in mm."""
    from rich.table import Table

    limit = next(iter(scores.values()))["limit"]
    columns = ["touches", "number", "mean mm", "median mm", "95 % mm", "max mm"]
    shown = Table(*columns, f"below {limit:g} mm", title=title)
    forces = any("magnitude" in row for row in scores.values())
    if forces:
        shown.add_column("magnitude ± smallest force")
    for name, row in scores.items():
        distances = [f"{row[key]:.3f}" for key in ("mean", "p50", "p95", "max")]
        more = [f"{row['magnitude']:.3f}"] if forces else []
        shown.add_row(name, f"{row['count']:g}", *distances, f"{row['share']:.1%}", *more)
    return shown


def _bench(about: dict[str, Any], path: Path) -> Scene:
    try:
        return Scene.model_validate(about.get("scene"))
    except ValidationError as error:
        raise ValueError(
            f"model file {path} names a bench that this release does not know"
            f" ({sentence(error, Scene)}); train the model again"
        ) from error
