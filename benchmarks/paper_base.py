"""Touches on bases of the shell, each a bend and a twist: the data of the paper's figure 5.

The strain of the base comes from the nonlinear shell, that of the touch from the tangent there.
"""

from itertools import pairwise

import numpy as np

import fe
import rig
from fe.mesh import Mesh
from fe.shell import Base, Shell
from models.two_step import Surface
from rig import cache

RATIOS = (0.5, 0.75, 1.0, 1.25, 1.5)
BEND = (1.0, 4.0)  # mm
TWIST = (-4.0, 4.0)  # degrees
BASES = 36  # for training; a sixth as many to watch, and to test
TOUCHES = 60  # on each base
ELEMENTS = 20  # a side


def surfaces() -> list[Surface]:
    """Return training and validation touches of load 1, then test touches of each ratio."""
    scene = rig.load("paper-deformable")
    rng = np.random.default_rng(0)
    bases = rng.uniform(*zip(BEND, TWIST, strict=True), (BASES + 2 * (BASES // 6), 2))
    places = rng.uniform(10.0, 90.0, (len(bases), TOUCHES, 2))
    plate, gauges = scene.plate.build(), scene.gauges.build(scene.plate)
    parts = fe, plate, gauges, bases, places, ELEMENTS
    kept = cache.fetch("deformable", parts, lambda: _strains(plate, gauges, bases, places))
    ends = np.cumsum([0, BASES, BASES // 6, BASES // 6])
    rows = [slice(first, last) for first, last in pairwise(ends)]
    force, loads = scene.dataset.force, [1.0, 1.0, *RATIOS]
    return [
        _surface(kept, bases, places, here, load * force)
        for here, load in zip([*rows, *[rows[2]] * (len(RATIOS) - 1)], loads, strict=True)
    ]


def _strains(plate, gauges, bases, places):
    """Strain of each base (B, I), and of a touch of 1 N at each place on it (B, K, I)."""
    shell = Shell(plate, Mesh(plate.size, (ELEMENTS, ELEMENTS)))
    before, touch = [], []
    for (bend, twist), xy in zip(bases, places, strict=True):
        state = shell.at(Base(bend, twist))
        before.append(state.strain(gauges).ravel())
        touch.append(state.influence(gauges).strain(xy).reshape(len(xy), -1))
    return {"before": np.array(before), "touch": np.array(touch)}


def _surface(kept, bases, places, rows, force):
    before = np.repeat(kept["before"][rows], TOUCHES, axis=0)
    touch = kept["touch"][rows].reshape(len(before), -1)
    return Surface(
        before,
        before + force * touch,
        np.repeat(bases[rows], TOUCHES, axis=0),
        places[rows].reshape(-1, 2),
    )
