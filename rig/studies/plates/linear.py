"""What linear plates are held to: closed forms, convergence, cost, and a finer mesh.

Parts: edges, rates, cost, data, mesh; about five minutes and 5 GB, most of both for the finer mesh.
Large deflection is in `shell` and `reduced`.
"""

import json
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from math import inf
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import fe
from fe.elements.functional import derivative
from models import gauges_inside_edges, gauges_on_edges
from rig.report.figure import Figure, at_least, at_most
from rig.studies.plates.levy import levy
from rig.studies.start import child
from rig.studies.study import Cell, line, run
from rig.system.arrays import F64

PAPER = fe.Plate((100.0, 100.0), thickness=1.0, young=3000.0, poisson=0.3)
# Loads of the paper, 289 in steps of 5 mm. Plate and rings are symmetric in both middle lines and
# the diagonals, so the 45 of one eighth stand for all.
EIGHTH = [(x, y) for x in np.arange(10.0, 51.0, 5.0) for y in np.arange(10.0, x + 1.0, 5.0)]
RINGS = {
    "on the edges (reading B)": gauges_on_edges(PAPER.size),
    "5 mm inside (reading A)": gauges_inside_edges(PAPER.size),
}
# Deflection under a load on the clamped and the supported square, times D/(P a²): double series.
SQUARES = {
    fe.Clamped(): {(0.5, 0.5): 0.005612024020, (0.25, 0.5): 0.003285543346},
    fe.Supported(): {(0.5, 0.5): 0.011600839772},
}
# Load, gauge (fractions of the side) and D/P times w,xx w,yy w,xy there, clamped: double series.
CURVATURES = (
    ((0.50, 0.50), (0.05, 0.05), (0.0030847812, 0.0030847812, 0.0039477063)),
    ((0.50, 0.50), (0.50, 0.05), (-0.0030220542, 0.0920915285, 0.0)),
    ((0.50, 0.50), (0.95, 0.30), (0.0604749480, -0.0008194226, -0.0165689089)),
    ((0.25, 0.50), (0.05, 0.75), (0.0576292409, 0.0025525414, -0.0273085479)),
    ((0.25, 0.50), (0.25, 0.95), (-0.0018027523, 0.0424404139, -0.0108859802)),
)
COUNTS = (24, 48, 144)  # elements a side for rates of convergence, the last as the truth
C, S, F = fe.Clamped(), fe.Supported(), fe.Free()
# West and east supported, as Lévy's series needs; south and north:
MIXED = {
    "clamped, free": (C, F),
    "supported, free": (S, F),
    "free, free": (F, F),
    "elastic, elastic": (fe.Elastic(3.0, 400.0), fe.Elastic(inf, 900.0)),
}
PLACES = np.array([(50.0, 0.0), (40.0, 10.0), (10.0, 100.0), (96.0, 75.0), (0.0, 20.0)])


UNDER, ELSEWHERE = at_most(5e-5), at_most(1e-5)  # errors of w under a touch; of all else


def mesh() -> Iterator[Figure]:
    """Strains of the paper's loads on the default mesh against one of four times its elements."""
    default = fe.default_mesh(PAPER)
    fine = fe.Mesh(PAPER.size, (4 * default.counts[0], 4 * default.counts[1]))
    coarse, true = (ring_strains(fe.Linear(PAPER, mesh)) for mesh in (default, fine))
    for name, found, truth in zip(RINGS, coarse, true, strict=True):
        of_each = np.abs(found - truth).max(axis=(1, 2)) / np.abs(truth).max(axis=(1, 2))
        yield from line(
            "Strain of the paper's 289 loads at 72 points, default mesh: relative errors",
            name,
            worst=(float(of_each.max()), "", at_most(1e-4), 289),
            median=float(np.median(of_each)),
        )


def ring_strains(linear: fe.Linear) -> list[NDArray[np.float64]]:
    """Strains (45, 72, 3) of either ring under each load of one eighth."""
    states = [linear.deflect([fe.Touch(*place, 1.0)]) for place in EIGHTH]
    return [np.array([state.strain(ring) for state in states]) for ring in RINGS.values()]


