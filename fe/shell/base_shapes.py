"""All shapes that a bent and twisted plate was found to rest in."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from fe.arrays import F64
from fe.elements.mesh import Mesh, even_grid
from fe.elements.refinement import refined
from fe.plate.plate import Plate
from fe.shell.base import Base, bow, check_base
from fe.shell.meshes import shell_mesh
from fe.shell.shell import Shell
from fe.shell.state import ShellState

# Elements a side on which shapes are looked for, before a finer mesh takes them over.
_COARSE = 16
# Of two shapes, in parts of the largest displacement: 1e-5 is what is left of one found twice.
_SAME = 1e-3
# A side that is higher than the other one by this part of the largest deflection has a name.
_LEANS = 0.01
# Bows are sought as if the clamps came nearer by this part of the length at least, mm/mm.
_FEWEST = 2e-3
HALF_TURNS = (0, 1, 2)
"""Axes of the half turns that keep bend and twist: along x, y and z through the middle."""


@dataclass(frozen=True, eq=False)
class BaseShape:
    """One of the shapes that a plate can rest in between its clamps.

    Attributes
    ----------
    state : ShellState
        Untouched, in a stable equilibrium.
    energy : float, N mm
        Elastic energy. Shapes of equal energy are as likely as one another.
    name : str
        Which one it is: "up" bows to the touched side, and a side that stands higher is named.
    """

    state: ShellState
    energy: float
    name: str


def base_shapes(plate: Plate, base: Base, mesh: Mesh | None = None) -> tuple[BaseShape, ...]:
    """List the stable shapes of a plate whose clamps have moved.

    Newton's method descends from bows to both sides, with a twist also from ones that lean to a
    free edge, and from the half turns of what was found, which keep bend and twist. A plate that
    is held alike on opposite edges therefore rests in one, two or four shapes of equal energy.
    Shapes that none of these starts leads to are not found.

    Parameters
    ----------
    plate : Plate
    base : Base
    mesh : Mesh, optional
        `shell_mesh(plate)` if left out.

    Returns
    -------
    tuple of BaseShape
        By energy; of equal energy the one that bows up most comes first.

    Raises
    ------
    ValueError
        The plate cannot take the base, or no equilibrium was found.
    """
    check_base(plate, base)
    shell = Shell(plate, mesh or shell_mesh(plate))
    coarse = Shell(plate, even_grid(plate, _COARSE))
    if base.flat or coarse.mesh.counts[0] >= shell.mesh.counts[0]:
        coarse = shell
    found = _settled(coarse, base, _bows(coarse, base))
    found = _settled(coarse, base, _turned_of(found), found)
    if coarse is not shell:
        finer = (refined(coarse.mesh, state.values, shell.mesh) for state in found)
        found = _settled(shell, base, finer)
    if not found:
        raise ValueError(
            f"base of {base.bend:g} mm and {base.twist:g} degrees has no equilibrium that was"
            " found; bend or twist the plate less"
        )
    shapes = [BaseShape(state, state.energy, shape_name(state)) for state in found]
    lowest = min(shape.energy for shape in shapes)
    # Energies of shapes that are turns of one another differ by rounding.
    return tuple(
        sorted(shapes, key=lambda s: (round(s.energy / max(lowest, 1e-12), 6), -_mean(s.state)))
    )


def half_turned(values: F64, axis: int) -> F64:
    """Turn a displacement by half a turn about an axis through the middle of the plate.

    Parameters
    ----------
    values : (2 nx + 2, 2 ny + 2, 3) float64, mm
        Unknowns on a mesh that is the same from both ends.
    axis : {0, 1, 2}
        Along x, y or z.
    """
    turned = values.copy()
    sign = -np.ones(3)
    sign[axis] = 1.0
    for direction in (0, 1):
        if direction != axis:
            turned = _reversed(turned, direction)
    return turned * sign


def mirrored(values: F64) -> F64:
    """Mirror a displacement at the middle between south and north: the twist changes its sign."""
    return _reversed(values, 1) * np.array([1.0, -1.0, 1.0])


def shape_name(state: ShellState) -> str:
    """Say which shape a state is."""
    a, b = state.plate.size
    west, east, south, north = state.deflection(
        [[0.25 * a, 0.5 * b], [0.75 * a, 0.5 * b], [0.5 * a, 0.0], [0.5 * a, b]]
    )
    largest = np.abs(state.values[0::2, 0::2, 2]).max()
    mean = _mean(state)
    bowed = "up" if mean > 0 else "down"
    said = "level" if abs(mean) <= _LEANS * largest else bowed
    sides = [("south", south - north), ("north", north - south)]
    sides += [("west", west - east), ("east", east - west)]
    higher = [name for name, rise in sides if rise > _LEANS * largest]
    return f"{said}, higher in the {' and '.join(higher)}" if higher else said


def _mean(state: ShellState) -> float:
    return float(state.values[0::2, 0::2, 2].mean())


def _reversed(values: F64, direction: int) -> F64:
    """Run through the nodes of one direction from the other end; slopes along it change sign."""
    swapped = np.moveaxis(values, direction, 0)
    out = np.empty_like(swapped)
    out[0::2], out[1::2] = swapped[-2::-2], -swapped[-1::-2]
    return np.moveaxis(out, 0, direction)


def _bows(shell: Shell, base: Base) -> Iterator[F64]:
    """Give what `Shell.at` finds, and bows to both sides; where they are twisted also leaning."""
    yield shell.at(base).values
    a = shell.plate.size[0]
    even = bow(shell.plate, shell.mesh, max(base.bend, _FEWEST * a))
    across = np.linspace(-1.0, 1.0, even.shape[1] // 2)
    for side in (1.0, -1.0):
        for lean in (0.0, 0.5, -0.5) if base.twist else (0.0,):
            start = even.copy()
            start[:, 0::2, 2] *= side * (1.0 - abs(lean) + lean * across)
            yield start


def _turned_of(found: Sequence[ShellState]) -> Iterator[F64]:
    for state in found:
        for axis in HALF_TURNS:
            yield half_turned(state.values, axis)


def _settled(
    shell: Shell, base: Base, starts: Iterator[F64], known: Sequence[ShellState] = ()
) -> list[ShellState]:
    """Give the known states and those that starts lead to, each once."""
    found = list(known)
    for start in starts:
        state = shell.settled(base, start)
        if state.stability.converged and not any(_same(state, other) for other in found):
            found.append(state)
    return found


def _same(one: ShellState, other: ShellState) -> bool:
    largest = max(np.abs(one.values).max(), one.plate.thickness)
    return bool(np.abs(one.values - other.values)[0::2, 0::2].max() <= _SAME * largest)
