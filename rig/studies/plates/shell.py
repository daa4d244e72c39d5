"""What the shell is held to: rods, bent bases, thickness to the end, and error against time.

Parts: rods, bases, strips, thickness, extremes, meshes; `thickness` and `meshes` take many minutes
each, the others a minute or less. Eigenvalues are the smallest ones in parts of the flat plate's.
CPU time is of one thread.
"""

import time
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

import fe
from fe import Base, Shell, ShellState, shell_mesh, solve
from fe.linear.linear import Face
from rig.report.figure import Figure, at_most
from rig.studies.plates.rod import (
    RING_LENGTH,
    STRIP_SIZE,
    pressed_shell,
    ring,
    sheared_rod,
    sheared_shell,
    strip,
)
from rig.studies.study import Cell, cpu_times, line, run

TWO = fe.Edges(fe.Clamped(), fe.Clamped(), fe.Free(), fe.Free())
PAPER = fe.Plate((100.0, 100.0), 1.0, 3000.0, 0.3, TWO)
BASES = (Base(5.0, 15.0), Base(10.0, 30.0), Base(20.0, 45.0))
OBLONG, YOUNG = (254.0, 200.0), 3000.0
PLACE = (100.0, 90.0)
THINNESS = (4e-2, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6)
FINER, HALF = 60, 20  # elements along the longer side: a finer mesh and a coarser one
PVC = fe.Plate((254.0, 254.0), 1.0, YOUNG, 0.38)
MESHES, TRUTH = (12, 20, 40, 60), 80
REPEATS = 3
RESIDUAL = at_most(1e-6)
"""What a state must reach to be an equilibrium."""


def stability(state: ShellState) -> dict[str, Cell]:
    """Make cells of what a state says of itself."""
    said = state.stability
    return {
        "residual": (said.residual, "", RESIDUAL),
        "iterations": said.iterations,
        "eigenvalue": said.eigenvalue,
        "stability": said.verdict.value,
    }


def rods() -> Iterator[Figure]:
    """Cantilevers against an independent rod, solved as a boundary value problem."""
    table = "Shell: cantilevers against an independent rod"
    (u, w), (state, end) = sheared_rod(), sheared_shell()
    off = max(abs(end[0] / u - 1), abs(end[2] / w - 1))
    yield from line(table, "end shear", off=(off, "relative", at_most(1e-4)), **stability(state))
    place, moment = ring()
    gap = np.abs(place - np.array([-RING_LENGTH, 0.0, 0.0])).max() / RING_LENGTH
    off = abs(moment / (50 * np.pi / 3) - 1)
    name, bar = "end moment, full circle", at_most(1e-3)
    yield from line(table, f"{name}: gap over length", off=(float(gap), "relative", bar))
    yield from line(table, f"{name}: moment", off=(float(off), "relative", bar))


def bases() -> Iterator[Figure]:
    """Plate of the paper on its bent bases, and a small touch there."""
    shell = Shell(PAPER, shell_mesh(PAPER))
    table = f"Shell: bent and twisted bases, {shell.mesh.counts[0]} × {shell.mesh.counts[1]}"
    for base in BASES:
        began = time.process_time()
        state = shell.at(base)
        spent, began = time.process_time() - began, time.process_time()
        touched = state.touch([fe.Touch(40.0, 30.0, 0.05)])
        again, name = time.process_time() - began, f"bend {base.bend:g} mm, twist {base.twist:g}°"
        yield from line(table, name, **stability(state), time=(spent, "CPU s"))
        name += ", 0.05 N at (40, 30) mm"
        yield from line(table, name, **stability(touched), time=(again, "CPU s"))


def strips() -> Iterator[Figure]:
    """Supported strip under even pressure against its closed form, from plate to membrane."""
    for thinness in THINNESS[1:]:
        thickness = thinness * STRIP_SIZE[0]
        pressure, truth = strip(thickness)
        state = pressed_shell(thickness, pressure)
        off = state.deflection([[STRIP_SIZE[0] / 2, STRIP_SIZE[1] / 2]])[0] / truth - 1
        yield from line(
            "Shell: strip under pressure against its closed form",
            f"thickness/length {thinness:.0e}",
            w_off=(float(off), "relative"),
            **stability(state),
        )


def thickness() -> Iterator[Figure]:
    """Plates under one force in parts of their stretching stiffness, default mesh against others.

    Thick ones bend as in linear theory, thin ones stretch as a membrane whatever their thickness.
    The deflection under the touch is compared with a mesh fine there, the strain of a ring with
    one of 60 elements along the longer side.
    """
    for name, edges in (("four edges clamped", fe.Clamped()), ("two clamped, two free", TWO)):
        for thinness in THINNESS:
            plate = fe.Plate(OBLONG, thinness * OBLONG[1], YOUNG, 0.38, edges)
            touch = fe.Touch(*PLACE, 1e-6 * YOUNG * plate.thickness * OBLONG[1])
            # Wrinkles of free edges take long and are finer than any of these meshes.
            film = edges is TWO and thinness < 2e-4
            began = time.process_time()
            state = solve(plate, [touch], mesh=fe.grid(plate, HALF) if film else None)
            spent = time.process_time() - began
            yield from line(
                f"Shell by thickness, {OBLONG[0]:g} × {OBLONG[1]:g} mm, {name}",
                f"thickness/side {thinness:.0e}",
                time=(spent, "CPU s"),
                **stability(state),
                **({} if film else beside_finer(state, touch)),
            )


