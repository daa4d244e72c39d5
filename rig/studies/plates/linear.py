"""Print what linear plates are held to, each figure beside its bar.

Usage: ``python benchmarks/plate_bars.py``; about five minutes and 5 GB, most of both for the finer
mesh. Large deflection is in ``shell_bars.py`` and ``reduced_bars.py``.
"""

import json
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from math import inf
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import fe
from fe.elements.functional import derivative
from models.data.gauge_layout import inside_edges, on_edges
from rig.studies.plates.levy import levy

PAPER = fe.Plate((100.0, 100.0), thickness=1.0, young=3000.0, poisson=0.3)
# Loads of the paper, 289 in steps of 5 mm. Plate and rings are symmetric in both middle lines and
# the diagonals, so the 45 of one eighth stand for all.
EIGHTH = [(x, y) for x in np.arange(10.0, 51.0, 5.0) for y in np.arange(10.0, x + 1.0, 5.0)]
RINGS = {
    "on the edges (reading B)": on_edges(PAPER.size),
    "5 mm inside (reading A)": inside_edges(PAPER.size),
}
# Deflection under a load on the clamped and the supported square, times D/(P a²): double series.
SQUARES = {
    fe.Clamped(): {(0.5, 0.5): 0.005612024020, (0.25, 0.5): 0.003285543346},
    fe.Supported(): {(0.5, 0.5): 0.011600839772},
}
# Load, gauge (shares of the side) and D/P times w,xx w,yy w,xy there, clamped: double series.
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


@dataclass(frozen=True)
class Row:
    """One figure: what, measured, and the bar in words."""

    what: str
    measured: str
    bar: str


def rows() -> Iterator[Row]:
    """Measure every row."""
    for part in (edge_rows, rate_rows, cost_rows, data_rows, mesh_rows):
        yield from part()


def main() -> None:
    """Print them."""
    for row in rows():
        print(f"{row.what:62s} {row.measured:>32s}   bar {row.bar}", flush=True)


def mesh_rows() -> Iterator[Row]:
    """Strains of the paper's loads on the default mesh against one of four times its elements."""
    default = fe.default_mesh(PAPER)
    fine = fe.Mesh(PAPER.size, (4 * default.counts[0], 4 * default.counts[1]))
    coarse, true = (ring_strains(fe.Linear(PAPER, mesh)) for mesh in (default, fine))
    for name, found, truth in zip(RINGS, coarse, true, strict=True):
        of_each = np.abs(found - truth).max(axis=(1, 2)) / np.abs(truth).max(axis=(1, 2))
        yield Row(
            f"289 loads, 72 points {name}: worst, median",
            f"{of_each.max():.1e}, {np.median(of_each):.1e}",
            "≤ 1e-4 relative",
        )


def ring_strains(linear: fe.Linear) -> list[NDArray[np.float64]]:
    """Strains (45, 72, 3) of either ring under each load of one eighth."""
    states = [linear.deflect([fe.Touch(*place, 1.0)]) for place in EIGHTH]
    return [np.array([state.strain(ring) for state in states]) for ring in RINGS.values()]


def edge_rows() -> Iterator[Row]:
    """Edges of every kind on 100 x 100 elements against series."""
    for kind, loads in SQUARES.items():
        solver = on_hundred(fe.Plate(PAPER.size, 1.0, 3000.0, 0.3, kind))
        unit = PAPER.rigidity / 100.0**2
        worst = max(abs(under(solver, 100 * np.array(p)) * unit / w - 1) for p, w in loads.items())
        yield Row(f"{kind.kind} square: w under the touch", f"{worst:.1e}", "≤ 5e-5")
    yield Row("clamped square: strains of plate.csv", f"{series_strains():.1e}", "≤ 1e-5")
    half = abs(under(half_plane(), (1000.0, 1.0)) * 4 * np.pi * PAPER.rigidity - 1)
    yield Row("half-plane: w 1 mm from its clamped edge", f"{half:.1e}", "≤ 5e-5")
    for name, sides in MIXED.items():
        yield from mixed_rows(name, fe.Plate(PAPER.size, 1.0, 3000.0, 0.3, fe.Edges(S, S, *sides)))


def mixed_rows(name: str, plate: fe.Plate) -> Iterator[Row]:
    """Compare one plate with Lévy's series, under the touch and elsewhere."""
    solver, load = on_hundred(plate), (23.0, 61.0)
    w, _ = levy(plate, load, load, terms=20000)
    yield Row(f"{name}: w under the touch", f"{abs(under(solver, load) / w - 1):.1e}", "≤ 5e-5")
    state = solver.deflect([fe.Touch(*load, 1.0)])
    series = [levy(plate, load, at) for at in PLACES]
    deflection = state.deflection(PLACES) + np.array([w for w, _ in series])
    truth = 0.5 * plate.thickness * np.array([curvature for _, curvature in series])
    strain = state.strain(PLACES) - truth
    of_w, of_strain = np.abs(deflection).max() / w, np.abs(strain).max() / np.abs(truth).max()
    yield Row(f"{name}: w, strain elsewhere", f"{of_w:.1e}, {of_strain:.1e}", "≤ 1e-5")


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


