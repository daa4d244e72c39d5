"""Write docs/plate-figures.md: error of plates against run time, and what they do at extremes.

Usage: ``python benchmarks/plate_figures.py``; about five minutes. CPU times are of one thread and
the median of some runs; the machine is named in the page.
"""

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import platform
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import scipy.sparse.linalg as sla
from numpy.typing import NDArray
from plate_extremes import PAPER, extreme_lines

import fe
from fe.energy import stiffness
from fe.functional import derivative
from models.ring import inside_edges, on_edges

PAGE = Path(__file__).parent.parent / "docs" / "plate-figures.md"
LOADS = ((50.0, 50.0), (30.0, 20.0), (10.0, 50.0), (20.0, 10.0))
RING = np.concatenate([on_edges(PAPER.size), inside_edges(PAPER.size)])
MESHES, TRUTH = (20, 40, 80, 100, 120, 160), 400
PVC = fe.Plate((254.0, 254.0), thickness=1.0, young=3000.0, poisson=0.38)
PRESSES = ((127.0, 127.0), (60.0, 90.0), (100.0, 200.0), (40.0, 45.0))
FORCES = (0.05, 0.5, 5.0)
GAUGES = 25.0 + inside_edges((204.0, 204.0), 17.0, 0.0)
Line = tuple[str, ...]


def main() -> None:
    """Measure and write the page."""
    parts = [
        "# Plates: error against run time, and extremes",
        f"Written by `python benchmarks/plate_figures.py` on {machine()}, one thread.",
        "## Linear plate: mesh and recovery",
        "Clamped plate of the paper, four loads, 144 gauges of both rings. Worst error in parts of "
        f"the largest strain of a load, against {TRUTH} × {TRUTH} elements.",
        table(
            "elements|strain, recovered|strain, second derivative|first load|each further load",
            mesh_lines(),
        ),
        "## Linear solver",
        "The same stiffness at 120 × 120 elements. Error of all unknowns against the factored one.",
        table("solver|first load|each further load|relative error", solver_lines()),
        "## Small or large: linear, reduced, shell",
        f"PVC, {PVC.size[0]:g} × {PVC.size[1]:g} × {PVC.thickness:g} mm, clamped, four presses. "
        "Error in deflection under the touch and strain of a ring 25 mm inside, median and worst "
        "of the presses, against the shell on 60 × 60 elements; time of one press after what is "
        "prepared once.",
        table("theory|once|force|w/h|deflection|ring strain|each press", theory_lines()),
        "## Stiff and extreme",
        "Digits: of the deflection under the touch, from the relative error against the truth "
        "named. What is refused is refused with the sentence quoted.",
        table("case|truth|digits right|what is said", extreme_lines()),
        "The shell at its extremes (thickness to 1e-6 of the side, springs, contrasts, wrinkles) "
        "is printed by `python benchmarks/shell_bars.py` and told in "
        "[decision 15](decisions/0015-shell.md); the reduced plate on the ring of the paper by "
        "`python benchmarks/reduced_bars.py`.",
    ]
    PAGE.write_text("\n\n".join(parts) + "\n")


def machine() -> str:
    """Name processor and versions."""
    known = Path("/proc/cpuinfo")
    lines = known.read_text().splitlines() if known.exists() else []
    names = [line.split(":")[1].strip() for line in lines if line.startswith("model name")]
    cpu = names[0] if names else platform.processor()
    return f"{cpu}, Python {platform.python_version()}, NumPy {np.__version__}"


def table(head: str, lines: Iterator[Line]) -> str:
    """Make a Markdown table, and print each line as it comes."""
    columns = head.split("|")
    rows = [head, "|".join("---" for _ in columns)]
    for line in lines:
        print(" | ".join(line), flush=True)
        rows.append("|".join(line))
    return "\n".join(f"| {row.replace('|', ' | ')} |" for row in rows)


def timed(run: Callable[[], object], times: int = 1) -> float:
    """Median CPU time of some runs, s."""
    taken = []
    for _ in range(times):
        began = time.process_time()
        run()
        taken.append(time.process_time() - began)
    return float(np.median(taken))


def mesh_lines() -> Iterator[Line]:
    """Strain and time of the linear plate by mesh."""
    truth = [state.strain(RING) for state in states(linear(TRUTH))]
    for count in MESHES:
        solver = linear(count)
        first = timed(lambda: solver.deflect([fe.Touch(*LOADS[0], 1.0)]))  # noqa: B023
        further = timed(lambda: solver.deflect([fe.Touch(*LOADS[1], 1.0)]), 5)  # noqa: B023
        found = states(solver)
        recovered = worst([state.strain(RING) for state in found], truth)
        plain = worst([plain_strain(state) for state in found], truth)
        name = f"{count} × {count}" + (" (default)" if count == 120 else "")
        yield name, f"{recovered:.1e}", f"{plain:.1e}", f"{first:.2f} s", f"{1e3 * further:.0f} ms"