def beside_finer(state: ShellState, touch: fe.Touch) -> dict[str, Cell]:
    """Errors of a state, for a point and for a disc of 8 mm; none where finer meshes fail."""
    plate = state.plate
    fine = solve(plate, [touch], mesh=fe.grid(plate, FINER))
    disc = fe.Touch(*PLACE, touch.force, radius=8.0)
    sharp, sharp_disc = (solve(plate, [each], mesh=sharp_at(plate)) for each in (touch, disc))
    if not all(each.stability.converged for each in (fine, sharp, sharp_disc)):
        return {}
    linear = fe.deflect(plate, [touch]).deflection([PLACE])[0]
    w = float(sharp.deflection([PLACE])[0])
    return {
        "w": (w, "mm"),
        "w_over_linear": w / float(linear),
        "w_off,_point": (under(state, sharp), "relative"),
        "w_off,_disc": (under(solve(plate, [disc]), sharp_disc), "relative"),
        "ring_strain_off,_face": (ring_off(state, fine, "top"), "relative"),
        "ring_strain_off,_middle": (ring_off(state, fine, "middle"), "relative"),
    }


def sharp_at(plate: fe.Plate) -> fe.Mesh:
    """Mesh with elements of 0.2 mm at the touch that grow outwards, 54 x 54."""
    away = np.array([0.6, 3.0, 12.0, 40.0])
    breaks = [(*(at - away[::-1]), *(at + away)) for at in PLACE]
    return fe.Mesh(plate.size, (54, 54), (breaks[0], breaks[1]))


def ring_of(plate: fe.Plate) -> NDArray[np.float64]:
    """Places (24, 2) of gauges on a ring 10 mm inside the edges, mm."""
    a, b = plate.size
    along = np.linspace(0.1, 0.9, 6)
    x, y = 10 + along * (a - 20), 10 + along * (b - 20)
    ends = np.full(6, 10.0)
    sides = [(x, ends), (x, b - ends), (ends, y), (a - ends, y)]
    return np.concatenate([np.column_stack(side) for side in sides])


def under(state: ShellState, sharp: ShellState) -> float:
    """Relative error of the deflection under the touch."""
    return float(abs(state.deflection([PLACE])[0] / sharp.deflection([PLACE])[0] - 1))


def ring_off(state: ShellState, fine: ShellState, face: Face = "top") -> float:
    """Worst ring strain against a finer mesh, in parts of the largest there."""
    gauges = ring_of(state.plate)
    found, truth = state.strain(gauges, face), fine.strain(gauges, face)
    return float(np.abs(found - truth).max() / np.abs(truth).max())


def extremes() -> Iterator[Figure]:
    """Contrast, springs, Poisson's ratio, and touches near edges, on a coarse mesh."""
    middle = fe.Touch(200.0, 90.0, 2.0)
    for contrast in (1e-12, 1e-6, 1e6, 1e9, 1e10, 1e12):
        patch = fe.Patch((60.0, 130.0), (40.0, 90.0), 1.0, YOUNG * contrast)
        yield from one(f"patch {contrast:.0e} times as stiff", middle, patches=(patch,))
    for spring in (1e-6, 1e-3, 1.0, 1e6, 1e15):
        yield from one(f"springs {spring:.0e}", middle, edges=fe.Elastic(spring, spring, spring))
    yield from one("Poisson's ratio 0.499", middle, poisson=0.499)
    yield from one("touch 1 mm from an edge", fe.Touch(1.0, 90.0, 5.0))
    yield from one("touch 1 mm from a corner", fe.Touch(1.0, 1.0, 5.0))
    yield from one("1 kN", fe.Touch(*PLACE, 1e3))


def one(name: str, touch: fe.Touch, poisson: float = 0.38, **options: Any) -> Iterator[Figure]:
    """Solve one state of the plate of 1 mm."""
    plate = fe.Plate(OBLONG, 1.0, YOUNG, poisson, **options)
    cells = stability(solve(plate, [touch], mesh=fe.grid(plate, HALF)))
    return line("Shell: extremes, plate of 1 mm", name, **cells)


def meshes() -> Iterator[Figure]:
    """Error against time of one load from rest: w against a mesh fine there, strain against 80."""
    for force in (1.0, 5.0):
        touch = fe.Touch(*PLACE, force)
        truth = solve(PVC, [touch], mesh=fe.grid(PVC, TRUTH))
        sharp = solve(PVC, [touch], mesh=sharp_at(PVC))
        ratio = -sharp.deflection([PLACE])[0] / PVC.thickness
        for count in MESHES:
            shell = Shell(PVC, fe.grid(PVC, count))
            state = shell.undeformed.touch([touch])
            taken = cpu_times(lambda s=shell, t=touch: s.undeformed.touch([t]), REPEATS)
            yield from line(
                f"Shell by mesh, {force:g} N, w/h {ratio:.2f}",
                f"{count} × {count}",
                time=(float(np.median(taken)), "CPU s"),
                error=(ring_off(state, truth), "of the ring's strain"),
                w_off=(under(state, sharp), "relative"),
                **stability(state),
            )


PARTS = {
    "rods": rods,
    "bases": bases,
    "strips": strips,
    "thickness": thickness,
    "extremes": extremes,
    "meshes": meshes,
}

if __name__ == "__main__":
    run(PARTS, __doc__)
