"""The paper's systems, its own figures beside ours, trained anew with one seed.

Parts: the systems of `paper.py`. Several touches take a tenth of the epochs here; `paper.py` runs
them in full.
"""

from collections.abc import Iterator
from functools import partial

from paper import SYSTEMS
from paper_sets import Effort
from study import line, run

from rig.report.figure import Figure

LIGHT = ("one", "best", "without", "other", "noise")
"""Systems of one touch, which take seconds a training."""


def system(name: str) -> Iterator[Figure]:
    """Train a system and tell its figures."""
    effort = Effort(seeds=1, cut=1 if name in LIGHT else 10)
    for figure in SYSTEMS[name](effort):
        cells = {"here": f"{figure.value:.3g}"}
        if figure.paper:
            cells["paper"] = figure.paper
        if figure.epochs:
            cells["epochs"] = str(figure.epochs)
        yield from line(figure.system[0].upper() + figure.system[1:], figure.what, **cells)


PARTS = {name: partial(system, name) for name in SYSTEMS}

if __name__ == "__main__":
    run(PARTS, __doc__)
