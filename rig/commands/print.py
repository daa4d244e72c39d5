"""`touchplate print WHAT`: what a bench needs on paper, at true scale."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from rig.commands.calibrate import (
    MARKER,
    SQUARE,
    SQUARES,
    Json,
    Marker,
    Name,
    Settings,
    Square,
    Squares,
)
from rig.commands.output import emit

File = Annotated[Path, typer.Argument(help="File to write, *.pdf or *.png.")]
ADVICE = "print it at 100 % and hold a ruler to it"

print = typer.Typer(no_args_is_help=True)


@print.command()
def board(
    file: File,
    squares: Squares = SQUARES,
    square: Square = SQUARE,
    marker: Marker = MARKER,
    as_json: Json = False,
) -> None:
    """Print the ChArUco board that `calibrate camera` and `calibrate pose` look for."""
    from rig.calibration.board import CharucoBoard
    from rig.calibration.board_print import print_board

    printed = CharucoBoard(squares, square, marker)
    print_board(file, printed)
    a, b = printed.size
    said = {"file": str(file), "size_mm": [a, b]}
    emit(f"board of {a:g} × {b:g} mm in {file}; {ADVICE}", said, as_json)


@print.command()
def speckle(
    scene: Name,
    file: File,
    dpi: Annotated[float, typer.Option(min=1, help="Dots per inch of a PNG.")] = 600.0,
    settings: Settings = None,
    as_json: Json = False,
) -> None:
    """Print the speckle pattern of a scene, for its plate."""
    import rig
    import synthetic

    loaded = rig.load(scene, rig.scene.parse_overrides(settings or []))
    if loaded.plate is None or loaded.pattern is None:
        raise ValueError(f"scene '{loaded.title}' has no pattern; add [plate] and [pattern]")
    pattern = loaded.pattern.build(loaded.plate)
    synthetic.print_pattern(file, pattern, dpi)
    a, b = loaded.plate.size
    said = {"file": str(file), "size_mm": [a, b], "spots": len(pattern.centres)}
    emit(f"{len(pattern.centres)} spots on {a:g} × {b:g} mm in {file}; {ADVICE}", said, as_json)
