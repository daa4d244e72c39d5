"""Touches on bases of the shell, each a bend and a twist: the data of the paper's figure 5.

The strain of the base comes from the nonlinear shell, that of the touch from the tangent there.
Bases whose equilibrium is not plainly stable are left out: there a touch snaps the plate, and its
strain is no function of bend and twist.
"""

from collections.abc import Mapping
from itertools import pairwise

import numpy as np

import fe
import rig
from fe import Base, Mesh, Shell, Verdict
from models.nets.two_step import DeformableSurface
from rig.studies.study import part
from rig.system import cache
from rig.system.arrays import F64

RATIOS = (0.5, 0.75, 1.0, 1.25, 1.5)
BEND = (1.0, 4.0)  # mm
TWIST = (-2.0, 2.0)  # degrees
BASES = 72  # for training; a sixth as many to watch, and to test
TOUCHES = 200  # on each base
ELEMENTS = 20  # a side


def surfaces(any_load: bool = False) -> list[DeformableSurface]:
    """Return training and validation touches, then test touches of each ratio to load 1.

    The load of the first two is 1, or drawn between the ratios for each touch.
    """
    scene = rig.load("paper-deformable")
    named, one = part(scene.plate), part(scene.dataset).force
    plate, gauges = named.build(), part(scene.gauges).build(named)
    parts = fe, plate, gauges, BEND, TWIST, BASES, TOUCHES, ELEMENTS
    kept = cache.fetch("deformable", parts, lambda: _strains(plate, gauges))
    ends = np.cumsum([0, BASES, BASES // 6, BASES // 6])
    trained, watched, tested = (slice(first, last) for first, last in pairwise(ends))
    rng = np.random.default_rng(1)
    loads = rng.uniform(RATIOS[0], RATIOS[-1], (ends[-1], TOUCHES, 1)) if any_load else 1.0
    loads = np.broadcast_to(one * loads, (ends[-1], TOUCHES, 1))
    forces = [one * ratio for ratio in RATIOS]
    return [
        _surface(kept, trained, loads[trained]),
        _surface(kept, watched, loads[watched]),
        *(_surface(kept, tested, force) for force in forces),
    ]


def _strains(plate: fe.Plate, gauges: F64) -> dict[str, F64]:
    """Bases (B, 2), places (B, K, 2), strain of bases (B, I) and of touches of 1 N (B, K, I)."""
    shell, rng = Shell(plate, Mesh(plate.size, (ELEMENTS, ELEMENTS))), np.random.default_rng(0)
    kept: dict[str, list[F64]] = {"bases": [], "places": [], "before": [], "touch": []}
    while len(kept["bases"]) < BASES + 2 * (BASES // 6):
        base = rng.uniform((BEND[0], TWIST[0]), (BEND[1], TWIST[1]))
        places = rng.uniform(10.0, 90.0, (TOUCHES, 2))
        state = shell.at(Base(*base))
        if state.stability.verdict is Verdict.STABLE:
            touch = fe.shell_influence(state, gauges).strain(places).reshape(TOUCHES, -1)
            for name, part in zip(
                kept, (base, places, state.strain(gauges).ravel(), touch), strict=True
            ):
                kept[name].append(part)
    return {name: np.array(parts) for name, parts in kept.items()}


def _surface(kept: Mapping[str, F64], rows: slice, force: F64 | float) -> DeformableSurface:
    before = np.repeat(kept["before"][rows], TOUCHES, axis=0)
    touch = (force * kept["touch"][rows]).reshape(len(before), -1)
    return DeformableSurface(
        before,
        before + touch,
        np.repeat(kept["bases"][rows], TOUCHES, axis=0),
        kept["places"][rows].reshape(-1, 2),
    )
