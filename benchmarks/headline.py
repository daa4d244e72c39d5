"""Put figures of a report into the README and the tutorials, each table between two marks.

Usage: ``python benchmarks/headline.py [REPORT]``, the folder of a full report, docs/report if left
out. What stands there is so found in the report's CSV; a test holds that.
"""

import sys
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from rig.report.compare import RAW
from rig.report.figure import Figure, read

ROOT = Path(__file__).parents[1]
FIGURES = "<!-- figures of the report -->", "<!-- end of the figures -->"
STEPS = "<!-- times of the steps -->", "<!-- end of the times -->"
TUTORIALS = ("docs/tutorials/photographs.md", "docs/tutorials/plate.md")


class Headline(NamedTuple):
    """A figure for the README: its words there, and where it stands in the report.

    Tables are found by how they begin, cases by their whole name.
    """

    words: str
    study: str
    table: str
    case: str
    quantity: str


HEADLINES = (
    Headline(
        "one touch of 2 to 4 N: rms error of the place over its Cramér-Rao bound from all pixels",
        "shipped", "The shipped chain", "as calibrated", "÷ CRB",
    ),
    Headline("its place, median error", "shipped", "The shipped chain", "as calibrated", "median"),
    Headline("its force, error", "shipped", "The shipped chain", "as calibrated", "force"),
    Headline(
        "bound from 72 strains, the paper's way, over that from all pixels",
        "limit", "What each way", "strain at 72 places of a ring, VSG 51 px (the paper's way)",
        "÷ CRB",
    ),
    Headline(
        "time from a frame of 1024² to its touches",
        "chain", "Size", "tiles of 16 px (default)", "time",
    ),
    Headline(
        "full field of 512², subset 21, step 5, order 1, from nothing",
        "correlation", "Correlation of a rigid shift", "ours 21/5, order 1 (default)", "time",
    ),
    Headline(
        "72 points tracked in 1024², run time over that of OpenCV's PyrLK",
        "ratios", "Run time", "72 points tracked, 1024², subset 31: OpenCV's PyrLK", "ratio",
    ),
    Headline(
        "one touch from 72 strains, noise 1 %: solver, rms over its bound",
        "estimators", "One touch", "solver (default)", "÷ CRB",
    ),
    Headline(
        "the paper's 289 touches, best recipe, mean error of 3000 random ones",
        "paper-figures", "Figures 3A and 3B", "best recipe: loss", "here",
    ),
    Headline(
        "strain of a clamped plate 5 mm inside its edges, the paper's 289 loads: worst",
        "bars-plates", "Strain of the paper's 289 loads", "5 mm inside (reading A)", "worst",
    ),
    Headline("`touchplate show twin`", "start", "Start", "touchplate show twin", "time"),
    Headline(
        "two photographs of 512² correlated, start to plot",
        "start", "Start", "touchplate correlate, 512²", "time",
    ),
)  # fmt: skip


def main(folder: str = "docs/report") -> None:
    """Rewrite the tables."""
    raw = ROOT / folder / RAW
    rewrite(ROOT / "README.md", FIGURES, lambda _: headlines(raw))
    for page in TUTORIALS:
        rewrite(ROOT / page, STEPS, lambda text: steps(raw, text))


def rewrite(page: Path, marks: tuple[str, str], lines: Callable[[str], list[str]]) -> None:
    """Put the lines that belong to the text of a page between its marks."""
    text = page.read_text(encoding="utf-8")
    page.write_text(between(text, marks, lines(text.split(marks[0])[0])), encoding="utf-8")


def headlines(raw: Path) -> list[str]:
    """Return the table of the headlines."""
    lines = ["| figure | measured | bar |", "|---|---|---|"]
    for headline in HEADLINES:
        figure = figure_of(headline, raw)
        lines.append(f"| {headline.words} | {figure.text} | {figure.asked} |")
    return lines


def steps(raw: Path, text: str) -> list[str]:
    """Return the table of those of a newcomer's steps that a text names, a line a command."""
    lines, found = ["| command | first time | again |", "|---|---|---|"], {}
    for figure in read(raw / "newcomer.csv"):
        found.setdefault(figure.case, {})[figure.quantity] = figure.text
    for command, times in found.items():
        if command not in text:
            continue
        lines.append(f"| `{command}` | {times['first time']} | {times.get('again', '')} |")
    return lines


def between(text: str, marks: tuple[str, str], lines: list[str]) -> str:
    """Put lines in place of those between two marks."""
    before, rest = text.split(marks[0])
    return before + "\n".join([marks[0], *lines, marks[1]]) + rest.split(marks[1])[1]


def figure_of(headline: Headline, raw: Path) -> Figure:
    """Find a figure in the report.

    Raises
    ------
    LookupError
        If the report does not hold it.
    """
    for figure in read(raw / f"{headline.study}.csv"):
        if figure.table.startswith(headline.table) and figure.place[1:] == headline[3:]:
            return figure
    raise LookupError(f"report has no {headline[1:]}; run the study '{headline.study}' again")


if __name__ == "__main__":
    main(*sys.argv[1:])
