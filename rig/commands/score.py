"""`touchplate score MODEL`: repeat the test of a stored net, or score a recording."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rig.commands.net_file import net_file
from rig.commands.output import emit, progress
from rig.commands.score_displacement_net import score_displacement_net
from rig.commands.score_table import table, touch_table, write_map
from rig.commands.score_touch_net import score_touch_net
from rig.scene import parse_overrides
from rig.training.data import model_path
from rig.training.model_score import Scored, is_recording, score_model, score_recording

if TYPE_CHECKING:
    from collections.abc import Callable

    from rich.console import Group


def score(
    model: Annotated[
        str,
        typer.Argument(help="Name of a trained scene, path of a model file, or of a recording."),
    ],
    error_map: Annotated[
        Path | None,
        typer.Option("--map", metavar="FILE", help="Write the error over the plate: .csv or .png."),
    ] = None,
    settings: Annotated[
        list[str] | None,
        typer.Option(
            "--set", help="Test on others: replace a value of its scene, section.key=value."
        ),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Repeat the test of a stored net on the touches of the scene that it was trained for.

    With --set it is tested on others, as far as it learnt them. Of a recording whose truth is
    known, as in the twin, the touches that were found are scored. A touch net is scored on
    touches that are drawn on its bench, beside the solver; a net of displacement on drawn pairs
    of images, beside the adaptive field.
    """
    net = net_file(model)
    if net is not None:
        if error_map or settings:
            raise ValueError("such a net is scored on drawn data; leave --map and --set out")
        _score_net(net, as_json)
        return
    path = model_path(model) if Path(model).suffix in ("", ".toml") else Path(model)
    with progress("influence") as report:
        scored = _scored(path, settings or [], report)
    if error_map:
        write_map(error_map, scored.map())
    said = {"model": str(path)} | scored.nets
    if scored.touches:
        said |= {"touches": asdict(scored.touches), "bands": [asdict(one) for one in scored.bands]}
    emit(_tables(scored), said, as_json)


def _score_net(path: Path, as_json: bool) -> None:
    from models import DISPLACEMENT_FORMATS, net_format

    measures = net_format(path) in DISPLACEMENT_FORMATS
    with progress("measuring") as report:
        (score_displacement_net if measures else score_touch_net)(path, report, as_json)


def _scored(path: Path, settings: list[str], report: Callable[[int, int], None]) -> Scored:
    if not is_recording(path):
        return score_model(path, report, parse_overrides(settings))
    if settings:
        raise ValueError(f"recording '{path}' is scored as it was made; leave --set out")
    return score_recording(path)


def _tables(scored: Scored) -> Group:
    from rich.console import Group

    shown = [table(scored.title, scored.nets)] if scored.nets else []
    if scored.touches:
        shown.append(touch_table(scored.title, scored.touches, scored.bands))
    return Group(*shown)
