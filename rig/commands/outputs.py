"""`touchplate outputs`: which screens there are, and which of them is the projector."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import typer

from rig.commands.output import emit

if TYPE_CHECKING:
    from rich.table import Table

    from rig.projector.outputs import Output

SECONDS = 3.0


def outputs(
    scene: Annotated[
        str | None, typer.Argument(help="Scene whose projector is looked for, name or TOML file.")
    ] = None,
    flash: Annotated[
        bool, typer.Option("--flash", help="Let each screen flash and show its number.")
    ] = False,
    settings: Annotated[
        list[str] | None, typer.Option("--set", metavar="KEY=VALUE", help="Override the scene.")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """List the outputs of the desktop; with a scene, which of them its projector takes."""
    import rig

    loaded = rig.load(scene, rig.scene.parse_overrides(settings or [])) if scene else None
    section = loaded.projector if loaded else None
    found = _started(section.display if section else None)
    from rig.projector.outputs import choose_output

    chosen = choose_output(found, section.output, section.size) if section else None
    emit(_table(found, chosen), _summary(found, chosen), as_json)
    if flash:
        from rig.projector.flash import flash as let_flash

        let_flash((chosen,) if chosen else found, SECONDS)


def _started(display: str | None) -> tuple[Output, ...]:
    """Start SDL on a display and list its outputs."""
    from rig.projector.outputs import list_outputs, start_display, use_display

    use_display(display)
    start_display(display)
    return list_outputs()


def _summary(found: tuple[Output, ...], chosen: Output | None) -> dict[str, Any]:
    return {
        "outputs": [
            {"index": one.index, "name": one.name, "size": one.size, "place": one.place}
            for one in found
        ],
        "projector": chosen.index if chosen else None,
    }


def _table(found: tuple[Output, ...], chosen: Output | None) -> Table:
    from rich.table import Table

    table = Table("output", "name", "size, px", "place, px", "")
    for one in found:
        place = f"{one.place[0]}, {one.place[1]}" if one.place else ""
        said = "the projector" if one is chosen else ""
        table.add_row(str(one.index), one.name, f"{one.size[0]} × {one.size[1]}", place, said)
    return table
