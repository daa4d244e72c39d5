"""Run the paper's systems with any effort, and keep their figures.

Usage: ``python -m rig.studies.paper.systems [--quick | --cut N] [--seeds N] [SYSTEM ...]``; systems
are the keys of SYSTEMS, all of them if none is named. ``--cut N`` takes an Nth of the epochs,
``--quick`` a tenth. Figures go to results/paper/paper.csv, where those of the same system and
effort are replaced; `drawings` draws them, `study` tables them for the report.
"""

import argparse
import sys

from rig.studies.paper.bench import bench
from rig.studies.paper.bent import change, deformable
from rig.studies.paper.bound import bound
from rig.studies.paper.one import best, finest, noise, one, other, search, spacing, without
from rig.studies.paper.seen import seen
from rig.studies.paper.sets import Effort
from rig.studies.paper.several import (
    doubled,
    magnitudes,
    magnitudes_unordered,
    three,
    two,
    unordered,
)
from rig.studies.paper.table import Sample, store

SYSTEMS = {
    "one": one,
    "best": best,
    "without": without,
    "bound": bound,
    "other": other,
    "noise": noise,
    "spacing": spacing,
    "finest": finest,
    "search": search,
    "two": two,
    "three": three,
    "unordered": unordered,
    "doubled": doubled,
    "magnitudes": magnitudes,
    "magnitudes-unordered": magnitudes_unordered,
    "deformable": deformable,
    "change": change,
    "seen": seen,
    "bench": bench,
}


def main(*arguments: str) -> None:
    """Run the systems asked for."""
    parser = argparse.ArgumentParser(description="The paper's systems.")
    parser.add_argument("systems", nargs="*", metavar="SYSTEM", help=", ".join(SYSTEMS))
    parser.add_argument("--seeds", type=int, default=1)
    parser.add_argument("--cut", type=int, default=1)
    parser.add_argument("--quick", dest="cut", action="store_const", const=10)
    asked = parser.parse_args(arguments)
    effort = Effort(asked.seeds, asked.cut)
    for name in asked.systems or SYSTEMS:
        samples: list[Sample] = []
        for sample in SYSTEMS[name](effort):
            print(f"{sample.system:32s} {sample.what:60s} {sample.value:9.3f}", flush=True)
            samples.append(sample)
        store(samples)


if __name__ == "__main__":
    main(*sys.argv[1:])
