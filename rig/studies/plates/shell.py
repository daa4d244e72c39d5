"""Print what the shell is held to: rods, bent bases, thickness to the end, and error against time.

Usage: ``python benchmarks/shell_bars.py [rods bases strips thickness extremes meshes]``, those
sections or all of them; `thickness` and `meshes` take many minutes each, the others a minute or
less. Every state prints its verdict, relative residual, Newton iterations and smallest eigenvalue
in parts of the flat plate's. CPU time is of one thread.
"""

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import sys
import time

import numpy as np

import fe
from fe.linear.linear import Face
from fe.shell import Base, Shell, ShellState, shell_mesh, solve
from rig.studies.plates.rod import (
    RING_LENGTH,
    STRIP_SIZE,
    pressed_shell,
    ring,
    sheared_rod,
    sheared_shell,
    strip as long_strip,
)

TWO = fe.Edges(fe.Clamped(), fe.Clamped(), fe.Free(), fe.Free())
PAPER = fe.Plate((100.0, 100.0), 1.0, 3000.0, 0.3, TWO)
BASES = (Base(5.0, 15.0), Base(10.0, 30.0), Base(20.0, 45.0))
OBLONG, YOUNG = (254.0, 200.0), 3000.0
PLACE = (100.0, 90.0)
THINNESS = (1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6)
FINER, HALF = 60, 20  # elements along the longer side: a finer mesh and a coarser one
PVC = fe.Plate((254.0, 254.0), 1.0, YOUNG, 0.38)
MESHES, TRUTH = (12, 20, 40, 60), 80
REPEATS = 3


def said(state: ShellState) -> str:
    """Stability of a state in one line."""
    s = state.stability
    return (
        f"{s.verdict.name:13s} residual {s.residual:7.1e}  {s.iterations:3d} iterations  "
        f"eigenvalue {s.eigenvalue:9.3g}  {s.escapes:2d} escapes"
    )


def rods() -> None:
    """Cantilevers against an independent rod."""
    (u, w), (state, end) = sheared_rod(), sheared_shell()
    off = max(abs(end[0] / u - 1), abs(end[2] / w - 1))
    print(f"end shear, -U {-end[0]:.6f} W {end[2]:.6f}: off {off:.1e}, bar 1e-4; {said(state)}")
    place, moment = ring()
    gap = np.abs(place - np.array([-RING_LENGTH, 0.0, 0.0])).max() / RING_LENGTH
    off = abs(moment / (50 * np.pi / 3) - 1)
    print(f"end moment, full circle: gap {gap:.1e} of the length, moment off {off:.1e}, bar 1e-3")


def bases() -> None:
    """Plate of the paper on its bent bases, and a small touch there."""
    shell = Shell(PAPER, shell_mesh(PAPER))
    print(f"{PAPER.size} mm, 1 mm thick, mesh {shell.mesh.counts}")
    for base in BASES:
        began = time.process_time()
        state = shell.at(base)
        spent, began = time.process_time() - began, time.process_time()
        touched = state.touch([fe.Touch(40.0, 30.0, 0.05)])
        print(f"bend {base.bend:g} mm, twist {base.twist:g}°: {said(state)}  {spent:.1f} CPU s")
        again = time.process_time() - began
        print(f"    and 0.05 N at (40, 30) mm: {said(touched)}  {again:.1f} CPU s", flush=True)


def strips() -> None:
    """Supported strip under even pressure against its closed form, from plate to membrane."""
    for thinness in THINNESS[1:]:
        thickness = thinness * STRIP_SIZE[0]
        pressure, truth = long_strip(thickness)
        state = pressed_shell(thickness, pressure)
        off = state.deflection([[STRIP_SIZE[0] / 2, STRIP_SIZE[1] / 2]])[0] / truth - 1
        print(f"thickness/length {thinness:.0e}: w off {off:8.1e}; {said(state)}", flush=True)


def thickness() -> None:
    """Plates under one force in parts of their stretching stiffness, default mesh against others.

    Thick ones bend as in linear theory, thin ones stretch as a membrane whatever their thickness.
    The deflection under the touch is held against a mesh fine there, the strain of a ring against
    one of 60 elements along the longer side.
    """
    for name, edges in (("four edges clamped", fe.Clamped()), ("two clamped, two free", TWO)):
        print(f"{OBLONG} mm, {name}")
        for thinness in THINNESS:
            plate = fe.Plate(OBLONG, thinness * OBLONG[1], YOUNG, 0.38, edges)
            touch = fe.Touch(*PLACE, 1e-6 * YOUNG * plate.thickness * OBLONG[1])
            # Wrinkles of free edges take long and are finer than any of these meshes.
            film = edges is TWO and thinness < 2e-4
            began = time.process_time()
            state = solve(plate, [touch], mesh=fe.grid(plate, HALF) if film else None)
            spent = time.process_time() - began
            print(f"thickness/side {thinness:.0e}: {said(state)}  {spent:4.1f} CPU s", flush=True)
            if not film:
                beside_finer(state, touch)


