"""Tables of figures, in Markdown: a line a case, a column a quantity."""

from __future__ import annotations

from collections.abc import Iterable

from rig.report.figure import Figure


def tables(figures: Iterable[Figure]) -> dict[str, list[Figure]]:
    """Return the figures of each table, in the order in which the tables came."""
    grouped: dict[str, list[Figure]] = {}
    for figure in figures:
        grouped.setdefault(figure.table, []).append(figure)
    return grouped


def markdown(figures: list[Figure]) -> str:
    """Return one table in Markdown."""
    cases = list(dict.fromkeys(figure.case for figure in figures))
    quantities = list(dict.fromkeys(figure.quantity for figure in figures))
    found = {(figure.case, figure.quantity): figure for figure in figures}
    common = {quantity: _common_unit(figures, quantity) for quantity in quantities}
    heads = [f"{name}, {common[name]}" if common[name] else name for name in quantities]
    lines = [["", *heads], ["---"] * (1 + len(heads))]
    for case in cases:
        cells = [_cell(found.get((case, name)), common[name]) for name in quantities]
        lines.append([escaped(case), *cells])
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def _common_unit(figures: list[Figure], quantity: str) -> str:
    """Return the unit of a column, empty where its lines differ."""
    units = {figure.unit for figure in figures if figure.quantity == quantity}
    return units.pop() if len(units) == 1 else ""


def _cell(figure: Figure | None, unit: str) -> str:
    if figure is None:
        return ""
    text = figure.number if figure.unit == unit else figure.text
    notes = [f"n = {figure.samples}"] if figure.samples is not None else []
    if figure.bar:
        notes.append(str(figure.bar))
    if figure.verdict == "missed":
        notes.append("**missed**")
    return escaped(f"{text} ({', '.join(notes)})" if notes else text)


def escaped(text: str) -> str:
    """Write a text so that it stays in its cell."""
    return text.replace("|", "\\|").replace("\n", " ")