def linear(count: int) -> fe.Linear:
    """Make the paper's plate ready on so many elements a side."""
    return fe.Linear(PAPER, fe.Mesh(PAPER.size, (count, count)))


def states(solver: fe.Linear) -> list[fe.State]:
    """Bend it by each load."""
    return [solver.deflect([fe.Touch(*place, 1.0)]) for place in LOADS]


def plain_strain(state: fe.State) -> NDArray[np.float64]:
    """Strain (K, 3) from the second derivatives of the elements, without recovery."""
    curvatures = [
        derivative(state.mesh, RING, p, q).of(state.values)[:, 0]
        for p, q in ((2, 0), (0, 2), (1, 1))
    ]
    return -0.5 * state.plate.thickness * np.stack(curvatures, axis=1)


def worst(found: list[NDArray], truth: list[NDArray]) -> float:
    """Largest error in parts of the largest value of its load."""
    pairs = zip(found, truth, strict=True)
    return max(float(np.abs(f - t).max() / np.abs(t).max()) for f, t in pairs)


def solver_lines() -> Iterator[Line]:
    """Factors in float64 and float32, and conjugate gradients."""
    matrix = stiffness(PAPER, fe.default_mesh(PAPER))
    scale = 1.0 / np.sqrt(matrix.diagonal())
    scaled = matrix * scale[:, None] * scale
    right = np.random.default_rng(0).standard_normal(len(scale))
    exact = np.zeros(0)
    for name, dtype in (("SuperLU, float64 (ours)", np.float64), ("SuperLU, float32", np.float32)):
        began = time.process_time()
        factors = sla.splu(
            scaled.astype(dtype).tocsc(),
            permc_spec="MMD_AT_PLUS_A",
            diag_pivot_thresh=0.0,
            options={"SymmetricMode": True},
        )
        x = factors.solve(right.astype(dtype))
        first = time.process_time() - began
        again = timed(lambda: factors.solve(right.astype(dtype)), 5)  # noqa: B023
        exact = x if not exact.size else exact
        off = np.linalg.norm(x - exact) / np.linalg.norm(exact)
        yield name, f"{first:.2f} s", f"{1e3 * again:.0f} ms", f"{off:.0e}"
    began = time.process_time()
    x, stopped = sla.cg(scaled, right, rtol=1e-6, maxiter=20000)
    spent = time.process_time() - began
    off = np.linalg.norm(x - exact) / np.linalg.norm(exact)
    end = f"{off:.0e}" + (" (did not converge)" if stopped else "")
    yield "conjugate gradients, residual 1e-6", f"{spent:.1f} s", f"{spent:.1f} s", end


def theory_lines() -> Iterator[Line]:
    """Error of each theory against a fine shell, and its time."""
    fine = fe.Shell(PVC, fe.grid(PVC, 60))
    truth = {
        force: [fine.rest.touch([fe.Touch(*place, force)]) for place in PRESSES] for force in FORCES
    }
    for name, prepare in THEORIES.items():
        began = time.process_time()
        press = prepare()
        press((10.0, 10.0), 1e-3)
        once = time.process_time() - began
        for force, true in truth.items():
            yield name, f"{once:.1f} s", f"{force:g} N", *compared(press, force, true)


def compared(press, force: float, true: list[fe.ShellState]) -> Line:
    """Ratio w/h, errors of deflection and ring strain, and time of one press."""
    ratios, of_w, of_strain, spent = [], [], [], []
    for place, fine in zip(PRESSES, true, strict=True):
        began = time.process_time()
        state = press(place, force)
        strain = state.strain(GAUGES)
        spent.append(time.process_time() - began)
        deep, right = fine.deflection([place])[0], fine.strain(GAUGES)
        ratios.append(-deep / PVC.thickness)
        of_w.append(abs(state.deflection([place])[0] / deep - 1))
        of_strain.append(np.linalg.norm(strain - right) / np.linalg.norm(right))
    return (
        f"{min(ratios):.2f} to {max(ratios):.2f}",
        f"{100 * np.median(of_w):.2f} %, {100 * max(of_w):.2f} %",
        f"{100 * np.median(of_strain):.2f} %, {100 * max(of_strain):.2f} %",
        f"{1e3 * np.median(spent):.0f} ms",
    )


def _by_linear():
    solver = fe.Linear(PVC, fe.default_mesh(PVC))
    return lambda place, force: solver.deflect([fe.Touch(*place, force)])


def _by_reduced():
    plate = fe.reduce(PVC)
    return lambda place, force: plate.solve([fe.Touch(*place, force)])


def _by_shell(count: int):
    def prepare():
        shell = fe.Shell(PVC, fe.grid(PVC, count))
        return lambda place, force: shell.rest.touch([fe.Touch(*place, force)])

    return prepare


THEORIES = {
    "linear, 120 × 120": _by_linear,
    "reduced": _by_reduced,
    "shell, 20 × 20": _by_shell(20),
    "shell, 40 × 40 (default)": _by_shell(40),
}


if __name__ == "__main__":
    main()
