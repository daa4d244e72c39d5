"""`touchplate new FILE`: a scene from what is known of a bench."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from rig.commands.output import emit, require_folder_of, say

if TYPE_CHECKING:
    from rig.setup.answers import Answers


def new(
    file: Annotated[Path, typer.Argument(help="TOML file to write; it must not exist.")],
    size: Annotated[tuple[float, float], typer.Option(help="Width and height, mm.")] = (
        254.0,
        203.0,
    ),
    thickness: Annotated[float, typer.Option(help="Thickness, mm.")] = 2.0,
    material: Annotated[str, typer.Option(help="PVC, acrylic, polycarbonate, glass, …")] = "PVC",
    edges: Annotated[str, typer.Option(help="clamped, supported or 'two clamped'.")] = "clamped",
    stand_off: Annotated[float, typer.Option(help="From camera to plate, mm.")] = 500.0,
    side: Annotated[str, typer.Option(help="Camera above or below the plate.")] = "above",
    pixels: Annotated[tuple[int, int], typer.Option(help="Of an image, px.")] = (1280, 960),
    rate: Annotated[float, typer.Option(help="Images a second.")] = 30.0,
    force: Annotated[float, typer.Option(help="Largest force of a finger, N.")] = 3.0,
    camera: Annotated[
        str | None, typer.Option(help="Device, such as /dev/video0; without it, the twin.")
    ] = None,
    projector: Annotated[
        tuple[int, int] | None, typer.Option(help="Width and height of its image, px.")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Write the scene of a bench, refused where `design` says that it cannot work.

    `touchplate setup` asks the same on a page, and goes on to the calibration.
    """
    from rig.setup.judgement import refusal
    from rig.setup.scene_file import scene_text, spot, write_text

    _require_new(file)
    said: dict[str, Any] = {
        "width": size[0], "height": size[1], "thickness": thickness, "material": material,
        "edges": edges, "stand_off": stand_off, "side": side,
        "pixels": f"{pixels[0]} x {pixels[1]}", "rate": rate, "force": force,
        "projector": "yes" if projector else "no", "camera": camera or "",
    }  # fmt: skip
    if projector:
        said["screen"] = f"{projector[0]} x {projector[1]}"
    answers = _answers(said)
    say("one moment: the bench is judged")
    if why := refusal(answers):
        raise ValueError(why)
    write_text(file, scene_text(answers))
    named = shlex.quote(str(file))
    emit(
        f"scene in {file}, for speckles of {spot(answers):g} mm; look at it with `touchplate design"
        f" {named}`, and go on with `touchplate setup` for a calibrated bench",
        {"file": str(file), "speckle_mm": spot(answers)},
        as_json,
    )


def _require_new(file: Path) -> None:
    """Refuse a file that is no scene's, or that is there."""
    require_folder_of(file, "scene", ".toml")
    if file.exists():
        raise OSError(f"scene '{file}' exists; name another, or move it away")


def _answers(said: dict[str, Any]) -> Answers:
    """Check what was said, value by value, as the setup does."""
    from rig.setup.answers import NOTHING_SAID, with_answer

    answers = NOTHING_SAID
    for key, value in said.items():
        answers = with_answer(answers, key, str(value))
    return answers
