"""Plates: error against run time by mesh and recovery, by linear solver, and by theory.

Parts: mesh, solver, theory. CPU times are of one thread; the error is the worst of what is named.
"""

import time
from collections.abc import Iterator

import numpy as np
import scipy.sparse.linalg as sla
from numpy.typing import NDArray

import fe
from fe.elements.functional import derivative
from fe.linear.energy import stiffness
from models.data.gauge_layout import inside_edges, on_edges
from rig.report.figure import Figure
from rig.studies.stiff.plates import PAPER
from rig.studies.study import cpu_seconds, line, run

LOADS = ((50.0, 50.0), (30.0, 20.0), (10.0, 50.0), (20.0, 10.0))
RING = np.concatenate([on_edges(PAPER.size), inside_edges(PAPER.size)])
MESHES, TRUTH = (20, 40, 80, 100, 120, 160), 400
PVC = fe.Plate((254.0, 254.0), thickness=1.0, young=3000.0, poisson=0.38)
PRESSES = ((127.0, 127.0), (60.0, 90.0), (100.0, 200.0), (40.0, 45.0))
FORCES = (0.2, 5.0)
GAUGES = 25.0 + inside_edges((204.0, 204.0), 17.0, 0.0)


def meshes() -> Iterator[Figure]:
    """Strain of 144 gauges of both rings of the paper's plate under four loads, by mesh.

    The error is the worst one in parts of the largest strain of its load.
    """
    table = f"Mesh and recovery, strain against {TRUTH} × {TRUTH} elements"
    truth = [state.strain(RING) for state in states(linear(TRUTH))]
    for count in MESHES:
        solver = linear(count)
        first = cpu_seconds(lambda: solver.deflect([fe.Touch(*LOADS[0], 1.0)]))  # noqa: B023
        further = cpu_seconds(lambda: solver.deflect([fe.Touch(*LOADS[1], 1.0)]), 5)  # noqa: B023
        found = states(solver)
        name = f"{count} × {count}" + (" (default)" if count == 120 else "")
        yield from line(
            table,
            name,
            time=(f"{first:.2f}", "s"),
            error=f"{worst([state.strain(RING) for state in found], truth):.1e}",
            error_without_recovery=f"{worst([plain_strain(s) for s in found], truth):.1e}",
            each_further_load=(f"{1e3 * further:.1f}", "ms"),
        )


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


def solvers() -> Iterator[Figure]:
    """Solve with the same stiffness by factors, float64 and float32, and by conjugate gradients."""
    table = "Linear solver, 120 × 120 elements, all unknowns against the factored one"
    matrix = stiffness(PAPER, fe.default_mesh(PAPER))
    scale = 1.0 / np.sqrt(matrix.diagonal())
    scaled = matrix * scale[:, None] * scale
    right = np.random.default_rng(0).standard_normal(len(scale))
    exact = np.zeros(0)
    for name, dtype in (
        ("SuperLU, float64 (default)", np.float64),
        ("SuperLU, float32", np.float32),
    ):
        began = time.process_time()
        factors = sla.splu(
            scaled.astype(dtype).tocsc(),
            permc_spec="MMD_AT_PLUS_A",
            diag_pivot_thresh=0.0,
            options={"SymmetricMode": True},
        )
        x = factors.solve(right.astype(dtype))
        first = time.process_time() - began
        again = cpu_seconds(lambda: factors.solve(right.astype(dtype)), 5)  # noqa: B023
        exact = x if not exact.size else exact
        yield from solved(table, name, first, again, x, exact)
    began = time.process_time()
    x, stopped = sla.cg(scaled, right, rtol=1e-6, maxiter=20000)
    spent = time.process_time() - began
    name = "conjugate gradients to 1e-6" + (" (did not converge)" if stopped else "")
    yield from solved(table, name, spent, spent, x, exact)


def solved(table, name, first, again, x, exact) -> Iterator[Figure]:
    """Tell the times of a solver, and what it is off."""
    off = np.linalg.norm(x - exact) / np.linalg.norm(exact)
    return line(
        table,
        name,
        first_load=(f"{first:.2f}", "s"),
        each_further_load=(f"{1e3 * again:.0f}", "ms"),
        relative_error=f"{off:.0e}",
    )


def theories() -> Iterator[Figure]:
    """Deflection and strain by theory, of a clamped PVC plate under four presses."""
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
            table = (
                f"Theory at {force:g} N, PVC {PVC.size[0]:g} × {PVC.size[1]:g} × "
                f"{PVC.thickness:g} mm clamped, against the shell on 60 × 60 elements"
            )
            yield from line(table, name, **compared(press, force, true), once=(f"{once:.1f}", "s"))


def compared(press, force: float, true: list[fe.ShellState]) -> dict[str, str | tuple[str, str]]:
    """Time of one press, errors of ring strain and deflection, and the ratio w/h."""
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
    return {
        "time": (f"{1e3 * np.median(spent):.1f}", "ms"),
        "error": (f"{100 * np.median(of_strain):.3f}", "% of the ring's strain"),
        "worst_of_the_presses": (f"{100 * max(of_strain):.2f}", "%"),
        "deflection": (f"{100 * np.median(of_w):.2f}", "%"),
        "deflection,_worst": (f"{100 * max(of_w):.2f}", "%"),
        "w/h": f"{min(ratios):.2f} to {max(ratios):.2f}",
    }


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


PARTS = {"mesh": meshes, "solver": solvers, "theory": theories}

if __name__ == "__main__":
    run(PARTS, __doc__)
