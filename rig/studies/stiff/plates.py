"""Linear plates at the ends of their ranges; `table` runs them."""

from collections.abc import Callable, Iterator
from math import inf

import numpy as np

import fe
from rig.report.figure import Figure, at_least, at_most
from rig.studies.plates.levy import levy
from rig.studies.plates.paper import PAPER
from rig.studies.plates.stepped import cantilever, line_load, stepped
from rig.studies.stiff.case import NOT_WRONG, case

S = fe.Supported()
DIGITS = at_least(4.0)  # that must be right
ELEMENTS = 80  # along a side; the default has 120, and takes three times as long
STRIP = 0.0920915285  # w,yy D / P at (0.5, 0.05) sides, from the same series
SQUARE = 0.005612024020  # w D / (P a²) under a touch in the middle, from a double series


def plates() -> Iterator[Figure]:
    """Thin and thick, sprung and patched plates, touches near their edges."""
    for thinness in (4e-2, 1e-3, 1e-6):  # beyond 0.05 plates shear, and are refused
        plate = fe.Plate(PAPER.size, 100.0 * thinness, 3000.0, 0.3)
        yield from middle(f"plate, thickness/side {thinness:.0e}", plate)
    for poisson in (-0.9, 0.0, 0.49, 0.499):
        plate = fe.Plate(PAPER.size, 1.0, 3000.0, poisson)
        yield from middle(f"plate, Poisson's ratio {poisson:g}", plate)
    for spring in (0.0, 1e-6, 1.0, 1e3, 1e6, 1e15):
        yield from sprung(f"edge, rotation spring {spring:g} N", fe.Elastic(inf, spring))
    for spring in (1e-12, 1e-6, 1e-3, 1.0, 1e6, 1e15):
        yield from sprung(f"edge, deflection spring {spring:g} N/mm²", fe.Elastic(spring, 0.0))
    for contrast in (1e-12, 1e-6, 1e-3, 1e3, 1e6, 1e9, 1e12):
        yield from patched(contrast)
    yield from near_edges()
    yield from float32()


def middle(name: str, plate: fe.Plate) -> Iterator[Figure]:
    """Compare the deflection under a touch in the middle with a double series."""
    solver = fe.Linear(plate, fe.grid(plate, ELEMENTS))
    w = fe.compliance(solver, [(50.0, 50.0)])[0] * plate.rigidity / plate.size[0] ** 2
    return known(name, condition(solver), w / SQUARE - 1)


def sprung(name: str, edge: fe.Elastic) -> Iterator[Figure]:
    """South and north elastic, west and east supported: Lévy's series."""
    plate = fe.Plate(PAPER.size, 1.0, 3000.0, 0.3, fe.Edges(S, S, edge, edge))
    solver = fe.Linear(plate, fe.grid(plate, ELEMENTS))
    truth, _ = levy(plate, (50.0, 40.0), (50.0, 40.0), terms=20000)
    return attempt(name, solver, lambda: fe.compliance(solver, [(50.0, 40.0)])[0] / truth)


def patched(contrast: float) -> Iterator[Figure]:
    """Cantilever whose outer part is stiffer or softer: a stepped beam."""
    plate = stepped(1.0, 3000.0 * contrast)
    solver = fe.Linear(plate, fe.grid(plate, 40))

    def ratio() -> float:
        state = solver.deflect(line_load(120.0))
        return state.deflection([[120.0, 20.0]])[0] / -cantilever(plate, 120.0)

    return attempt(f"patch {contrast:.0e} times as stiff, held by the rest", solver, ratio)


def near_edges() -> Iterator[Figure]:
    """Touch within 1 % of an edge or a corner, against twice as many elements, and on the edge."""
    places = [(1.0, 50.0), (1.0, 1.0), (0.0, 50.0)]
    coarse, fine = (
        fe.compliance(fe.Linear(PAPER, fe.Mesh(PAPER.size, (n, n))), places) for n in (120, 240)
    )
    for place, one, other in zip(places[:2], coarse, fine, strict=False):
        name = f"touch at {place} mm, clamped edges"
        yield from known(name, "w far below that of the middle", one / other - 1)
    name, moved = f"touch at {places[2]} mm, clamped edges", float(abs(coarse[2]))
    yield from case(name, "on the edge", moved, "mm", at_most(0.0), seen="nothing moves")


def float32() -> Iterator[Figure]:
    """Give every input in single precision, as a file or a device may: places, forces, gauges."""
    load, gauge = np.array([(50.0, 50.0)], np.float32), np.array([(50.0, 5.0)], np.float32)
    solver = fe.Linear(PAPER, fe.grid(PAPER, ELEMENTS))
    w = fe.compliance(solver, load)[0] * PAPER.rigidity / PAPER.size[0] ** 2
    yield from known("plate, touch in float32", condition(solver), w / SQUARE - 1)
    touch = fe.Touch(float(load[0, 0]), float(load[0, 1]), float(np.float32(1.0)))
    strain = solver.deflect([touch]).strain(gauge)[0, 1]
    truth = 0.5 * PAPER.thickness / PAPER.rigidity * STRIP
    yield from known("plate, gauge in float32", condition(solver), strain / truth - 1)


def attempt(name: str, solver: fe.Linear, ratio: Callable[[], float]) -> Iterator[Figure]:
    """Digits of a ratio that should be 1, or the sentence that refuses it."""
    try:
        return known(name, condition(solver), ratio() - 1)
    except ValueError as refusal:
        bar, unit = NOT_WRONG
        reason = "condition number too large"
        return case(name, reason, 0, unit, bar, seen="refused", said=str(refusal))


def known(name: str, reason: str, error: float, said: str = "") -> Iterator[Figure]:
    """Make a case whose relative error is known."""
    digits = -float(np.log10(max(abs(error), 1e-16)))
    return case(name, reason, digits, "digits", DIGITS, said=said)


def condition(solver: fe.Linear) -> str:
    """Condition number of the scaled stiffness."""
    return f"condition {solver.factor.condition:.0e}"
