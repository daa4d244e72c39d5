"""`touchplate calibrate WHAT SCENE`: live or from pictures to what a bench knows of itself."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from rig.commands.output import emit

if TYPE_CHECKING:
    from rig.calibration.store import Calibration
    from rig.scene import Scene


class What(StrEnum):
    """What can be calibrated; `collect` does the rest from presses."""

    CAMERA = "camera"
    POSE = "pose"
    PROJECTOR = "projector"
    NOISE = "noise"
    LATENCY = "latency"
    STRIPES = "stripes"


PART = {"camera": "lens"}  # name of what is kept, where it is another
GUIDE = """What to do, in this order; the command and the page say it step by step:

camera: show a ChArUco board to the camera, tilted to all sides, over the whole picture.
pose: lay the board on the plate, or mark the plate's four corners in a picture.
projector: leave the plate alone while stripes are projected.
latency: leave it alone while the projector flashes.
noise: leave it alone, and change the light twice when asked.

With --pictures a folder of pictures serves: ten of the board; one of the board on the plate; one of
each picture that `stripes` writes; for noise a folder for each of three exposures."""


def calibrate(
    what: Annotated[What, typer.Argument(help=GUIDE)],
    scene: Annotated[str, typer.Argument(help="Name of a shipped scene, or a TOML file.")],
    pictures: Annotated[
        Path | None, typer.Option(help="Folder of pictures [the scene's source, live].")
    ] = None,
    squares: Annotated[tuple[int, int], typer.Option(help="Squares of the board.")] = (11, 8),
    square: Annotated[float, typer.Option(help="Side of a square, mm, as measured.")] = 20.0,
    marker: Annotated[float, typer.Option(help="Side of a marker, mm, as measured.")] = 15.0,
    leave_out: Annotated[list[int] | None, typer.Option(help="Bad view, from 0.")] = None,
    corner: Annotated[list[str] | None, typer.Option(help="x,y px of a plate corner.")] = None,
    at: Annotated[tuple[float, float], typer.Option(help="Board's top left, mm.")] = (0.0, 0.0),
    black: Annotated[float, typer.Option(help="Grey level without light.")] = 0.0,
    settings: Annotated[
        list[str] | None, typer.Option("--set", metavar="KEY=VALUE", help="Override the scene.")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Calibrate a part of a bench and keep it beside the scene, with its date and error."""
    import rig
    from rig.calibration import steps, store
    from rig.calibration.board import Board

    loaded = rig.load(scene, rig.scene.parse_overrides(settings or []))
    path = store.beside(scene)
    folder = pictures or Path()
    if what is What.STRIPES:
        folder.mkdir(parents=True, exist_ok=True)
        count = steps.write_stripes(loaded, folder)
        emit(f"{count} pictures in {folder}", {"pictures": count}, as_json)
        return
    known, board = store.read(path), Board(squares, square, marker)
    match what:
        case What.POSE if corner:
            part = steps.from_corners(loaded, known, [_pair(text) for text in corner])
        case _ if pictures is None:
            from rig.commands.guided import live

            part = live(what.value, loaded, known, board, at, black)
        case What.LATENCY:
            raise ValueError("latency is measured live; leave --pictures out")
        case What.CAMERA:
            part = steps.from_boards(folder, board, tuple(leave_out or ()))
        case What.POSE:
            part = steps.from_patch(loaded, known, folder, board, at)
        case What.PROJECTOR:
            part = steps.from_stripes(loaded, known, folder)
        case _:
            part = steps.from_stills(folder, black)
    said = _said(store.keep(path, part), what, path, loaded)
    left_out = list(getattr(part, "left_out", ()))
    lines = [f"{what.value}: error {said['error']:.3g}, residual {said['residual']:.3g}; in {path}"]
    if left_out:
        lines.append(f"views left out: {', '.join(map(str, left_out))}")
    emit("\n".join([*lines, *said["doubts"]]), said | {"left_out": left_out}, as_json)


def _said(kept: Calibration, what: What, path: Path, scene: Scene) -> dict[str, Any]:
    from datetime import UTC, datetime

    entry = getattr(kept, PART.get(what.value, what.value))
    figures = entry.model_dump(mode="json")
    return figures | {"path": str(path), "doubts": kept.doubts(scene, datetime.now(UTC))}


def _pair(text: str) -> tuple[float, float]:
    try:
        x, y = (float(part) for part in text.split(","))
    except ValueError:
        raise ValueError(f"corner must be written as x,y in px, got '{text}'") from None
    return x, y
