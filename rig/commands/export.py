"""`touchplate export FILE --to tiff DIR`: a recording or a whole test for other programs."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from rig.commands.output import emit, folder_aside, progress, require_free, warn


class Way(StrEnum):
    """What a recording or a test can be exported to."""

    TIFF = "tiff"
    CSV = "csv"
    NPZ = "npz"
    MAT = "mat"
    VTU = "vtu"
    PNG = "png"
    MP4 = "mp4"
    VIDEO = "video"
    FILM = "film"


def export(
    recording: Annotated[
        Path, typer.Argument(metavar="FILE", help="Recorded session, or fields.h5 of a test.")
    ],
    folder: Annotated[Path, typer.Argument(help="Folder to write to.")],
    to: Annotated[
        Way,
        typer.Option(
            help="Of a recording: tiff, csv, vtu, video, film; of a test: csv, npz, mat, vtu, "
            "png, mp4."
        ),
    ],
    field: Annotated[str, typer.Option(help="Field of a test that png and mp4 show.")] = "exx",
    force: Annotated[bool, typer.Option(help="Replace files in the folder.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Write a recording or a test as images, tables, arrays, surfaces, plots or a video."""
    from rig.series.read import is_result

    require_free(folder, force)
    if is_result(recording):
        said = _of_test(recording, folder, to, field)
    else:
        said = _of_session(recording, folder, to)
    emit(f"{said['files']} files of {said['frames']} frames in {folder}", said, as_json)


def _of_test(path: Path, folder: Path, to: Way, field: str) -> dict[str, str | int]:
    from rig.series.export import WAYS
    from rig.series.read import open_result

    _require(to, tuple(WAYS), f"'{path}' is the result of a test")
    with (
        open_result(path) as result,
        folder_aside(folder) as aside,
        progress(f"export to {to.value}") as report,
    ):
        names = [one.name for one in WAYS[to.value](result, aside, field, report)]
        return {"folder": str(folder), "frames": len(result.names), "files": len(names)}


def _of_session(path: Path, folder: Path, to: Way) -> dict[str, str | int]:
    from rig.recording.export import WAYS
    from rig.recording.session import open_session

    with (
        open_session(path) as session,
        folder_aside(folder) as aside,
        progress(f"export to {to.value}") as report,
    ):
        _require(to, tuple(WAYS), f"'{path}' is a recording")
        if session.cut:
            warn(session.cut)
        names = [one.name for one in WAYS[to.value](session, aside, report)]
        return {"folder": str(folder), "frames": session.frames, "files": len(names)}


def _require(to: Way, ways: tuple[str, ...], what: str) -> None:
    if to.value not in ways:
        raise ValueError(f"{what}, which is not exported to {to.value}; use {', '.join(ways)}")
