"""Linear plates at the ends of their ranges; `plate_figures.py` writes the table."""

from collections.abc import Callable, Iterator
from math import inf

import numpy as np

import fe
from tests.fe.levy import levy
from tests.fe.stepped import cantilever, line_load, stepped

PAPER = fe.Plate((100.0, 100.0), thickness=1.0, young=3000.0, poisson=0.3)
S = fe.Supported()
Line = tuple[str, ...]


def extreme_lines() -> Iterator[Line]:
    """Cases of the linear plate; those of the shell are in shell_bars.py."""
    square = 0.005612024020
    for thinness in (1e-1, 1e-3, 1e-6):
        plate = fe.Plate(PAPER.size, 100.0 * thinness, 3000.0, 0.3)
        yield case(f"thickness/side {thinness:.0e}", "series", plate, square)
    for poisson in (-0.9, 0.0, 0.49, 0.499):
        plate = fe.Plate(PAPER.size, 1.0, 3000.0, poisson)
        yield case(f"Poisson's ratio {poisson:g}", "series", plate, square)
    for spring in (0.0, 1e-6, 1.0, 1e3, 1e6, 1e15):
        yield sprung(f"rotation spring {spring:g} N", fe.Elastic(inf, spring))
    for spring in (1e-12, 1e-6, 1e-3, 1.0, 1e6, 1e15):
        yield sprung(f"deflection spring {spring:g} N/mm²", fe.Elastic(spring, 0.0))
    for contrast in (1e-12, 1e-6, 1e-3, 1e3, 1e6, 1e9, 1e12):
        yield patched(contrast)
    for place in ((1.0, 50.0), (50.0, 1.0), (1.0, 1.0), (0.0, 50.0)):
        yield near(place)


def case(name: str, source: str, plate: fe.Plate, truth: float) -> Line:
    """Compare w D/(P a²) under a touch in the middle."""
    solver = fe.Linear(plate, fe.default_mesh(plate))
    w = fe.compliance(solver, [(50.0, 50.0)])[0] * plate.rigidity / plate.size[0] ** 2
    return name, source, digits(w / truth - 1), "-"


def sprung(name: str, edge: fe.Elastic) -> Line:
    """South and north elastic, west and east supported: Lévy's series."""
    plate = fe.Plate(PAPER.size, 1.0, 3000.0, 0.3, fe.Edges(S, S, edge, edge))
    truth, _ = levy(plate, (50.0, 40.0), (50.0, 40.0), terms=20000)
    return attempt(
        name,
        "Lévy's series",
        lambda: fe.compliance(fe.Linear(plate, fe.default_mesh(plate)), [(50.0, 40.0)])[0] / truth,
    )


def patched(contrast: float) -> Line:
    """Cantilever whose outer part is stiffer or softer: a stepped beam."""
    plate = stepped(1.0, 3000.0 * contrast)

    def ratio() -> float:
        state = fe.deflect(plate, line_load(120.0), fe.grid(plate, 40))
        return state.deflection([[120.0, 20.0]])[0] / -cantilever(plate, 120.0)

    return attempt(f"patch {contrast:.0e} times as stiff, held by the rest", "beam", ratio)


def near(place: tuple[float, float]) -> Line:
    """Touch within 1 % of an edge or a corner, against twice as many elements."""
    coarse, fine = (
        fe.compliance(fe.Linear(PAPER, fe.Mesh(PAPER.size, (n, n))), [place])[0] for n in (120, 240)
    )
    if fine == 0.0:
        return f"touch on a clamped edge {place} mm", "0", "exact", "-"
    return f"touch at {place} mm, clamped", "240 × 240", digits(coarse / fine - 1), "-"


def attempt(name: str, source: str, ratio: Callable[[], float]) -> Line:
    """Digits of a ratio that should be 1, or the sentence that refuses it."""
    try:
        return name, source, digits(ratio() - 1), "-"
    except ValueError as refusal:
        return name, source, "refused", f"“{refusal}”"


def digits(error: float) -> str:
    """Digits that a relative error leaves right."""
    return f"{-np.log10(max(abs(error), 1e-16)):.1f}"
