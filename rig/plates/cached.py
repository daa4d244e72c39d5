"""What is known of a plate and slow to compute, from the cache where it is there.

The live loop, training and calibration all ask here. Each call computes what the cache lacks and
calls `report` with how many of how many steps are done.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

import fe
from rig.system import cache

Report = Callable[[int, int], None]


def plate_modes(plate: fe.Plate, count: int, report: Report) -> fe.Modes:
    """Return the first `count` vibration modes of a plate."""

    def compute() -> cache.Arrays:
        return fe.modes(plate, count, progress=report).arrays()

    return fe.Modes.from_arrays(cache.fetch("modes", (fe, plate, count), compute))


def influence(plate: fe.Plate, gauges: np.ndarray, report: Report) -> fe.Influence:
    """Return the influence of touches on `gauges` (M, 2) mm."""

    def compute() -> cache.Arrays:
        return fe.influence(plate, gauges, progress=report).arrays()

    return fe.Influence.from_arrays(cache.fetch("influence", (fe, plate, gauges), compute))


def reduced(plate: fe.Plate, force: float, report: Report) -> fe.Reduced:
    """Return the reduced plate for touches up to `force` N."""

    def compute() -> cache.Arrays:
        return fe.reduced_plate(plate, force=force, progress=report).arrays()

    return fe.Reduced.from_arrays(cache.fetch("reduced", (fe, plate, force), compute))


def modal(plate: fe.Plate, report: Report) -> fe.ModalPlate:
    """Return the plate in modes, for a bench whose numbers are not all known."""

    def compute() -> cache.Arrays:
        return fe.modal_plate(plate, progress=report).arrays()

    return fe.ModalPlate.from_arrays(cache.fetch("modal", (fe, plate), compute))


def shapes(shell: fe.Shell, report: Report) -> tuple[fe.ShellState, ...]:
    """Return stable shapes of a plate over the bases in which it is looked for."""
    import models

    plate, mesh = shell.plate, shell.mesh

    def compute() -> cache.Arrays:
        found = models.known_shapes(shell, report=report)
        bases = [(state.base.bend, state.base.twist) for state in found]
        return {"bases": np.array(bases), "values": np.array([state.values for state in found])}

    parts = fe, models, plate, mesh.nodes
    kept = cache.fetch("shapes", parts, compute)
    # What is kept was judged to be an equilibrium when it was found.
    rest = shell.undeformed
    return tuple(
        replace(rest, base=fe.Base(*base.tolist()), values=values)
        for base, values in zip(kept["bases"], kept["values"], strict=True)
    )
