"""Plates: error against run time by mesh and recovery, by linear solver, and by theory.

Parts: mesh, coarse (with a coarser truth), solver, theory. CPU times are of one thread; the error
is the worst of what is named.
"""

import time
from collections.abc import Callable, Iterator
from functools import partial

import numpy as np
import scipy.sparse.linalg as sla

import fe
from fe.elements.functional import derivative
from fe.linear.energy import stiffness
from models import gauges_inside_edges, gauges_on_edges
from rig.report.figure import Figure
from rig.studies.plates.paper import PAPER
from rig.studies.study import Cell, cpu_seconds, line, run
from rig.system.arrays import F64

LOADS = ((50.0, 50.0), (30.0, 20.0), (10.0, 50.0), (20.0, 10.0))
RING = np.concatenate([gauges_on_edges(PAPER.size), gauges_inside_edges(PAPER.size)])
MESHES, TRUTH = (20, 40, 80, 100, 120, 160), 400
COARSE, COARSE_TRUTH = (20, 40, 80, 120), 200
DEFAULT = 120  # elements a side of the default mesh
PVC = fe.Plate((254.0, 254.0), thickness=1.0, young=3000.0, poisson=0.38)
PRESSES = ((127.0, 127.0), (60.0, 90.0), (100.0, 200.0), (40.0, 45.0))
FORCES = (0.2, 5.0)
Unknowns = F64
AnyState = fe.LinearState | fe.LargeState | fe.ShellState
Press = Callable[[tuple[float, float], float], AnyState]
"""From a place, mm, and a force, N, to the state of the plate."""
GAUGES = 25.0 + gauges_inside_edges((204.0, 204.0), 17.0, 0.0)


def meshes(counts: tuple[int, ...], fine: int) -> Iterator[Figure]:
    """Strain of 144 gauges of both rings of the paper's plate under four loads, by mesh.

    The error is the worst one in parts of the largest strain of its load.
    """
    table = f"Mesh and recovery, strain against {fine} × {fine} elements"
    truth = [state.strain(RING) for state in states(linear(fine))]
    for count in counts:
        solver = linear(count)
        first = cpu_seconds(lambda: solver.deflect([fe.Touch(*LOADS[0], 1.0)]))  # noqa: B023
        further = cpu_seconds(lambda: solver.deflect([fe.Touch(*LOADS[1], 1.0)]), 5)  # noqa: B023
        found = states(solver)
        name = f"{count} × {count}" + (" (default)" if count == DEFAULT else "")
        yield from line(
            table,
            name,
            time=(first, "s"),
            error=worst([state.strain(RING) for state in found], truth),
            error_without_recovery=worst([plain_strain(s) for s in found], truth),
            each_further_load=(1e3 * further, "ms"),
        )


def linear(count: int) -> fe.Linear:
    """Make the paper's plate ready on so many elements a side."""
    return fe.Linear(PAPER, fe.Mesh(PAPER.size, (count, count)))


def states(solver: fe.Linear) -> list[fe.LinearState]:
    """Bend it by each load."""
    return [solver.deflect([fe.Touch(*place, 1.0)]) for place in LOADS]


def plain_strain(state: fe.LinearState) -> F64:
    """Strain (K, 3) from the second derivatives of the elements, without recovery."""
    curvatures = [
        derivative(state.mesh, RING, p, q).of(state.values)[:, 0]
        for p, q in ((2, 0), (0, 2), (1, 1))
    ]
    return -0.5 * state.plate.thickness * np.stack(curvatures, axis=1)


def worst(found: list[F64], truth: list[F64]) -> float:
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


def solved(
    table: str, name: str, first: float, again: float, x: Unknowns, exact: Unknowns
) -> Iterator[Figure]:
    """Tell the times of a solver, and what it is off."""
    off = np.linalg.norm(x - exact) / np.linalg.norm(exact)
    return line(
        table,
        name,
        first_load=(first, "s"),
        each_further_load=(1e3 * again, "ms"),
        relative_error=float(off),
    )


def theories() -> Iterator[Figure]:
    """Deflection and strain by theory, of a clamped PVC plate under four presses."""
    fine = fe.Shell(PVC, fe.grid(PVC, 60))
    truth = {
        force: [fine.undeformed.touch([fe.Touch(place[0], place[1], force)]) for place in PRESSES]
        for force in FORCES
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
            yield from line(table, name, **compared(press, force, true), once=(once, "s"))


def compared(press: Press, force: float, true: list[fe.ShellState]) -> dict[str, Cell]:
    """Time of one press, errors of ring strain and deflection, and the ratio w/h."""
    ratios: list[float] = []
    of_w: list[float] = []
    of_strain: list[float] = []
    spent: list[float] = []
    for place, fine in zip(PRESSES, true, strict=True):
        began = time.process_time()
        state = press(place, force)
        strain = state.strain(GAUGES)
        spent.append(time.process_time() - began)
        deep, right = fine.deflection([place])[0], fine.strain(GAUGES)
        ratios.append(float(-deep / PVC.thickness))
        of_w.append(float(abs(state.deflection([place])[0] / deep - 1)))
        of_strain.append(float(np.linalg.norm(strain - right) / np.linalg.norm(right)))
    return {
        "time": (1e3 * float(np.median(spent)), "ms"),
        "error": (100 * float(np.median(of_strain)), "% of the ring's strain"),
        "worst_of_the_presses": (100 * float(max(of_strain)), "%"),
        "deflection": (100 * float(np.median(of_w)), "%"),
        "deflection,_worst": (100 * float(max(of_w)), "%"),
        "min w/h": float(min(ratios)),
        "largest_w/h": float(max(ratios)),
    }


def _by_linear() -> Press:
    solver = fe.Linear(PVC, fe.default_mesh(PVC))
    return lambda place, force: solver.deflect([fe.Touch(place[0], place[1], force)])


def _by_reduced() -> Press:
    plate = fe.reduced_plate(PVC)
    return lambda place, force: plate.solve([fe.Touch(place[0], place[1], force)])


def _by_shell(count: int) -> Callable[[], Press]:
    def prepare() -> Press:
        shell = fe.Shell(PVC, fe.grid(PVC, count))
        return lambda place, force: shell.undeformed.touch([fe.Touch(place[0], place[1], force)])

    return prepare


THEORIES = {
    "linear, 120 × 120": _by_linear,
    "reduced": _by_reduced,
    "shell, 20 × 20": _by_shell(20),
    "shell, 40 × 40 (default)": _by_shell(40),
}


PARTS = {
    "mesh": partial(meshes, MESHES, TRUTH),
    "coarse": partial(meshes, COARSE, COARSE_TRUTH),
    "solver": solvers,
    "theory": theories,
}

if __name__ == "__main__":
    run(PARTS, __doc__)
