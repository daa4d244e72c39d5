"""`touchplate report`: error against run time, stiff and extreme cases, what scenes leave out."""

from __future__ import annotations

from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from rig.commands.output import console, emit

if TYPE_CHECKING:
    from rich.table import Table

    from rig.report.compare import Change
    from rig.report.page import Result
    from rig.report.study import Study


def report(
    names: Annotated[
        list[str] | None, typer.Argument(help="Studies to run; all of them if none is named.")
    ] = None,
    out: Annotated[Path, typer.Option(help="Folder of the report.")] = Path("results/report"),
    quick: Annotated[bool, typer.Option("--quick", help="About two minutes.")] = False,
    full: Annotated[bool, typer.Option("--full", help="Everything, without limit.")] = False,
    studies: Annotated[
        Path | None, typer.Option(help="Folder of your own studies, in place of those shipped.")
    ] = None,
    before: Annotated[
        Path | None, typer.Option("--compare", help="An older report: say what changed since.")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Run the studies and write one page, as HTML and Markdown, and all figures as CSV.

    Started again after an interruption it goes on with the studies that are left. A study that
    fails stands in the report as failed.
    """
    from rig.report.build import build
    from rig.report.compare import changes
    from rig.report.study import read_contents, shipped

    if quick and full:
        raise ValueError("a report is --quick or --full, got both; leave one out")
    effort = "quick" if quick else "full" if full else "normal"
    contents = read_contents(studies) if studies else shipped()
    results = build(contents, effort, out, names or [], _tell, datetime.now().astimezone())
    changed = changes(before, out, 0.2) if before else []
    emit(_shown(results, changed, out), _data(results, changed, out), as_json)


def _tell(study: Study, count: int, total: int) -> None:
    console().print(f"{count + 1}/{total} {study.title}")


def _data(results: list[Result], changed: list[Change], out: Path) -> dict[str, Any]:
    return {
        "page": str(out / "report.html"),
        "studies": {result.study.name: result.outcome.state for result in results},
        "missed": [
            figure._asdict()
            for result in results
            for figure in result.figures
            if figure.verdict == "missed"
        ],
        "changed": [
            {"study": c.study, "before": c.before.value, **c.after._asdict()} for c in changed
        ],
    }


def _shown(results: list[Result], changed: list[Change], out: Path) -> Table:
    from rich.box import SIMPLE
    from rich.table import Table

    table = Table("", "figure", "value", "bar", box=SIMPLE, title=f"{out / 'report.html'}")
    for result in results:
        table.add_row(result.outcome.state, result.study.title, "", "")
        for figure in result.figures:
            if figure.verdict == "missed":
                value = f"{figure.value} {figure.unit}".strip()
                table.add_row("missed", f"{figure.case}: {figure.quantity}", value, figure.bar)
    for change in changed:
        name = "lost" if change.lost else "changed"
        value = f"{change.before.value} → {change.after.value} {change.after.unit}".strip()
        table.add_row(name, f"{change.after.case}: {change.after.quantity}", value, "")
    return table
