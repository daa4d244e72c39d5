"""`touchplate diagnose SCENE --images FOLDER`: what of a bench is not as its scene says."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from rig.commands.output import emit, progress

if TYPE_CHECKING:
    from rich.table import Table

    from rig.calibration.bench_causes import SeenCauses


def diagnose(
    scene: Annotated[str, typer.Argument(help="Name of a shipped scene, or a TOML file.")],
    images: Annotated[
        Path, typer.Option(help="Folder of images, the first ones untouched, then touches.")
    ],
    settings: Annotated[
        list[str] | None, typer.Option("--set", metavar="KEY=VALUE", help="Override the scene.")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Name what explains touches that do not fit: clamps, shape, tension, thickness, camera.

    Eight touches of unknown place and force are enough; each cause is tried by itself.
    """
    from rig.calibration.bench_causes import diagnose_images
    from rig.calibration.store import calibration_beside
    from rig.scene import load, parse_overrides

    loaded = load(scene, parse_overrides(settings or []))
    with progress("causes") as report:
        found = diagnose_images(loaded, calibration_beside(scene), images, report)
    emit(_table(found), _data(found), as_json)


def _table(seen: SeenCauses) -> Table:
    from rich.table import Table

    found = seen.diagnosis
    title = f"χ² as described {found.chi2:.0f}, of {found.freedom}"
    table = Table("cause", "χ²", "p-value", "largest number", title=title, caption=seen.sentence)
    for cause in found.causes:
        table.add_row(cause.name, f"{cause.chi2:.0f}", _probability(cause.p_value), cause.largest)
    return table


def _probability(p_value: float) -> str:
    """Write a p-value; one below what a number can hold is not none."""
    smallest = sys.float_info.min
    return f"{p_value:.1g}" if p_value >= smallest else f"< {smallest:.0g}"


def _data(seen: SeenCauses) -> dict[str, Any]:
    found = seen.diagnosis
    return {
        "sentence": seen.sentence,
        "occlusion": seen.occlusion,
        "chi2": found.chi2,
        "freedom": found.freedom,
        "p_value": found.p_value,
        "named": [cause.name for cause in found.named],
        "causes": [
            {
                "name": cause.name,
                "chi2": cause.chi2,
                "p_value": cause.p_value,
                "numbers": cause.size,
            }
            for cause in found.causes
        ],
    }