def edges() -> Iterator[Figure]:
    """Edges of every kind on 100 x 100 elements against series."""
    for kind, loads in SQUARES.items():
        solver = on_hundred(fe.Plate(PAPER.size, 1.0, 3000.0, 0.3, kind))
        unit = PAPER.rigidity / 100.0**2
        worst = max(abs(under(solver, 100 * np.array(p)) * unit / w - 1) for p, w in loads.items())
        yield from off(f"{kind.kind} square", under_the_touch=(worst, "", UNDER))
    found = series_strains(on_hundred(PAPER))
    yield from off("clamped square", strain_elsewhere=(found, "", ELSEWHERE))
    half = abs(under(half_plane(), (1000.0, 1.0)) * 4 * np.pi * PAPER.rigidity - 1)
    yield from off("half-plane, 1 mm from its clamped edge", under_the_touch=(half, "", UNDER))
    for name, sides in MIXED.items():
        yield from mixed(name, fe.Plate(PAPER.size, 1.0, 3000.0, 0.3, fe.Edges(S, S, *sides)))
    yield from by_default()


def off(case: str, **cells: Cell) -> Iterator[Figure]:
    """Make the line of an edge."""
    return line("Relative errors against series, 100 × 100 elements", case, **cells)


def by_default() -> Iterator[Figure]:
    """Take the clamped square on the mesh that is the default."""
    solver, unit = fe.Linear(PAPER, fe.default_mesh(PAPER)), PAPER.rigidity / 100.0**2
    (place, w), *_ = SQUARES[fe.Clamped()].items()
    found = abs(under(solver, 100 * np.array(place)) * unit / w - 1)
    yield from line(
        "Relative errors against series, default mesh",
        "clamped square",
        under_the_touch=(found, "", UNDER),
        strain_elsewhere=(series_strains(solver), "", at_most(1e-4)),
    )


def mixed(name: str, plate: fe.Plate) -> Iterator[Figure]:
    """Compare one plate with Lévy's series, under the touch and elsewhere."""
    solver, load = on_hundred(plate), (23.0, 61.0)
    w, _ = levy(plate, load, load, terms=20000)
    below = abs(under(solver, load) / w - 1)
    state = solver.deflect([fe.Touch(*load, 1.0)])
    series = [levy(plate, load, at) for at in PLACES]
    deflection = state.deflection(PLACES) + np.array([w for w, _ in series])
    truth = 0.5 * plate.thickness * np.array([curvature for _, curvature in series])
    strain = state.strain(PLACES) - truth
    yield from off(
        name,
        under_the_touch=(float(below), "", UNDER),
        w_elsewhere=(float(np.abs(deflection).max() / w), "", ELSEWHERE),
        strain_elsewhere=(float(np.abs(strain).max() / np.abs(truth).max()), "", ELSEWHERE),
    )


def on_hundred(plate: fe.Plate) -> fe.Linear:
    """Make the plate ready on 100 x 100 elements."""
    return fe.Linear(plate, fe.Mesh(plate.size, (100, 100)))


def half_plane() -> fe.Linear:
    """Make ready a plate whose other edges are free and a thousand times as far, on 100 x 100.

    Elements are 1/3 mm near the touch and grow outwards; the series of the whole plate differs from
    that of the half-plane by less than 1e-5.
    """
    plate = fe.Plate((2000.0, 1000.0), 1.0, 3000.0, 0.3, fe.Edges(F, F, C, F))
    away = np.array([2.0, 6.0, 20.0, 60.0, 200.0, 500.0])
    breaks = (*(1000.0 - away[::-1]), *(1000.0 + away)), tuple(away)
    return fe.Linear(plate, fe.Mesh(plate.size, (100, 100), breaks))


def under(solver: fe.Linear, place: Sequence[float] | NDArray[np.float64]) -> float:
    """Deflection under a touch of 1 N, mm."""
    return float(fe.compliance(solver, np.array([place]))[0])


def series_strains(solver: fe.Linear) -> float:
    """Worst strain of `CURVATURES`, in parts of the largest of its gauge."""
    worst = 0.0
    for load, gauge, curvatures in CURVATURES:
        state = solver.deflect([fe.Touch(100 * load[0], 100 * load[1], 1.0)])
        truth = 0.5 * PAPER.thickness / PAPER.rigidity * np.array(curvatures)
        strain = state.strain([100 * np.array(gauge)])[0]
        worst = max(worst, np.abs(strain - truth).max() / np.abs(truth).max())
    return worst


