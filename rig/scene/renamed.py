"""Keys of scene files that were renamed: the old ones are accepted for one release.

A recording or a model file holds the scene that it was made with, and opens by the same table.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, cast

from pydantic_core import PydanticCustomError

UNTIL = "0.3"
"""Release from which on the old keys are unknown."""


class RenamedKeyWarning(FutureWarning):
    """A scene has a key by its old name; the text is one sentence for the user."""


@dataclass(frozen=True)
class Renamed:
    """A key of a section that has another name now, and so may some of its values."""

    section: str
    old: str
    new: str
    values: Mapping[str, str] = field(default_factory=dict[str, str])


RENAMED = (
    Renamed("touches", "most", "max_touches"),
    Renamed("gauges", "reading", "placement", {"A": "inside", "B": "edges"}),
    *(
        renamed
        for section in ("estimator", "comparison")
        for renamed in (
            Renamed(section, "told", "target_encoding", {"poles": "rational"}),
            Renamed(section, "finish", "lbfgs_steps"),
            Renamed(section, "steps", "solver_steps"),
        )
    ),
    Renamed("training", "validation", "validation_side"),
    Renamed("training", "test", "test_samples"),
    Renamed("training", "frames", "averaged_frames"),
    Renamed("training", "pictures", "rendered_images"),
    Renamed("training", "share", "rendered_fraction"),
    Renamed("dataset", "side", "midpoint_side"),
)


def with_new_keys(table: Mapping[str, Any]) -> dict[str, Any]:
    """Return the tables of a scene with the keys of this release; warn for each old one.

    Raises
    ------
    PydanticCustomError
        If a key is given by both names.
    """
    tables = dict(table)
    for renamed in RENAMED:
        section: Any = tables.get(renamed.section)
        if isinstance(section, dict) and renamed.old in section:
            tables[renamed.section] = _moved(cast("dict[str, Any]", section), renamed)
    return tables


def _moved(section: dict[str, Any], renamed: Renamed) -> dict[str, Any]:
    """Return a section with one key under its new name, in its old place."""
    old, new = (f"{renamed.section}.{name}" for name in (renamed.old, renamed.new))
    if renamed.new in section:
        raise PydanticCustomError(
            "scene",
            "{old} and {new} are two names of one key; leave {old}, the old one, out",
            {"old": old, "new": new},
        )
    given = section[renamed.old]
    value = renamed.values.get(given, given) if isinstance(given, str) else given
    now = f"{new} = {value!r}" if value != given else new
    sentence = f"{old} is now called {now}; the old name is accepted until release {UNTIL}"
    warnings.warn(sentence, RenamedKeyWarning, stacklevel=2)
    return {
        renamed.new if key == renamed.old else key: value if key == renamed.old else each
        for key, each in section.items()
    }
