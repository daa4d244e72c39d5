"""Build a report: run what has not run yet, then write the page."""

from __future__ import annotations

from collections.abc import Callable
from datetime import datetime
from pathlib import Path

from rig.report import page, runner
from rig.report.compare import RAW
from rig.report.origin import code_hash, head
from rig.report.runner import Place
from rig.report.study import Contents, Effort, Study
from rig.system.cache import key

Tell = Callable[[Study, int, int], object]
"""Called with a study before it runs, its number and how many there are."""


def build(
    contents: Contents, effort: Effort, folder: Path, names: list[str], tell: Tell, now: datetime
) -> list[page.Result]:
    """Run the studies of an effort, or those named, and write the page into `folder`.

    A study that ended well with this code and this effort is not run again, so that a report that
    was interrupted goes on where it stopped.

    Raises
    ------
    ValueError
        If a name is none of a study.
    """
    known = [study for section in contents.sections for study in section.studies]
    _require_known(names, known)
    asked = [study for study in known if not names or study.name in names]
    chosen = [study for study in asked if study.words(effort) is not False]
    left = [study.title for study in known if study not in chosen]
    code, results = code_hash(contents.home), {}
    for count, study in enumerate(chosen):
        tell(study, count, len(chosen))
        results[study.name] = _result(study, contents, effort, folder / RAW, code)
    parts = [
        (section, [results[study.name] for study in section.studies if study.name in results])
        for section in contents.sections
    ]
    page.write(
        folder, head(effort, left, now), [(section, found) for section, found in parts if found]
    )
    return list(results.values())


def _result(study: Study, contents: Contents, effort: Effort, raw: Path, code: str) -> page.Result:
    words = study.words(effort) or ()
    identity = key("study", (study.program, words, code))
    place = Place(raw, study.name)
    outcome = runner.kept(place, identity)
    if outcome is None:
        limit = None if effort == "full" else study.limit
        outcome = runner.run(contents.program(study), words, place, identity, limit)
    return page.Result(study, outcome, runner.figures(place))


def _require_known(names: list[str], studies: list[Study]) -> None:
    known = [study.name for study in studies]
    for name in names:
        if name not in known:
            raise ValueError(f"there is no study '{name}'; there are {', '.join(known)}")