def rates() -> Iterator[Figure]:
    """Powers of the element size with which errors fall between the first two of `COUNTS`."""
    far = 100.0 * np.random.default_rng(0).random((400, 2))
    far = far[np.hypot(*(far - 50.0).T) > 20.0]
    touch = fe.Touch(50.0, 50.0, 1.0)

    def rate(read: Callable[[fe.LinearState], NDArray[np.float64]]) -> float:
        values = [read(fe.deflect(PAPER, [touch], fe.Mesh(PAPER.size, (n, n)))) for n in COUNTS]
        coarse, fine = (np.linalg.norm(value - values[-1]) for value in values[:2])
        return float(np.log2(coarse / fine))

    kinds: tuple[tuple[str, Callable[[fe.LinearState], F64], float | None], ...] = (
        ("deflection, away from the touch", lambda s: s.deflection(far), 3.6),
        ("deflection, under it", lambda s: s.deflection([(50.0, 50.0)]), 1.9),
        ("strain, recovered", lambda s: s.strain(far), 3.4),
        ("strain, second derivative of the element", plain_strain(far), None),
    )
    for name, read, power in kinds:
        bar = None if power is None else at_least(power)
        yield from line("Powers of the element size", name, power=(rate(read), "", bar))


def plain_strain(xy: NDArray[np.float64]) -> Callable[[fe.LinearState], NDArray[np.float64]]:
    """Read curvatures (K, 2) as the element has them, without recovery."""

    def read(state: fe.LinearState) -> NDArray[np.float64]:
        return np.concatenate(
            [derivative(state.mesh, xy, p, q).of(state.values) for p, q in ((2, 0), (0, 2))]
        )

    return read


def cost() -> Iterator[Figure]:
    """Influence of 72 gauges in a process of its own, then 289 single solves in another."""
    made = (
        "import fe, models.data.gauge_layout as r; p = fe.Plate((100.0, 100.0), 1.0, 3000.0, 0.3)"
    )
    influence = alone(made, "fe.influence(p, r.gauges_on_edges(p.size))")
    singles = alone(
        made + "; s = fe.Linear(p, fe.default_mesh(p))",
        "[s.deflect([fe.Touch(x, y, 1.0)]) for x in range(10, 91, 5) for y in range(10, 91, 5)]",
    )
    table = "What influences cost, default mesh"
    seconds, memory = influence
    yield from line(
        table,
        "influence of 72 gauges, 216 solves",
        time=(seconds, "CPU s", at_most(10.0)),
        memory=(memory, "MB", at_most(600.0)),
    )
    seconds, memory = singles
    yield from line(table, "289 single solves", time=(seconds, "CPU s"), memory=(memory, "MB"))


def alone(before: str, timed: str) -> tuple[float, float]:
    """CPU time of `timed`, s, and the most memory of the process, MB, after `before`."""
    code = (
        f"{before}\nimport re, time\nt = time.process_time()\n{timed}\n"
        "t = time.process_time() - t\n"
        "peak = re.search(r'VmHWM:\\s+(\\d+)', open('/proc/self/status').read())[1]\n"
        "print(t, int(peak) / 1e3)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    seconds, memory = map(float, done.stdout.split())
    return seconds, memory


def data() -> Iterator[Figure]:
    """Write the set of two touches with ten magnitudes, from an influence that is there."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "two.h5"
        words = "dataset", "paper-two-magnitudes", "--json", "--out", str(out)
        child.command(*words)  # leaves the influence in the cache
        out.unlink()
        said = json.loads(child.command(*words).said)
        size = out.stat().st_size / 1e6
    yield from line(
        "What data cost, after the influence",
        "two touches of ten magnitudes, 86 400 samples",
        time=(said["seconds"], "s", at_most(5.0)),
        size=(size, "MB"),
    )


PARTS = {"edges": edges, "rates": rates, "cost": cost, "data": data, "mesh": mesh}

if __name__ == "__main__":
    run(PARTS, __doc__)
