"""Narrow shells and the rods that they are: end shear, end moment, pressure."""

from typing import Any, cast

import numpy as np
from scipy.integrate import quad, solve_bvp

import fe
from fe import Shell, hermite_gram
from fe.shell.newton import equilibrium
from fe.shell.problem import Problem
from fe.shell.support import UNMOVED, Motion, Support, support
from rig.system.arrays import F64

WIDTH, HEIGHT, YOUNG = 1.0, 0.1, 1.2e6
STIFFNESS = YOUNG * WIDTH * HEIGHT**3 / 12
SHEAR_LENGTH, SHEAR = 10.0, 4.0
RING_LENGTH = 12.0
STRIP_SIZE, STRIP_YOUNG, STRIP_STRAIN = (100.0, 10.0), 3000.0, 3e-6
FREE = fe.Free()


def sheared_rod() -> tuple[float, float]:
    """End displacement (u, w) of a clamped rod under a dead end force along z.

    It stretches by λ and turns by θ, with energy EA (λ² - 1)² / 8 + EI (λ θ')² / 2 per length.
    """
    axial = YOUNG * WIDTH * HEIGHT

    def slopes(s: F64, state: F64) -> F64:
        angle, moment = state[2], state[3]
        # Along the rod acts EA (λ² - 1) λ / 2 + EI λ θ'², with the moment EI λ² θ'.
        stretch = np.ones_like(angle)
        for _ in range(20):
            bent = moment**2 / (STIFFNESS * stretch**3)
            green = (SHEAR * np.sin(angle) - bent) / (axial * stretch)
            stretch = np.sqrt(1 + 2 * green)
        along, up = stretch * np.cos(angle), stretch * np.sin(angle)
        return np.stack([along, up, moment / (STIFFNESS * stretch**2), -SHEAR * along])

    def ends(left: F64, right: F64) -> F64:
        return np.array([left[0], left[1], left[2], right[3]])

    s = np.linspace(0, SHEAR_LENGTH, 101)
    guess = np.stack([s, 0 * s, 0 * s, SHEAR * (SHEAR_LENGTH - s) / 10])
    solution = solve_bvp(slopes, ends, s, guess, tol=1e-10, max_nodes=20000)
    if not solution.success:
        raise ArithmeticError(f"the rod was not solved: {solution.message}")
    return float(solution.y[0, -1]) - SHEAR_LENGTH, float(solution.y[1, -1])


def sheared_shell() -> tuple[fe.ShellState, F64]:
    """State of the cantilever as a shell, and the displacement of its end."""
    size = (SHEAR_LENGTH, WIDTH)
    plate = fe.Plate(size, HEIGHT, YOUNG, 0.0, fe.Edges(fe.Clamped(), FREE, FREE, FREE))
    shell = Shell(plate, fe.Mesh(size, (24, 6)))
    loads = np.zeros((*shell.mesh.shape, 3))
    loads[-2, :, 2] = SHEAR / WIDTH * _even(shell.mesh.lines[1])
    state = shell.undeformed.load(loads)
    return state, state.displacement([[SHEAR_LENGTH, WIDTH / 2]], face="middle")[0]


def ring() -> tuple[F64, float]:
    """Displacement (7, 3) of the end of a cantilever turned by a full circle, and its moment."""
    turned = fe.Elastic(deflection=0.0, rotation=np.inf, membrane=0.0)
    edges = fe.Edges(fe.Clamped(), turned, FREE, FREE)
    plate = fe.Plate((RING_LENGTH, WIDTH), HEIGHT, YOUNG, 0.0, edges)
    shell = Shell(plate, fe.Mesh(plate.size, (30, 6)))
    values = shell.undeformed.values.ravel()
    for angle in np.linspace(0, 2 * np.pi, 9)[1:]:
        held = _in_the_plane(support(plate, shell.mesh, UNMOVED, _about_y(angle)))
        found = equilibrium(
            Problem(shell.system, held, np.zeros(len(values)), shell.reference_eigenvalue), values
        )
        if not found.converged:
            raise ArithmeticError(f"the ring did not close at {np.degrees(angle):.0f}°")
        values = found.values
    moment = 2 * shell.system.forces(values)[0] / (2 * np.pi)
    return shell.system.table(values)[-2, 0::2], moment


def _about_y(angle: float) -> Motion:
    c, s = np.cos(angle), np.sin(angle)
    return Motion(np.array([[c, 0, -s], [0, 1, 0], [s, 0, c]]), np.zeros(3))


def _in_the_plane(held: Support) -> Support:
    """Hold the displacement along y as well: a ring that may leave its plane does so."""
    along_y = np.arange(held.free.shape[0]) % 3 == 1
    moving = abs(held.free[along_y]).sum(axis=0) == 0
    return Support(held.lift, held.free[:, moving])


def strip(thickness: float) -> tuple[float, float]:
    """Pressure (MPa) that stretches a supported strip by STRIP_STRAIN, and its deflection (mm).

    D w'''' - S w'' = q with the tension S from the mean of w'² / 2: Timoshenko &
    Woinowsky-Krieger (1959), chapter 1.
    """
    tension, half = STRIP_YOUNG * thickness * STRIP_STRAIN, STRIP_SIZE[0] / 2
    k = np.sqrt(12 * STRIP_STRAIN) / thickness

    def slope(x: float) -> float:  # times S / q; sinh(kx) / cosh(kl) without large numbers
        rise = np.exp(k * (x - half)) - np.exp(-k * (x + half))
        return x - rise / (k * (1 + np.exp(-2 * k * half)))

    parts: dict[str, Any] = {"points": [max(0.0, half - 5 / k)], "limit": 200, "epsrel": 1e-11}

    def square(x: float) -> float:
        return 0.5 * slope(x) ** 2

    mean = cast(float, quad(square, 0, half, **parts)[0]) / half
    pressure = tension * np.sqrt(STRIP_STRAIN / mean)
    return float(pressure), float(pressure) / tension * cast(
        float, quad(slope, 0, half, **parts)[0]
    )


def pressed_shell(thickness: float, pressure: float) -> fe.ShellState:
    """State of the strip as a shell."""
    sides = fe.Edges(fe.Supported(), fe.Supported(), FREE, FREE)
    plate = fe.Plate(STRIP_SIZE, thickness, STRIP_YOUNG, 0.0, sides)
    shell = Shell(plate, fe.Mesh(STRIP_SIZE, (40, 6)))
    loads = np.zeros((*shell.mesh.shape, 3))
    loads[:, :, 2] = pressure * np.outer(*(_even(line) for line in shell.mesh.lines))
    return shell.undeformed.load(loads)


def _even(line: Any) -> F64:
    """Work of an even load of 1 per length on the unknowns of a line."""
    return hermite_gram(line, 0, 0) @ np.tile([1.0, 0.0], line.unknowns // 2)
