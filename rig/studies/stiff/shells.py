"""Plates beyond linear theory at the ends of their ranges; `table` runs them."""

from collections.abc import Iterator

import fe
from fe import Base, Shell, Verdict
from fe.elements.mesh import borders
from rig.report.figure import Figure, at_most
from rig.studies.plates.elastica import elastica
from rig.studies.plates.rod import STRIP_SIZE, pressed_shell, strip
from rig.studies.stiff.case import NOT_WRONG, case
from rig.studies.stiff.plates import known

SIZE, YOUNG = (254.0, 200.0), 3000.0
TWO = fe.Edges(fe.Clamped(), fe.Clamped(), fe.Free(), fe.Free())
RESIDUAL = at_most(1e-6)


def shells() -> Iterator[Figure]:
    """Try strips and films, patches, bases near their limit, arches that snap, reduced plates."""
    for thinness in (1e-2, 1e-3, 1e-4, 1e-5, 1e-6):
        yield from thin_strip(thinness)
    for bend in (5.0, 20.0, 40.0):
        yield from bent_strip(bend)
    for contrast in (1e-12, 1e9, 1e12):
        yield from patched(contrast)
    yield from film()
    yield from bases()
    yield from trusted()


def thin_strip(thinness: float) -> Iterator[Figure]:
    """Supported strip under even pressure, from plate to membrane: closed form."""
    pressure, truth = strip(thinness * STRIP_SIZE[0])
    state = pressed_shell(thinness * STRIP_SIZE[0], pressure)
    w = state.deflection([[STRIP_SIZE[0] / 2, STRIP_SIZE[1] / 2]])[0]
    name = f"shell, strip under pressure, thickness/length {thinness:.0e}"
    return known(name, steps(state), w / truth - 1, state.stability.verdict.value)


def bent_strip(bend: float) -> Iterator[Figure]:
    """Strip between clamps that come nearer: Euler's elastica, to what 24 elements give."""
    thin = fe.Plate((100.0, 60.0), 0.2, YOUNG, 0.0, TWO)
    state = Shell(thin, fe.Mesh(thin.size, (24, 8))).at(Base(bend))
    w = state.displacement([[50.0, 30.0]], face="middle")[0, 2]
    error = abs(w / elastica(100.0, bend) - 1)
    name, said = f"shell, clamps nearer by {bend:g} % of its length", state.stability.verdict.value
    return case(name, steps(state), float(error), "relative error", at_most(1e-3), said=said)


def patched(contrast: float) -> Iterator[Figure]:
    """Patch far softer or stiffer than the rest: in equilibrium, or said not to be."""
    patch = fe.Patch((60.0, 130.0), (40.0, 90.0), 1.0, YOUNG * contrast)
    plate = fe.Plate(SIZE, 1.0, YOUNG, 0.38, patches=(patch,))
    return settled(f"shell, patch {contrast:.0e} times as stiff", plate, fe.Touch(200.0, 90.0, 2.0))


def film() -> Iterator[Figure]:
    """Film with free edges: its wrinkles are finer than the mesh."""
    plate = fe.Plate(SIZE, 1e-5 * SIZE[1], YOUNG, 0.38, TWO)
    pull = 1e-6 * YOUNG * plate.thickness * SIZE[1]
    return settled("shell, film with two free edges", plate, fe.Touch(100.0, 90.0, pull))


def settled(name: str, plate: fe.Plate, touch: fe.Touch) -> Iterator[Figure]:
    """Make a case of which the residual is known."""
    state = fe.solve(plate, [touch], mesh=fe.grid(plate, 12))
    residual, verdict = state.stability.residual, state.stability.verdict
    doubted = verdict is Verdict.NOT_CONVERGED
    if not doubted:
        return case(name, steps(state), residual, "residual", RESIDUAL, said=verdict.value)
    bar, unit = NOT_WRONG
    wrong = int(RESIDUAL.met_by(residual))
    seen = f"residual {residual:.0e}"
    return case(name, steps(state), wrong, unit, bar, seen=seen, said=verdict.value)


def bases() -> Iterator[Figure]:
    """Bend and twist a plate to its limit; press an arch until it snaps."""
    plate = fe.Plate((100.0, 100.0), 1.0, YOUNG, 0.3, TWO)
    shell = Shell(plate, fe.grid(plate, 12))
    arch = shell.at(Base(2.0))
    for name, state, wanted in (
        ("bent by 2 mm", arch, Verdict.STABLE),
        ("bent by 10 mm, twisted by 30°", shell.at(Base(10.0, 30.0)), Verdict.NEAR_LIMIT),
        ("arch under 32 N", arch.touch([fe.Touch(50.0, 50.0, 32.0)]), Verdict.STABLE),
        (
            "arch under 60 N: snapped",
            arch.touch([fe.Touch(50.0, 50.0, 60.0)]),
            Verdict.OTHER_BRANCH,
        ),
    ):
        found = state.stability
        reason, seen = f"least eigenvalue {found.eigenvalue:.2g}", f"residual {found.residual:.0e}"
        bar, unit = NOT_WRONG
        wrong, said = int(found.verdict is not wanted), found.verdict.value
        yield from case(f"shell, {name}", reason, wrong, unit, bar, seen=seen, said=said)


def trusted() -> Iterator[Figure]:
    """Press a reduced plate within and beyond the forces that it was made for."""
    plate = fe.Plate((90.0, 70.0), 1.0, YOUNG, 0.3)
    mesh = fe.Mesh(plate.size, (24, 18), borders(plate))
    reduced = fe.reduced_plate(plate, mesh, force=10.0)
    for force, wanted in (
        (10.0, fe.Trust.TRAINED),
        (100.0, fe.Trust.BEYOND),
        (1e9, fe.Trust.NOT_CONVERGED),
    ):
        touch = fe.Touch(30.0, 40.0, force)
        state = reduced.solve([touch])
        seen = ""
        if state.converged:
            w = fe.solve(plate, [touch], mesh=mesh).deflection([[30.0, 40.0]])[0]
            seen = f"w off by {abs(state.deflection([[30.0, 40.0]])[0] / w - 1):.1e}"
        name, said = f"reduced plate made for 10 N, {force:g} N", state.result.value
        (bar, unit), wrong = NOT_WRONG, int(state.result is not wanted)
        yield from case(name, "forces learnt", wrong, unit, bar, seen=seen, said=said)


def steps(state: fe.ShellState) -> str:
    """How often Newton's method had to step."""
    return f"{state.stability.iterations} Newton iterations"
