"""The page of a report: Markdown with pictures beside it, and the same as one HTML file."""

from __future__ import annotations

import base64
import re
from dataclasses import dataclass
from pathlib import Path

from rig.report import bars, pareto, plate_map, table
from rig.report.figure import Figure
from rig.report.runner import Outcome
from rig.report.study import Section, Study

PICTURES = "pictures"
STYLE = """
body { max-width: 68rem; margin: 2rem auto; padding: 0 1rem; font: 15px/1.55 system-ui, sans-serif;
  color: #222; background: #fff }
h1, h2, h3, h4 { line-height: 1.25; margin: 2.2em 0 .6em } h1 { margin-top: 0 }
table { border-collapse: collapse; margin: 1em 0; font-size: 13.5px; display: block;
  overflow-x: auto }
th, td { padding: .28em .7em; border-bottom: 1px solid #ddd; text-align: left;
  vertical-align: top }
th { border-bottom-color: #888; white-space: nowrap } tr:hover td { background: #f6f6f6 }
img { max-width: 100% } code { font-size: 92% } blockquote { margin: 1em 0; padding: .2em 1em;
  border-left: 3px solid #c33 }
@media (prefers-color-scheme: dark) { body { color: #ddd; background: #161616 }
  th, td { border-color: #333 } tr:hover td { background: #222 } img { background: #fff } }
"""


@dataclass(frozen=True)
class Result:
    """A study, what came of it and what it found."""

    study: Study
    outcome: Outcome
    figures: tuple[Figure, ...]


def write(folder: Path, head: str, parts: list[tuple[Section, list[Result]]]) -> None:
    """Write report.md, its pictures, and report.html, which holds all of it."""
    blocks = [head, _overview(parts)]
    for section, results in parts:
        blocks += [f"## {section.title}", section.text]
        for result in results:
            blocks += _study(result, folder)
    text = "\n\n".join(block.strip() for block in blocks if block.strip()) + "\n"
    (folder / "report.md").write_text(text, encoding="utf-8")
    (folder / "report.html").write_text(_html(text, folder), encoding="utf-8")


def _overview(parts: list[tuple[Section, list[Result]]]) -> str:
    """List what ran, and count the bars."""
    lines = [
        "| study | what came of it | bars met | wall time | CPU time |",
        "|---|---|---|---|---|",
    ]
    for _, results in parts:
        for study, outcome, figures in ((r.study, r.outcome, r.figures) for r in results):
            judged = [figure.verdict for figure in figures if figure.verdict]
            bars = f"{judged.count('met')} of {len(judged)}" if judged else ""
            lines.append(
                f"| {study.title} | {outcome.state} | {bars} | {outcome.seconds:.0f} s |"
                f" {outcome.cpu:.0f} s |"
            )
    return "\n".join(lines)


def _study(result: Result, folder: Path) -> list[str]:
    blocks = [f"### {result.study.title}", result.study.text]
    if result.outcome.state != "done":
        words = " ".join(result.outcome.words.split()) or "it said nothing"
        blocks.append(f"> **{result.outcome.state}**: `{words.replace('`', '')}`")
    for count, (title, figures) in enumerate(table.tables(result.figures).items()):
        picture = f"{PICTURES}/{result.study.name}-{count + 1}.png"
        blocks += [f"#### {title}", *_shown(figures, folder, picture)]
    return blocks


def _shown(figures: list[Figure], folder: Path, picture: str) -> list[str]:
    """Show a table as lines, as a picture, or as both."""
    (folder / PICTURES).mkdir(exist_ok=True)
    link = f"![{figures[0].table}]({picture})"
    if plate_map.is_map(figures):
        plate_map.draw(figures, folder / picture)
        return [link]
    lines, trades = table.markdown(figures), pareto.trades(figures)
    if len(trades) > 1:
        pareto.draw(figures, folder / picture)
        best = " → ".join(trade.case for trade in pareto.front(trades))
        return [link, f"Not beaten in both: {best}.", lines]
    if len(bars.ratios(figures)) > 2:
        bars.draw(figures, folder / picture)
        return [link, lines]
    return [lines]


def _html(text: str, folder: Path) -> str:
    """Return the Markdown as one HTML page that needs no other file."""
    from markdown_it import MarkdownIt

    body = MarkdownIt("commonmark").enable("table").render(text)

    def embedded(found: re.Match[str]) -> str:
        data = base64.b64encode((folder / found[1]).read_bytes()).decode()
        return f'src="data:image/png;base64,{data}"'

    body = re.sub(rf'src="({PICTURES}/[a-z0-9-]+\.png)"', embedded, body)
    title = text.partition("\n")[0].lstrip("# ")
    return (
        '<!doctype html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>{title}</title><style>{STYLE}</style></head>\n<body>\n{body}</body></html>\n"
    )
