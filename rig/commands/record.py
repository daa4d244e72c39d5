"""`touchplate record SCENE NAME`: the live loop without windows, kept under a name."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from rig.commands.run import known, live
from rig.recording.paths import FOLDER


def record(
    scene: Annotated[str, typer.Argument(help="Name of a shipped scene, or a TOML file.")],
    name: Annotated[str, typer.Argument(help="Name of the recording, without folders.")],
    folder: Annotated[Path, typer.Option(help="Folder of the recordings.")] = Path(FOLDER),
    frames: Annotated[
        int | None, typer.Option(min=1, help="Stop after so many frames, else by Ctrl-C.")
    ] = None,
    settings: Annotated[
        list[str] | None, typer.Option("--set", metavar="KEY=VALUE", help="Override the scene.")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Run the loop of a scene without page and projector, and record it."""
    import rig
    from rig.recording.paths import named

    path = named(folder, name)
    loaded = rig.load(scene, rig.scene.parse_overrides(settings or []))
    folder.mkdir(parents=True, exist_ok=True)
    live(loaded, known(scene, loaded), frames, True, path, as_json)
