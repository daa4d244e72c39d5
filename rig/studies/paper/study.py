"""The paper's systems, its own figures beside ours, trained anew.

Parts: the systems of `paper.py`; those of `SPENT` again with "-whole" at their end, with more seeds
and more epochs.
"""

from collections.abc import Iterator
from functools import partial

from rig.report.figure import Figure
from rig.studies.paper.sets import Effort
from rig.studies.paper.systems import SYSTEMS
from rig.studies.paper.table import grouped, spread
from rig.studies.study import line, run

ONCE = Effort(seeds=1, cut=1)
SPENT = {
    "one": Effort(2, 1),
    "best": Effort(3, 1),
    "without": Effort(3, 1),
    "bench": Effort(3, 1),
    "spacing": Effort(1, 6),
    "finest": Effort(1, 4),
    "search": Effort(1, 20),
    "two": Effort(1, 4),
    "three": Effort(1, 4),
    "doubled": Effort(1, 4),
    "magnitudes": Effort(1, 4),
    "magnitudes-unordered": Effort(1, 2),
    "change": Effort(1, 4),
    "bound": Effort(1, 2),
    "seen": Effort(1, 2),
}
"""Seeds, and what part of the epochs: as much as a full report spends on a system."""


def system(name: str, effort: Effort) -> Iterator[Figure]:
    """Train a system and tell its figures, the median of the seeds, least and largest."""
    for (title, what), figures in grouped(SYSTEMS[name](effort)).items():
        cells = {"here": spread([figure.value for figure in figures])}
        if figures[0].paper:
            cells["paper"] = figures[0].paper
        if figures[0].epochs:
            cells["epochs"] = str(figures[0].epochs)
        if len(figures) > 1:
            cells["seeds"] = str(len(figures))
        yield from line(title[0].upper() + title[1:], what, **cells)


PARTS = {name: partial(system, name, ONCE) for name in SYSTEMS} | {
    f"{name}-whole": partial(system, name, effort) for name, effort in SPENT.items()
}

if __name__ == "__main__":
    run(PARTS, __doc__)
