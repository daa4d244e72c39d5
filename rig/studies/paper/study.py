"""Nets that are trained with noise, see through a camera, or stand on the bench.

Parts: the systems; each again with "-whole" at its end, with more seeds or more epochs. The figures
of the paper itself are those of `figures`.
"""

from collections.abc import Iterator
from functools import partial

import numpy as np

from rig.report.figure import Figure
from rig.studies.paper.bench import bench
from rig.studies.paper.bound import bound
from rig.studies.paper.seen import seen
from rig.studies.paper.sets import Effort
from rig.studies.paper.table import grouped
from rig.studies.study import Cell, line, run

ONCE = Effort(seeds=1, cut=1)
SYSTEMS = {"bound": bound, "seen": seen, "bench": bench}
SPENT = {"bound": Effort(1, 2), "seen": Effort(1, 2), "bench": Effort(5, 1)}
"""Seeds, and what part of the epochs: as much as a full report spends on a system."""


def system(name: str, effort: Effort) -> Iterator[Figure]:
    """Train a system and tell its figures: the median of the seeds, the least and the largest."""
    for (title, what), samples in grouped(SYSTEMS[name](effort)).items():
        one, values = samples[0], [float(sample.value) for sample in samples]
        cells: dict[str, Cell] = {
            "here": (float(np.median(values)), one.unit, one.bar, len(values))
        }
        if len(values) > 1:
            cells |= {"least": (min(values), one.unit), "largest": (max(values), one.unit)}
        if one.paper:
            cells["paper"] = as_number(one.paper, one.unit)
        if one.epochs:
            cells["epochs"] = one.epochs
        yield from line(title[0].upper() + title[1:], what, **cells)


def as_number(text: str, unit: str) -> Cell:
    """Return the paper's figure as a number where it is one, otherwise in its words."""
    try:
        return float(text), unit
    except ValueError:
        return text


PARTS = {name: partial(system, name, ONCE) for name in SYSTEMS} | {
    f"{name}-whole": partial(system, name, effort) for name, effort in SPENT.items()
}

if __name__ == "__main__":
    run(PARTS, __doc__)
