"""The page of a report: Markdown with plots beside it, and the same as one HTML file."""

from __future__ import annotations

import base64
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import chain
from pathlib import Path

from rig.report import crb, front, pareto, plate_map, table
from rig.report.figure import DRAWING, Figure
from rig.report.origin import Origin
from rig.report.runner import Outcome
from rig.report.study import Section, Study, Topic
from rig.report.verdicts import Verdicts, judged

PLOTS = "plots"
FRONT = f"{PLOTS}/front.png"
TITLE = "Report: error against run time, stiff and extreme cases"
STYLE = """
body { max-width: 84rem; margin: 1.2rem auto; padding: 0 1rem; color: #222; background: #fff;
  font: 15px/1.5 system-ui, sans-serif }
h1, h2, h3, h4 { line-height: 1.25; margin: 2em 0 .6em } h1 { margin: 0 0 .3em; font-size: 1.5em }
table { border-collapse: collapse; margin: .8em 0; font-size: 13.5px; display: block;
  overflow-x: auto }
th, td { padding: .25em .65em; border-bottom: 1px solid #ddd; text-align: left;
  vertical-align: top }
th { border-bottom-color: #888; white-space: nowrap } tr:hover td { background: #f6f6f6 }
img { max-width: min(100%, 62rem) } code { font-size: 92% } blockquote { margin: 1em 0;
  padding: .2em 1em; border-left: 3px solid #c33 }
.front { display: grid; grid-template-columns: minmax(0, 5fr) minmax(20rem, 3fr); gap: 0 1.6rem }
.front > :last-child { font-size: 14px } .front table { font-size: 12.5px; max-height: 26rem;
  overflow-y: auto }
@media (max-width: 60rem) { .front { display: block } }
@media (prefers-color-scheme: dark) { body { color: #ddd; background: #161616 }
  th, td { border-color: #333 } tr:hover td { background: #222 } img { background: #fff } }
"""


@dataclass(frozen=True)
class StudyResult:
    """A study, its outcome and what it found."""

    study: Study
    outcome: Outcome
    figures: tuple[Figure, ...]


@dataclass(frozen=True)
class PageParts:
    """What a page is made of: results by section, and bars that may not be measured yet."""

    sections: tuple[tuple[Section, tuple[StudyResult, ...]], ...]
    open_bars: tuple[Topic, ...] = ()

    @property
    def results(self) -> tuple[StudyResult, ...]:
        """All results, in their order."""
        return tuple(result for _, results in self.sections for result in results)

    @property
    def figures(self) -> tuple[Figure, ...]:
        """All figures, those that are not measured yet among them."""
        return tuple(chain(self._found, *(topic.figures for topic in self.not_measured)))

    @property
    def not_measured(self) -> tuple[Topic, ...]:
        """The bars of which no result has a figure."""
        measured = {(f.case, f.quantity) for f in self._found if f.value is not None}
        left = (topic.without(measured) for topic in self.open_bars)
        return tuple(topic for topic in left if topic.bars)

    @property
    def _found(self) -> tuple[Figure, ...]:
        return tuple(chain.from_iterable(result.figures for result in self.results))


def write(folder: Path, origin: Origin, parts: PageParts) -> None:
    """Write report.md, its plots, and report.html, which holds all of it."""
    (folder / PLOTS).mkdir(parents=True, exist_ok=True)
    opening, count = _panels(parts.results, folder), _count(judged(parts.figures), origin)
    rest = _text([*_overview(parts, origin), *_sections(parts, folder), *_open(parts.not_measured)])
    (folder / "report.md").write_text(_text([f"# {TITLE}", count, opening, rest]), encoding="utf-8")
    (folder / "report.html").write_text(_html(opening, count, rest, folder), encoding="utf-8")


def _panels(results: Iterable[StudyResult], folder: Path) -> str:
    """Draw what the page opens with; return its link, or nothing without such a table."""
    panels: list[front.Panel] = []
    for result in results:
        tables = table.tables(result.figures) if result.study.front else {}
        for title, figures in tables.items():
            if title.startswith(result.study.front) and pareto.trades(figures):
                name = result.study.title.partition(":")[0]
                panels.append(front.Panel(name, title, tuple(figures)))
                break
    if not panels:
        return ""
    front.draw(panels, folder / FRONT)
    return f"![Error against run time]({FRONT})"


