"""The large deformation of a plate: its base, then touches."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import nan

import numpy as np

from fe.arrays import F64
from fe.elements.band import cholesky
from fe.elements.mesh import Mesh, even_grid, mesh_for
from fe.elements.refinement import refined
from fe.linear.buckling import check_buckling
from fe.linear.demand import strain_demand
from fe.linear.load import check_touches
from fe.linear.mesh_error import less_mesh
from fe.plate.loads import Load
from fe.plate.plate import Plate, Touch
from fe.plate.thin import check_thin
from fe.shell.base import Base, bow, check_base
from fe.shell.extended import refine
from fe.shell.meshes import pressed_mesh
from fe.shell.newton import Equilibrium, equilibrium
from fe.shell.problem import Problem
from fe.shell.stability import Stability, Verdict, judge, smallest
from fe.shell.state import ShellState
from fe.shell.support import Support, support
from fe.shell.system import System

# Elements along the side of a square on which a base is bent before a finer mesh takes over.
_COARSE = 20

# Patches stiffer than 1e12 times the rest round off so much that the digits run out.
_MAX_RESIDUAL = 1e-6

# A path is followed in steps halved down to this part of it.
_FINEST_STEP = 1 / 32


@dataclass(frozen=True, eq=False)
class Shell:
    """A plate ready for large deformation on one mesh.

    Attributes
    ----------
    plate : Plate
    mesh : Mesh
        Of the size of the plate.
    """

    plate: Plate
    mesh: Mesh

    def __post_init__(self) -> None:
        mesh_for(self.plate, self.mesh)
        check_thin(self.plate)
        _check_held_in_plane(self.plate)

    @cached_property
    def system(self) -> System:
        """Its energy."""
        return System(self.plate, self.mesh)

    @cached_property
    def coarser(self) -> Shell:
        """The same plate on fewer elements, which errors of the mesh are estimated from."""
        return Shell(self.plate, less_mesh(self.mesh))

    @cached_property
    def undeformed(self) -> ShellState:
        """The plate at rest."""
        zero = np.zeros((*self.mesh.shape, 3))
        stability = Stability(judge(True, 1.0, 0, 0.0), 0.0, 0, 1.0, 0)
        return ShellState(self, Base(), zero, zero, stability)

    @cached_property
    def reference_eigenvalue(self) -> float:
        """Smallest eigenvalue of the plate at rest, N/mm³.

        Raises
        ------
        ValueError
            The plate buckles under its tension, or springs or patches are so soft that the plate
            is not held but for rounding.
        """
        free = self.support(Base()).free
        tangent = free.T @ self.system.tangent(self.undeformed.values.ravel()) @ free
        factor = cholesky(tangent)
        if factor is None:
            check_buckling(self.plate)
            raise ValueError(
                "stiffness of the plate must hold it by more than rounding, got springs of "
                f"{self.plate.sides} edges or patches too soft for it; hold the edges more firmly"
            )
        return smallest(tangent, free.T @ self.system.mass @ free, factor).value

    def at(self, base: Base) -> ShellState:
        """Bend and twist the plate by its clamps.

        Raises
        ------
        ValueError
            West and east are not clamped, south or north is held, or the bend folds the plate.
        """
        check_base(self.plate, base)
        if base.flat:
            return self.undeformed
        coarse = Shell(self.plate, even_grid(self.plate, _COARSE))
        if coarse.mesh.counts[0] >= self.mesh.counts[0]:
            return self._bent(base)
        shape = coarse._bent(base)
        start = refined(coarse.mesh, shape.values, self.mesh).ravel()
        found = equilibrium(self._problem(base, np.zeros_like(start)), start)
        return self._state(base, found, self.undeformed.loads, shape.stability)

    def settled(self, base: Base, start: F64) -> ShellState:
        """Descend to a stable shape from a displacement that is a guess.

        Parameters
        ----------
        base : Base
        start : (2 nx + 2, 2 ny + 2, 3) float64, mm
            It need not obey the clamps.
        """
        nothing = np.zeros(self.undeformed.values.size)
        found = equilibrium(self._problem(base, nothing), start.ravel())
        # What a guess passes on its way is no branch that was followed.
        found = replace(found, escapes=0)
        return self._state(base, found, self.undeformed.loads, self.undeformed.stability)

    def taken_over(self, state: ShellState) -> ShellState:
        """Bring the untouched shape of a state on fewer elements to rest on these."""
        start = refined(state.mesh, state.values, self.mesh)
        return self.settled(state.base, start)

    def moved(self, state: ShellState, base: Base) -> ShellState:
        """Follow an untouched state while its clamps move on to another base.

        Raises
        ------
        ValueError
            West and east are not clamped, south or north is held, or the bend folds the plate.
        """
        check_base(self.plate, base)
        nothing = np.zeros(self.undeformed.values.size)

        def problem(fraction: float) -> Problem:
            bend = (1.0 - fraction) * state.base.bend + fraction * base.bend
            twist = (1.0 - fraction) * state.base.twist + fraction * base.twist
            return self._problem(Base(bend, twist), nothing)

        found = _follow(problem, state.values.ravel())
        return self._state(base, found, self.undeformed.loads, self.undeformed.stability)

    def loaded(
        self,
        state: ShellState,
        further: F64,
        touches: tuple[Touch, ...] = (),
        applied: tuple[Load, ...] = (),
    ) -> ShellState:
        """State under further dead loads (2 nx + 2, 2 ny + 2, 3) N, see `ShellState.load`.

        `touches` and `applied` are those that the loads stand for, as far as they do.
        """
        before, loads = state.loads.ravel(), state.loads + further
        held = self.support(state.base)

        def problem(fraction: float) -> Problem:
            load = before + fraction * further.ravel()
            return Problem(self.system, held, load, self.reference_eigenvalue)

        found = _follow(problem, state.values.ravel())
        known = (*state.touches, *touches), (*state.applied, *applied)
        reached = self._state(state.base, found, loads, state.stability, *known)
        unnamed = bool(further.any()) and not (touches or applied)
        return replace(reached, beside=state.beside or unnamed)

    def _bent(self, base: Base) -> ShellState:
        """Bend first, in one go from a shape that is nearly right, then twist step by step."""
        nothing = np.zeros(self.undeformed.values.size)
        start = bow(self.plate, self.mesh, base.bend).ravel() if base.bend else nothing
        bent = Base(base.bend, 0.0)
        first = equilibrium(self._problem(bent, nothing), start)
        state = self._state(bent, first, self.undeformed.loads, self.undeformed.stability)
        if base.twist == 0:
            return state

        def problem(fraction: float) -> Problem:
            return self._problem(Base(base.bend, fraction * base.twist), nothing)

        found = _follow(problem, first.values)
        return self._state(base, found, self.undeformed.loads, state.stability)

    def _problem(self, base: Base, load: F64) -> Problem:
        return Problem(self.system, self.support(base), load, self.reference_eigenvalue)

    def support(self, base: Base) -> Support:
        """Constrain the unknowns to what the edges hold when the clamps have moved."""
        return support(self.plate, self.mesh, *base.clamps(self.plate))

    def _state(
        self,
        base: Base,
        found: Equilibrium,
        loads: F64,
        before: Stability,
        touches: tuple[Touch, ...] = (),
        applied: tuple[Load, ...] = (),
    ) -> ShellState:
        """State of an equilibrium, with the iterations and escapes before it counted in."""
        problem, eigenvalue = self._problem(base, loads.ravel()), nan
        found, residual = _in_balance(problem, found)
        converged = found.converged and before.converged and residual <= _MAX_RESIDUAL
        if converged:
            free = problem.support.free
            tangent = free.T @ self.system.tangent(found.values) @ free
            mass = free.T @ self.system.mass @ free
            eigenvalue = smallest(tangent, mass, found.factor).known / self.reference_eigenvalue
        escapes = before.escapes + found.escapes
        iterations = before.iterations + found.iterations
        unjudged = Stability(Verdict.NOT_CONVERGED, residual, iterations, eigenvalue, escapes, nan)
        table = self.system.table(found.values)
        state = ShellState(self, base, table, loads, unjudged, touches, applied)
        if not converged:
            return state
        strained = strain_demand(state)
        verdict = judge(converged, eigenvalue, escapes, strained)
        return replace(state, stability=replace(unjudged, verdict=verdict, demand=strained))


def solve(
    plate: Plate,
    touches: Sequence[Touch],
    base: Base | None = None,
    mesh: Mesh | None = None,
    loads: Sequence[Load] = (),
) -> ShellState:
    """Bend a plate by its base, by touches and by other loads, however far.

    Parameters
    ----------
    plate : Plate
    touches : sequence of Touch
        Each presses against the normal of the base at its place.
    base : Base, optional
        Movement of the clamps before the touch; none if left out.
    mesh : Mesh, optional
        If left out one that is fine where the plate is touched or loaded, `shell_mesh(plate)` where
        nothing acts but a base or pressure. For many loads keep a `Shell` or the state of its base.
    loads : sequence of Load, optional
        Pressure, line loads, forces along the face and moments, which act after the touches and
        keep the direction that they have on the plate at rest.

    Returns
    -------
    ShellState
        Its `stability` says whether an equilibrium was found.

    Raises
    ------
    ValueError
        A touch or load lies outside the plate, the mesh has another size, or the plate cannot take
        the base.
    """
    # Refuses touches outside before the base takes its time.
    check_touches(plate, touches)
    if mesh is None:
        mesh = pressed_mesh(plate, touches, loads)
    shell = Shell(plate, mesh)
    state = shell.at(base or Base())
    if touches:
        state = state.touch(touches)
    return state.apply(loads) if loads else state


def _check_held_in_plane(plate: Plate) -> None:
    edges = plate.sides
    if not any(edge.springs.membrane > 0 for axis in (0, 1) for edge in edges.along(axis)):
        raise ValueError(
            f"plate edges must hold a plate that bends far in its plane too, got {edges}; "
            "clamp or support one or give an elastic one a membrane spring"
        )


def _in_balance(problem: Problem, found: Equilibrium) -> tuple[Equilibrium, float]:
    """Refine an equilibrium where double precision leaves too much; and what is left over."""
    residual = problem.residual(found.values)
    if not found.converged or residual <= _MAX_RESIDUAL:
        return found, residual
    values, residual = refine(problem, found.values, found.factor)
    return replace(found, values=values), residual


def _follow(problem: Callable[[float], Problem], start: F64) -> Equilibrium:
    """Follow equilibria of a path, fraction 0 to 1, from one at its start.

    A step in which the tangent stays positive keeps to the branch; others are halved. The
    shortest ones are taken all the same, and go down to the branch that is stable there.
    """
    fraction, step, iterations, escapes = 0.0, 1.0, 0, 0
    while True:
        last = step <= _FINEST_STEP
        found = equilibrium(problem(fraction + step), start, bold=last)
        iterations += found.iterations
        # The others gave up where they would have left the branch.
        escapes += found.escapes if last else 0
        if found.converged:
            start, fraction = found.values, fraction + step
            step = min(2.0 * step, 1.0 - fraction)
        elif last:
            break
        else:
            step /= 2.0
        if fraction >= 1.0:
            break
    return replace(found, iterations=iterations, escapes=escapes)
