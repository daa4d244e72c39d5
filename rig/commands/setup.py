"""`touchplate setup [SCENE]`: from nothing to a calibrated bench, on a page or in the terminal."""

from __future__ import annotations

import shlex
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rig.commands.output import console, emit, require_folder_of, say
from rig.system.process import interruptible

if TYPE_CHECKING:
    from rig.setup.bench import SetupBench
    from rig.setup.desk import Desk

SCENE = Path("my-bench.toml")
REHEARSAL = Path("rehearsal.toml")


def setup(
    scene: Annotated[
        Path | None, typer.Argument(help="TOML file to write or to resume; else my-bench.toml.")
    ] = None,
    rehearse: Annotated[
        bool, typer.Option("--rehearse", help="Practise on a twin; in rehearsal.toml.")
    ] = False,
    terminal: Annotated[
        bool, typer.Option("--terminal", help="Ask in the terminal, without a page.")
    ] = False,
    port: Annotated[int, typer.Option(help="Port of the page, 0 for any free one.")] = 8765,
    seed: Annotated[int, typer.Option(min=0, help="Draws the twin of a rehearsal.")] = 0,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Set a bench up step by step; leave at any of them, and resume by the same command.

    Everything lies beside the scene: what was said, what is done, and the calibration.
    """
    path = scene or (REHEARSAL if rehearse else SCENE)
    require_folder_of(path, "scene", ".toml")
    from rig.setup.run import set_up
    from rig.setup.session import read_state, state_beside

    complete = False
    with suppress(KeyboardInterrupt), ExitStack() as parts, interruptible():
        bench = _bench(rehearse, seed)
        complete = set_up(path, bench, _desk(terminal, port, parts))
    again = (
        f"left; resume with: touchplate setup {shlex.quote(str(path))}{' --rehearse' * rehearse}"
    )
    said = {"scene": str(path), "complete": complete, "steps": read_state(state_beside(path)).done}
    emit("all steps are done" if complete else again, said, as_json)


def _bench(rehearse: bool, seed: int) -> SetupBench:
    if rehearse:
        from rig.setup.rehearsal import RehearsedBench

        return RehearsedBench(seed)
    from rig.setup.real_bench import RealBench

    return RealBench(say)


def _desk(terminal: bool, port: int, parts: ExitStack) -> Desk:
    if terminal:
        from rig.setup.terminal_desk import TerminalDesk, typed_lines

        return TerminalDesk(say, typed_lines())
    from rig.page import serve
    from rig.setup.page_desk import PAGE, PageDesk
    from rig.web.access import access_of

    publisher = parts.enter_context(serve(port, None, access_of("user", control=False)))
    console().print(f"page: [bold]{publisher.address(PAGE)}[/bold]   (Ctrl-C leaves)", markup=True)
    return PageDesk(publisher)