def _count(verdicts: Verdicts, origin: Origin) -> str:
    """Count the bars, name those that are missed, and say where and when that was."""
    blocks = [f"**Bars: {verdicts.sentence}.**" if verdicts.any else ""]
    if verdicts.missed:
        lines = ["| missed | is | bar |", "| --- | --- | --- |"]
        for f in verdicts.missed:
            cells = f"{f.table}: {f.case}, {f.quantity}", f.text, f.asked
            lines.append(f"| {' | '.join(table.escaped(cell) for cell in cells)} |")
        blocks.append("\n".join(lines))
    return _text([*blocks, origin.built])


def _overview(parts: PageParts, origin: Origin) -> list[str]:
    """List what ran, and the bars of each."""
    lines = [
        "| study | outcome | day | met | missed | not measured | wall time | CPU time |",
        "| --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    for study, outcome, figures in ((r.study, r.outcome, r.figures) for r in parts.results):
        bars = " | ".join(str(len(part) or "") for part in judged(figures))
        times = f"{outcome.seconds:.0f} s | {outcome.cpu:.0f} s"
        state = f"{_state(outcome)} | {outcome.date}"
        lines.append(f"| {study.title} | {state} | {bars} | {times} |")
    return ["## What ran", "\n".join(lines), origin.particulars]


def _state(outcome: Outcome) -> str:
    left_out = outcome.state == "left out"
    return f"left out: {outcome.words}" if left_out else outcome.state


def _sections(parts: PageParts, folder: Path) -> list[str]:
    blocks: list[str] = []
    for section, results in parts.sections:
        blocks += [f"## {section.title}", section.text]
        for result in results:
            blocks += _study(result, folder)
    return blocks


def _study(result: StudyResult, folder: Path) -> list[str]:
    blocks = [f"### {result.study.title}", result.study.text]
    if result.outcome.state == "left out":
        blocks.append(f"> **{_state(result.outcome)}**")
    elif result.outcome.state != "done":
        words = " ".join(result.outcome.words.split()) or "it said nothing"
        blocks.append(f"> **{result.outcome.state}**: `{words.replace('`', '')}`")
    for count, (title, figures) in enumerate(table.tables(result.figures).items()):
        plot = f"{PLOTS}/{result.study.name}-{count + 1}.png"
        blocks += [f"#### {title}", *_shown(figures, folder, plot)]
    return blocks


def _shown(figures: list[Figure], folder: Path, plot: str) -> list[str]:
    """Show a table as lines, as a plot, or as both, below what its study has drawn."""
    drawn = [f"![{f.case}]({PLOTS}/{f.value})" for f in figures if f.quantity == DRAWING]
    figures = [figure for figure in figures if figure.quantity != DRAWING]
    return drawn + (_table(figures, folder, plot) if figures else [])


def _table(figures: list[Figure], folder: Path, plot: str) -> list[str]:
    link = f"![{figures[0].table}]({plot})"
    if plate_map.is_map(figures):
        plate_map.draw(figures, folder / plot)
        return [link]
    lines, trades = table.markdown(figures), pareto.trades(figures)
    if len(trades) > 1:
        pareto.draw(figures, folder / plot)
        best = " → ".join(trade.case for trade in pareto.front(trades))
        return [link, f"Not beaten in both: {best}.", lines]
    if len(crb.ratios(figures)) > 2:
        crb.draw(figures, folder / plot)
        return [link, lines]
    return [lines]


def _open(topics: Sequence[Topic]) -> list[str]:
    """List the bars that are not measured yet."""
    blocks = ["## Bars that are not measured yet"] if topics else []
    for topic in topics:
        lines = ["|  | bar |", "| --- | --- |"]
        for f in topic.figures:
            name = f.case if f.quantity == "figure" else f"{f.case}: {f.quantity}"
            lines.append(f"| {table.escaped(name)} | {f.asked} |")
        blocks += [f"### {topic.title}", "\n".join(lines)]
    return blocks


def _text(blocks: Iterable[str]) -> str:
    return "\n\n".join(block.strip() for block in blocks if block.strip()) + "\n"


def _html(opening: str, count: str, rest: str, folder: Path) -> str:
    """Return the page as one HTML file that needs no other."""
    from markdown_it import MarkdownIt

    render = MarkdownIt("commonmark").enable("table").render

    def embedded(found: re.Match[str]) -> str:
        data = base64.b64encode((folder / found[1]).read_bytes()).decode()
        return f'src="data:image/png;base64,{data}"'

    body = (
        f'<h1>{TITLE}</h1>\n<div class="front"><div>{render(opening)}</div>'
        f"<div>{render(count)}</div></div>\n{render(rest)}"
    )
    body = re.sub(rf'src="({PLOTS}/[a-z0-9-]+\.png)"', embedded, body)
    return (
        '<!doctype html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>{TITLE}</title><style>{STYLE}</style></head>\n<body>\n{body}</body></html>\n"
    )
