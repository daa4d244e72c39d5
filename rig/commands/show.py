"""`touchplate show SCENE`: what is in, what is left out and why, and what each part costs."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING, Annotated

import typer

from rig.commands.output import emit

if TYPE_CHECKING:
    from rich.console import Group

    from rig.scene.account import Account


def show(
    scene: Annotated[str, typer.Argument(help="Name of a shipped scene, or path of a TOML file.")],
    settings: Annotated[
        list[str] | None, typer.Option("--set", help="Replace a value: section.key=value.")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Say what a scene contains, what it leaves out and why, and what each part costs."""
    from rig.scene import load, parse_overrides
    from rig.scene.account import account

    said = account(load(scene, parse_overrides(settings or [])))
    emit(_tables(said), asdict(said), as_json)


def _tables(said: Account) -> Group:
    from rich.box import SIMPLE
    from rich.console import Group
    from rich.table import Table

    parts = Table("in", "what", "cost", "imports", box=SIMPLE, title=said.title)
    for part in said.parts:
        parts.add_row(part.name, part.what, part.cost, "\n".join(part.imports))
    left_out = Table("left out", "why", box=SIMPLE)
    for part in said.left_out:
        left_out.add_row(part.name, part.why)
    return Group(parts, left_out)