def beside_finer(state: ShellState, touch: fe.Touch) -> None:
    """Print the digits of a state, for a point and for a disc of 8 mm."""
    plate = state.plate
    fine = solve(plate, [touch], mesh=fe.grid(plate, FINER))
    disc = fe.Touch(*PLACE, touch.force, radius=8.0)
    sharp, sharp_disc = (solve(plate, [each], mesh=sharp_at(plate)) for each in (touch, disc))
    if not all(each.stability.converged for each in (fine, sharp, sharp_disc)):
        print("    the finer meshes found no equilibrium: digits not known")
        return
    of_disc = under(solve(plate, [disc]), sharp_disc)
    linear = fe.deflect(plate, [touch]).deflection([PLACE])[0]
    w = sharp.deflection([PLACE])[0]
    faces = ", ".join(f"{face} {ring_off(state, fine, face):.1e}" for face in ("top", "middle"))
    print(
        f"    w {w:.2e} mm, {w / linear:.1e} of linear; w off: point {under(state, sharp):.1e}, "
        f"disc {of_disc:.1e}; ring strain off: {faces}; finer meshes took "
        f"{fine.stability.iterations}, {sharp.stability.iterations} iterations",
        flush=True,
    )


def sharp_at(plate: fe.Plate) -> fe.Mesh:
    """Mesh with elements of 0.2 mm at the touch that grow outwards, 54 x 54."""
    away = np.array([0.6, 3.0, 12.0, 40.0])
    breaks = [(*(at - away[::-1]), *(at + away)) for at in PLACE]
    return fe.Mesh(plate.size, (54, 54), (breaks[0], breaks[1]))


def ring_of(plate: fe.Plate) -> np.ndarray:
    """Places (24, 2) of gauges on a ring 10 mm inside the edges, mm."""
    a, b = plate.size
    along = np.linspace(0.1, 0.9, 6)
    x, y = 10 + along * (a - 20), 10 + along * (b - 20)
    ends = np.full(6, 10.0)
    sides = [(x, ends), (x, b - ends), (ends, y), (a - ends, y)]
    return np.concatenate([np.column_stack(side) for side in sides])


def under(state: ShellState, sharp: ShellState) -> float:
    """Relative error of the deflection under the touch."""
    return abs(state.deflection([PLACE])[0] / sharp.deflection([PLACE])[0] - 1)


def ring_off(state: ShellState, fine: ShellState, face: Face = "top") -> float:
    """Worst ring strain against a finer mesh, in parts of the largest there."""
    gauges = ring_of(state.plate)
    found, truth = state.strain(gauges, face), fine.strain(gauges, face)
    return float(np.abs(found - truth).max() / np.abs(truth).max())


def extremes() -> None:
    """Contrast, springs, Poisson's ratio, and touches near edges, on a coarse mesh."""
    middle = fe.Touch(200.0, 90.0, 2.0)
    for contrast in (1e-12, 1e-6, 1e6, 1e9, 1e10, 1e12):
        patch = fe.Patch((60.0, 130.0), (40.0, 90.0), 1.0, YOUNG * contrast)
        one(f"patch {contrast:.0e} times as stiff", middle, patches=(patch,))
    for spring in (1e-6, 1e-3, 1.0, 1e6, 1e15):
        one(f"springs {spring:.0e}", middle, edges=fe.Elastic(spring, spring, spring))
    one("Poisson's ratio 0.499", middle, poisson=0.499)
    one("touch 1 mm from an edge", fe.Touch(1.0, 90.0, 5.0))
    one("touch 1 mm from a corner", fe.Touch(1.0, 1.0, 5.0))
    one("1 kN", fe.Touch(*PLACE, 1e3))


def one(name: str, touch: fe.Touch, poisson: float = 0.38, **options) -> None:
    """Print one state of the plate of 1 mm."""
    plate = fe.Plate(OBLONG, 1.0, YOUNG, poisson, **options)
    print(f"{name:28s} {said(solve(plate, [touch], mesh=fe.grid(plate, HALF)))}", flush=True)


def meshes() -> None:
    """Error against time of one load from rest: w against a mesh fine there, strain against 80."""
    for force in (1.0, 5.0):
        touch = fe.Touch(*PLACE, force)
        truth = solve(PVC, [touch], mesh=fe.grid(PVC, TRUTH))
        sharp = solve(PVC, [touch], mesh=sharp_at(PVC))
        ratio = -sharp.deflection([PLACE])[0] / PVC.thickness
        print(f"{PVC.size} mm, 1 mm thick, {force:g} N, w/h {ratio:.2f}")
        for count in MESHES:
            shell = Shell(PVC, fe.grid(PVC, count))
            shell.rest.touch([fe.Touch(*PLACE, 1e-3)])  # patterns and kernels are ready then
            times = []
            for _ in range(REPEATS):
                began = time.process_time()
                state = shell.rest.touch([touch])
                times.append(time.process_time() - began)
            print(
                f"{count:3d} x {count:<3d} w off {under(state, sharp):.1e}, "
                f"ring strain {ring_off(state, truth):.1e}, "
                f"{np.median(times):6.2f} CPU s, spread {np.ptp(times):.2f}; {said(state)}",
                flush=True,
            )


SECTIONS = {each.__name__: each for each in (rods, bases, strips, thickness, extremes, meshes)}

if __name__ == "__main__":
    for wanted in sys.argv[1:] or SECTIONS:
        print(f"\n{wanted}: {(SECTIONS[wanted].__doc__ or '').splitlines()[0]}", flush=True)
        SECTIONS[wanted]()
