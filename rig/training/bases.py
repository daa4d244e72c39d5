"""Touches on bent and twisted bases of the shell: the data of the paper's figure 5.

The strain of a base comes from the nonlinear shell, that of a touch from the tangent there, so that
loads scale it. A base whose equilibrium is not plainly stable is drawn again: there a touch snaps
the plate, and its strain is no function of bend and twist.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, cast

import numpy as np

from rig.system import cache

if TYPE_CHECKING:
    import fe
    from models import DeformableSurface
    from rig.scene.sensing import BasesSection
    from rig.system.arrays import F64
    from rig.training.plan import TrainingPlan

RATIOS = (0.5, 0.75, 1.0, 1.25, 1.5)
"""Loads of the test over the load Δ0, as in figure 5D."""

TRIES = 20
"""Bases that may be drawn for each one that is stable."""


@dataclass(frozen=True, eq=False)
class Touched:
    """Some bases, each with touches.

    Attributes
    ----------
    bases : (B, 2) float64, mm and degrees
        Bend and twist.
    places : (B, K, 2) float64, mm
    before : (B, I) float64
        Strain of each base alone.
    touch : (B, K, I) float64
        Strain that a touch of 1 N adds at each place.
    force : (B, K, 1) float64, N
        That a net learns.
    """

    bases: F64
    places: F64
    before: F64
    touch: F64
    force: F64

    def surface(self, force: float | None = None) -> DeformableSurface:
        """Return all touches one below the other, at one force or each at its own."""
        from models import DeformableSurface

        strain = (self.force if force is None else force) * self.touch
        each = self.places.shape[1]
        before = np.repeat(self.before, each, axis=0)
        return DeformableSurface(
            before,
            before + strain.reshape(before.shape),
            np.repeat(self.bases, each, axis=0),
            self.places.reshape(-1, 2),
        )


@dataclass(frozen=True, eq=False)
class BaseSets:
    """Bases to learn from, to watch and for the test; no base is in two of them.

    Attributes
    ----------
    load : float, N
        Δ0, the middle of the forces that are learnt.
    """

    training: Touched
    validation: Touched
    test: Touched
    load: float

    def named(self) -> dict[str, DeformableSurface]:
        """Return the three by their names, then the test at each load."""
        three = {
            "training": self.training.surface(),
            "validation": self.validation.surface(),
            "test": self.test.surface(),
        }
        return three | {f"load {r:g} Δ0": self.test.surface(r * self.load) for r in RATIOS}


def simulate_bases(plan: TrainingPlan, report: Callable[[int, int], None]) -> BaseSets:
    """Return touches on the bases of a scene; `report` is called while the shell is bent.

    Raises
    ------
    ValueError
        If the edges cannot be bent, or hardly a base in the range is stable.
    """
    import fe

    bases, plate = _section(plan), plan.plate.build()
    gauges = plan.gauges.build(plan.plate)
    margin = plan.training.margin
    parts = fe, plate, gauges, bases.model_dump(), margin
    kept = cache.fetch("bases", parts, lambda: _strains(plate, gauges, bases, margin, report))
    counts = _counts(bases)
    rng, (low, high) = np.random.default_rng(plan.training.test_seed), plan.training.force
    force = rng.uniform(low, high, (sum(counts), bases.touches, 1))
    ends = np.cumsum([0, *counts])
    training, validation, test = (
        Touched(
            kept["bases"][rows],
            kept["places"][rows],
            kept["before"][rows],
            kept["touch"][rows],
            force[rows],
        )
        for rows in (slice(first, last) for first, last in pairwise(ends))
    )
    return BaseSets(training, validation, test, 0.5 * (low + high))


def _section(plan: TrainingPlan) -> BasesSection:
    return cast("BasesSection", plan.training.bases)


def _counts(bases: BasesSection) -> tuple[int, int, int]:
    return bases.count, bases.count // 6, bases.count // 6


def _strains(
    plate: fe.Plate,
    gauges: F64,
    bases: BasesSection,
    margin: float,
    report: Callable[[int, int], None],
) -> dict[str, F64]:
    """Bases (B, 2), places (B, K, 2), strain of bases (B, I) and of touches of 1 N (B, K, I)."""
    import fe

    kept: dict[str, list[F64]] = {"bases": [], "places": [], "before": [], "touch": []}
    size, wanted = np.array(plate.size), sum(_counts(bases))
    for base, places, state in _stable(plate, bases, margin, size):
        report(len(kept["bases"]), wanted)
        touch = fe.shell_influence(state, gauges).strain(places).reshape(len(places), -1)
        found = base, places, state.strain(gauges).ravel(), touch
        for name, part in zip(kept, found, strict=True):
            kept[name].append(part)
        if len(kept["bases"]) == wanted:
            break
    report(wanted, wanted)
    return {name: np.array(parts) for name, parts in kept.items()}


def _stable(
    plate: fe.Plate, bases: BasesSection, margin: float, size: F64
) -> Iterator[tuple[F64, F64, fe.ShellState]]:
    """Draw bases that stand firmly, with places on each."""
    import fe

    shell = fe.Shell(plate, fe.Mesh(plate.size, (bases.elements, bases.elements)))
    rng = np.random.default_rng(bases.seed)
    spans = np.array([bases.bend, bases.twist])
    unstable = 0
    while unstable <= TRIES * sum(_counts(bases)):
        base = rng.uniform(spans[:, 0], spans[:, 1])
        places = rng.uniform(margin, size - margin, (bases.touches, 2))
        state = shell.at(fe.Base(*base))
        if state.stability.verdict is fe.Verdict.STABLE:
            yield base, places, state
        else:
            unstable += 1
    raise ValueError(
        f"{unstable} bases with bends of {bases.bend[0]:g} to {bases.bend[1]:g} mm are not stable;"
        " give training.bases smaller bends and twists"
    )
