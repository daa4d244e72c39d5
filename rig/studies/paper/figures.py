"""Every figure and table of the paper: from its scenes, drawn, beside its own numbers.

Parts are named after the figures. Trainings are kept in results/paper/trainings: one that is there
is read, one that was killed goes on. The parts that end in "-whole" spend the steps of a night.
"""

from collections.abc import Callable, Iterator
from pathlib import Path

from rig.report.figure import Figure
from rig.studies.paper.drawn.bent import deformable, shapes
from rig.studies.paper.drawn.choices import choices
from rig.studies.paper.drawn.contents import contents
from rig.studies.paper.drawn.magnitudes import six, weights, weights_whole
from rig.studies.paper.drawn.one import noise, other_nets, random_touches, regressions, training
from rig.studies.paper.drawn.plate import layout
from rig.studies.paper.drawn.recipe import changed, recipe
from rig.studies.paper.drawn.several import doubled, histograms, samples, three, three_whole, two
from rig.studies.paper.drawn.size import finest, search, spacing
from rig.studies.study import run_drawn

PARTS: dict[str, Callable[[Path], Iterator[Figure]]] = {
    "2a": layout,
    "2d": training,
    "3ab": random_touches,
    "recipe": recipe,
    "changed": changed,
    "nets": other_nets,
    "s2": regressions,
    "s4": noise,
    "3d": spacing,
    "3d-recipe": finest,
    "s1": search,
    "s5": two,
    "4a": three,
    "4b": samples,
    "s7": histograms,
    "s6": doubled,
    "4c": weights,
    "4d": six,
    "5a": shapes,
    "5cd": deformable,
    "choices": choices,
    "contents": contents,
    "4a-whole": three_whole,
    "4c-whole": weights_whole,
}

if __name__ == "__main__":
    run_drawn(PARTS, __doc__)
