"""Ours against CalculiX, which shares nothing with it: another element, another solver.

Parts: linear, large. They need CalculiX (Debian's calculix-ccx).
"""

import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import fe
from models import gauges_inside_edges, gauges_on_edges
from rig.report.figure import Figure, at_most
from rig.studies.plates import ccx
from rig.studies.plates.paper import PAPER
from rig.studies.study import line, run

TOP = PAPER.thickness / 2
RINGS = {
    "on the edges": gauges_on_edges(PAPER.size),
    "5 mm inside": gauges_inside_edges(PAPER.size),
}
# Places of 1 N, and the bar of the ring's strain, %: one is in the corner of the paper's loads.
LOADS = {
    (50.0, 50.0): 1.0,
    (25.0, 50.0): 1.0,
    (30.0, 20.0): 1.0,
    (10.0, 50.0): 1.0,
    (10.0, 10.0): 3.0,
}
LARGE = (fe.Touch(40.0, 55.0, 6.0), fe.Touch(70.0, 35.0, 5.0))
PLACES = np.array([(50.0, 50.0), (40.0, 65.0), (60.0, 25.0), (80.0, 55.0)])


def linear() -> Iterator[Figure]:
    """Five small touches: ring strain, both readings of where the gauges are."""
    with tempfile.TemporaryDirectory() as folder:
        loads = [[fe.Touch(*place, 1.0)] for place in LOADS]
        theirs = ccx.solve(Path(folder), PAPER, (80, 80), loads)
    solver = fe.Linear(PAPER, fe.default_mesh(PAPER))
    for (place, most), fields in zip(LOADS.items(), theirs, strict=True):
        state = solver.deflect([fe.Touch(*place, 1.0)])
        for name, ring in RINGS.items():
            off = worst(state.strain(ring), fields.strain[fields.nodes(ring, TOP)])
            yield from line(
                "CalculiX, 80 × 80 S8R: strain of 72 gauges, small touches",
                f"1 N at {place} mm, gauges {name}",
                worst=(100 * off, "%", at_most(most)),
            )


def large() -> Iterator[Figure]:
    """Two touches that bend the plate by its thickness: strain and motion by the shell."""
    with tempfile.TemporaryDirectory() as folder:
        (fields,) = ccx.solve(Path(folder), PAPER, (40, 40), [LARGE], nonlinear=True)
    state = fe.solve(PAPER, LARGE)
    moved = fields.displacement[fields.nodes(PLACES, TOP)]
    table = "CalculiX, 40 × 40 S8R, NLGEOM: 6 N and 5 N"
    depth = float(np.abs(moved[:, 2]).max()) / PAPER.thickness
    yield from line(table, "largest deflection of CalculiX", **{"w/h": depth})
    for name, places in (RINGS | {"four places inside": PLACES}).items():
        off = worst(state.strain(places), fields.strain[fields.nodes(places, TOP)])
        yield from line(table, f"strain, {name}", worst=(100 * off, "%", at_most(2.0)))
    off = worst(state.displacement(PLACES)[:, 2], moved[:, 2])
    yield from line(table, "deflection, four places inside", worst=(100 * off, "%", at_most(2.0)))


def worst(found: NDArray[np.float64], truth: NDArray[np.float64]) -> float:
    """Largest error in parts of the largest value."""
    return float(np.abs(found - truth).max() / np.abs(truth).max())


PARTS = {"linear": linear, "large": large}

if __name__ == "__main__":
    run(PARTS, __doc__)
