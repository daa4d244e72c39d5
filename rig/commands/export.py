"""`touchplate export FILE --to tiff DIR`: a recording for other programs."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from rig.commands.output import emit, folder_aside, progress, require_free, warn


class Way(StrEnum):
    """What a recording can be exported to."""

    TIFF = "tiff"
    CSV = "csv"
    VTU = "vtu"
    VIDEO = "video"
    FILM = "film"


def export(
    recording: Annotated[Path, typer.Argument(help="File of a recorded session.")],
    folder: Annotated[Path, typer.Argument(help="Folder to write to.")],
    to: Annotated[
        Way,
        typer.Option(help="tiff, video: images; csv: touches; vtu: bent plates; film."),
    ],
    force: Annotated[bool, typer.Option(help="Replace files in the folder.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Write a recording as images, tables, surfaces, a video or a film of plate and touches."""
    require_free(folder, force)
    from rig.recording.export import WAYS
    from rig.recording.session import open_session

    with (
        open_session(recording) as session,
        folder_aside(folder) as aside,
        progress(f"export to {to.value}") as report,
    ):
        if session.cut:
            warn(session.cut)
        names = [path.name for path in WAYS[to.value](session, aside, report)]
        said = {"folder": str(folder), "frames": session.frames, "files": len(names)}
    emit(f"{said['files']} files of {said['frames']} frames in {folder}", said, as_json)