def under(solver: fe.Linear, place) -> float:
    """Deflection under a touch of 1 N, mm."""
    return float(fe.compliance(solver, [place])[0])


def series_strains() -> float:
    """Worst strain of `CURVATURES`, in parts of the largest of its gauge."""
    solver, worst = on_hundred(PAPER), 0.0
    for load, gauge, curvatures in CURVATURES:
        state = solver.deflect([fe.Touch(100 * load[0], 100 * load[1], 1.0)])
        truth = 0.5 * PAPER.thickness / PAPER.rigidity * np.array(curvatures)
        strain = state.strain([100 * np.array(gauge)])[0]
        worst = max(worst, np.abs(strain - truth).max() / np.abs(truth).max())
    return worst


def rate_rows() -> Iterator[Row]:
    """Powers of the element size with which errors fall between the first two of `COUNTS`."""
    far = 100.0 * np.random.default_rng(0).random((400, 2))
    far = far[np.hypot(*(far - 50.0).T) > 20.0]
    touch = fe.Touch(50.0, 50.0, 1.0)

    def rate(read: Callable[[fe.State], NDArray[np.float64]]) -> str:
        values = [read(fe.deflect(PAPER, [touch], fe.Mesh(PAPER.size, (n, n)))) for n in COUNTS]
        coarse, fine = (np.linalg.norm(value - values[-1]) for value in values[:2])
        return f"h^{np.log2(coarse / fine):.2f}"

    yield Row("deflection, away from the touch", rate(lambda s: s.deflection(far)), "4")
    yield Row("deflection, under it", rate(lambda s: s.deflection([(50.0, 50.0)])), "2")
    yield Row("strain, recovered", rate(lambda s: s.strain(far)), "4")
    yield Row("strain, second derivative of the element", rate(plain_strain(far)), "2")


def plain_strain(xy: NDArray[np.float64]) -> Callable[[fe.State], NDArray[np.float64]]:
    """Read curvatures (K, 2) as the element has them, without recovery."""

    def read(state: fe.State) -> NDArray[np.float64]:
        return np.concatenate(
            [derivative(state.mesh, xy, p, q).of(state.values) for p, q in ((2, 0), (0, 2))]
        )

    return read


def cost_rows() -> Iterator[Row]:
    """Influence of 72 gauges in a process of its own, then 289 single solves in another."""
    made = (
        "import fe, models.data.gauge_layout as r; p = fe.Plate((100.0, 100.0), 1.0, 3000.0, 0.3)"
    )
    influence = alone(made, "fe.influence(p, r.on_edges(p.size))")
    singles = alone(
        made + "; s = fe.Linear(p, fe.default_mesh(p))",
        "[s.deflect([fe.Touch(x, y, 1.0)]) for x in range(10, 91, 5) for y in range(10, 91, 5)]",
    )
    yield Row("influence of 72 gauges, 216 solves", influence, "≤ 10 CPU s, ≤ 600 MB")
    yield Row("289 single solves beside it", singles, "(stands beside)")


def alone(before: str, timed: str) -> str:
    """CPU time of `timed` and the most memory of the process, after `before`."""
    code = (
        f"{before}\nimport re, time\nt = time.process_time()\n{timed}\n"
        "t = time.process_time() - t\n"
        "peak = re.search(r'VmHWM:\\s+(\\d+)', open('/proc/self/status').read())[1]\n"
        "print(f'{t:.1f} CPU s, {int(peak) / 1e3:.0f} MB')"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return done.stdout.strip()


def data_rows() -> Iterator[Row]:
    """Write the set of two touches with ten magnitudes, from an influence that is there."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "two.h5"
        command = [
            Path(sys.executable).parent / "touchplate",
            "dataset",
            "paper-two-magnitudes",
            "--json",
        ]
        for _ in range(2):  # the first leaves the influence in the cache
            out.unlink(missing_ok=True)
            done = subprocess.run([*command, "--out", out], capture_output=True, check=True)
        said = json.loads(done.stdout)
        size = out.stat().st_size / 1e6
    yield Row("data set of 86 400 samples", f"{said['seconds']:.2f} s, {size:.0f} MB", "≤ 5 s")


if __name__ == "__main__":
    main()
