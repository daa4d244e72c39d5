"""Put the headline figures of a report into the README, between two marks.

Usage: ``python benchmarks/headline.py [REPORT]``, the folder of a report, docs/report if left out.
What stands in the README is so found in the report's CSV; a test holds that.
"""

import sys
from pathlib import Path
from typing import NamedTuple

from rig.report.compare import RAW
from rig.report.figure import Figure, read

ROOT = Path(__file__).parents[1]
BEGIN, END = "<!-- figures of the report -->", "<!-- end of the figures -->"


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
        "one touch of 2 to 4 N, rms over the Cramér-Rao bound of all pixels",
        "limit", "The shipped chain", "as calibrated", "over the bound",
    ),
    Headline("its place, median", "limit", "The shipped chain", "as calibrated", "median"),
    Headline("its force, median", "limit", "The shipped chain", "as calibrated", "force"),
    Headline(
        "place, camera shifted by 0.3 px",
        "limit", "The shipped chain", "camera shifted by 0.3 px", "median",
    ),
    Headline(
        "the same bound from 72 strains, the paper's way, over that of all pixels",
        "limit", "What each way", "strain at 72 places of a ring, VSG 51 px (the paper's way)",
        "over the bound",
    ),
    Headline(
        "a frame of 1024², picture to touch",
        "chain", "Size", "tiles of 16 px (default)", "time",
    ),
    Headline(
        "strain of a clamped plate, worst, default mesh",
        "plates", "Mesh and recovery", "120 × 120 (default)", "error",
    ),
    Headline("touchplate --help", "start", "Start of a command", "touchplate --help", "time"),
    Headline(
        "two photographs of 512² correlated, start to files",
        "start", "Start of a command", "touchplate correlate, 512²", "time",
    ),
)  # fmt: skip


def main(folder: str = "docs/report") -> None:
    """Rewrite the block."""
    found = [figure_of(headline, ROOT / folder / RAW) for headline in HEADLINES]
    lines = ["| figure | measured | bar |", "|---|---|---|"]
    for headline, figure in zip(HEADLINES, found, strict=True):
        value = f"{figure.value} {figure.unit}".strip()
        lines.append(f"| {headline.words} | {value} | {figure.bar} |")
    readme = ROOT / "README.md"
    before, rest = readme.read_text(encoding="utf-8").split(BEGIN)
    after = rest.split(END)[1]
    readme.write_text(before + "\n".join([BEGIN, *lines, END]) + after, encoding="utf-8")


def figure_of(headline: Headline, raw: Path) -> Figure:
    """Find a figure in the report.

    Raises
    ------
    LookupError
        If the report does not hold it.
    """
    for figure in read(raw / f"{headline.study}.csv"):
        if figure.table.startswith(headline.table) and figure[1:3] == headline[3:]:
            return figure
    raise LookupError(f"report has no {headline[1:]}; run the study '{headline.study}' again")


if __name__ == "__main__":
    main(*sys.argv[1:])
