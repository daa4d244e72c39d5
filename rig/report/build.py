"""Build a report: run what has not run yet, then write the page."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

from rig.report import needs, page, runner
from rig.report.compare import RAW
from rig.report.origin import Origin, code_hash
from rig.report.runner import Place
from rig.report.study import Contents, Effort, Study
from rig.system.cache import key

Announce = Callable[[Study, int, int], object]
"""Called with a study before it runs, its number and how many there are."""


@dataclass(frozen=True)
class Order:
    """What is asked of a report.

    Attributes
    ----------
    effort : {"quick", "normal", "full"}
    folder : Path
        Where it is written.
    names : tuple of str
        Studies to run, beside those that the folder keeps; all of the effort if none is named.
    data : Path or None
        Folder of the images of others that some studies need.
    """

    effort: Effort
    folder: Path
    names: tuple[str, ...] = ()
    data: Path | None = None


def build(
    contents: Contents, order: Order, announce: Announce, now: datetime
) -> list[page.StudyResult]:
    """Run the studies that are asked for, and write the page.

    A study that ended well with this code and this effort is not run again, so that a report that
    was interrupted goes on where it stopped. One that needs what is not there is left out. Where
    some are named, the page keeps the others as they were found, each with its day.

    Raises
    ------
    ValueError
        If a name is none of a study.
    """
    known, names = contents.studies, order.names
    _require_known(names, known)
    asked = [study for study in known if not names or study.name in names]
    chosen = [study for study in asked if study.words(order.effort) is not False]
    code = code_hash(contents.home)
    results = _kept(known, order) if names else {}
    for count, study in enumerate(chosen):
        announce(study, count, len(chosen))
        results[study.name] = _result(study, contents, order, code, now)
    left = tuple(study.title for study in known if study.name not in results)
    parts = [
        (section, tuple(results[study.name] for study in section.studies if study.name in results))
        for section in contents.sections
    ]
    page.write(
        order.folder,
        Origin(order.effort, left, now),
        page.PageParts(tuple(part for part in parts if part[1]), contents.open_bars),
    )
    return list(results.values())


def _kept(known: tuple[Study, ...], order: Order) -> dict[str, page.StudyResult]:
    """Return what the folder keeps of earlier runs, by name."""
    places = {study.name: Place(order.folder / RAW, study.name) for study in known}
    outcomes = ((study, runner.stored(places[study.name])) for study in known)
    return {
        study.name: page.StudyResult(study, outcome, runner.figures(places[study.name]))
        for study, outcome in outcomes
        if outcome
    }


def _result(
    study: Study, contents: Contents, order: Order, code: str, now: datetime
) -> page.StudyResult:
    words = (*contents.program(study), *_words(study, order))
    identity = key("study", (words, code))
    place = Place(order.folder / RAW, study.name)
    outcome = runner.kept(place, identity)
    if outcome is None and (lacking := needs.missing(study.needs, order.data)):
        outcome = runner.leave_out(place, identity, needs.sentence(lacking))
    if outcome is None:
        limit = None if order.effort == "full" else study.limit
        outcome = runner.run(words, place, identity, limit, now)
    return page.StudyResult(study, outcome, runner.figures(place))


def _words(study: Study, order: Order) -> tuple[str, ...]:
    """Return what a study's command line says beside its program."""
    words = study.words(order.effort) or ()
    asks = any(need.startswith("data ") for need in study.needs)
    return (*words, "--data", str(order.data.absolute())) if asks and order.data else words


def _require_known(names: tuple[str, ...], studies: tuple[Study, ...]) -> None:
    known = [study.name for study in studies]
    for name in names:
        if name not in known:
            raise ValueError(f"there is no study '{name}'; there are {', '.join(known)}")
