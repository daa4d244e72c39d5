"""`touchplate report`: error against run time, stiff and extreme cases, what scenes leave out."""

from __future__ import annotations

from datetime import datetime
from math import isinf
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from rig.commands.output import console, emit

if TYPE_CHECKING:
    from rich.table import Table

    from rig.report.compare import Change
    from rig.report.figure import Figure
    from rig.report.page import StudyResult
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
    data: Annotated[
        Path | None, typer.Option(help="Folder of images of others, which some studies need.")
    ] = None,
    before: Annotated[
        Path | None, typer.Option("--compare", help="An older report: say what changed since.")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Run the studies and write one page, as HTML and Markdown, and all figures as CSV.

    Started again after an interruption it goes on with the studies that are left. Where studies
    are named, the others stay on the page as the folder keeps them, each with its day. A study that
    fails stands in the report as failed, one that needs what is not there as left out.
    """
    from rig.report.build import Order, build
    from rig.report.compare import changes, kept_figures
    from rig.report.study import read_contents, shipped

    if quick and full:
        raise ValueError("a report is --quick or --full, got both; leave one out")
    effort = "quick" if quick else "full" if full else "normal"
    old = kept_figures(before) if before else {}
    contents = read_contents(studies) if studies else shipped()
    order = Order(effort, out, tuple(names or ()), data)
    results = build(contents, order, _announce, datetime.now().astimezone())
    changed = changes(old, kept_figures(out), 0.2) if before else []
    emit(_shown(results, changed, out), _data(results, changed, out), as_json)


def _announce(study: Study, count: int, total: int) -> None:
    console().print(f"{count + 1}/{total} {study.title}")


def _data(results: list[StudyResult], changed: list[Change], out: Path) -> dict[str, Any]:
    from rig.report.verdicts import judged

    verdicts = judged(figure for result in results for figure in result.figures)
    return {
        "page": str(out / "report.html"),
        "studies": {result.study.name: result.outcome.state for result in results},
        "met": len(verdicts.met),
        "not_measured": len(verdicts.not_measured),
        "missed": [_plain(figure) for figure in verdicts.missed],
        "changed": [
            {
                "study": change.study,
                "kind": change.kind,
                "before": _plain(change.before),
                "after": change.after and _plain(change.after),
            }
            for change in changed
        ],
    }


def _plain(figure: Figure) -> dict[str, Any]:
    """Return what JSON can hold of a figure."""
    bar = figure.bar and {
        name: None if isinf(limit) else limit for name, limit in figure.bar._asdict().items()
    }
    names = "table", "case", "quantity", "value", "unit", "verdict", "samples"
    return {name: getattr(figure, name) for name in names} | {"bar": bar}


def _shown(results: list[StudyResult], changed: list[Change], out: Path) -> Table:
    from rich.box import SIMPLE
    from rich.table import Table

    table = Table("", "figure", "value", "bar", box=SIMPLE, title=f"{out / 'report.html'}")
    for result in results:
        words = result.outcome.words if result.outcome.state == "left out" else ""
        table.add_row(result.outcome.state, result.study.title, words, "")
        for figure in result.figures:
            if figure.verdict == "missed":
                name = f"{figure.case}: {figure.quantity}"
                table.add_row("missed", name, figure.text, figure.asked)
    for change in changed:
        name = f"{change.before.case}: {change.before.quantity}"
        value = f"{change.before.number} → {change.now}"
        table.add_row(change.kind, name, value, change.before.asked)
    return table
