"""Equilibrium of the shell by Newton's method, down to a stable one.

Two things carry it. The tangent takes its membrane forces from the step before, linear in that
step, and not from the place reached: full steps then converge however thin the plate is (the
mixed form of Magisano, Leonetti & Garcea, 2017, doi 10.1016/j.cma.2016.10.023). And a step is
searched for a lower potential where it leads far, or once the tangent was not positive and had to
be made so by a part of the mass.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import scipy.sparse as sp

from fe.arrays import F64
from fe.elements.band import Band, cholesky
from fe.shell.problem import TINY, Problem
from fe.shell.unstable_direction import leave_unstable

_MAX_ITERATIONS = 60
# The step is the last one where the work that it can still do is this part of the energy: it
# leaves 1e-14 of the displacement.
_SETTLED = 1e-14
# Below this part the potential itself is too coarse for a search. Where stiff parts round off, the
# work falls no further from there on: it stays above that part of the work before.
_ROUNDING = 1e-9
_STAYS = 0.25
# Steps that can do more work than so many times the energy lead far; of others a rise of the
# potential says little, for it is that of stretch which the next step takes away.
_FAR = 4.0
# At a saddle the search would creep; from here on it leaves along the softest direction.
_AT_SADDLE = 1e-4
# A step is long enough where the potential falls by this part of what the tangent promises.
_ENOUGH = 1e-4
_SHORTEST = 1e-12
# Added mass grows fourfold; a finite tangent needs far fewer of them.
_MAX_SHIFTS = 60


@dataclass(frozen=True, eq=False)
class Equilibrium:
    """Where the iteration ended.

    Attributes
    ----------
    values : (N,) float64, mm
        All unknowns.
    converged : bool
    iterations : int
    escapes : int
        How often the tangent ceased to be positive, where the branch of the start may have ended.
        At the start itself, which may be a guess, it does not count.
    factor : Band
        Factors of the last tangent of the free unknowns; not of itself where it is not positive.
    """

    values: F64
    converged: bool
    iterations: int
    escapes: int
    factor: Band


class _Step(NamedTuple):
    """A step of all unknowns, twice the work it can do in N mm, and its factors."""

    move: F64
    work: float
    energy: float
    factor: Band
    shift: float


def equilibrium(problem: Problem, start: F64, bold: bool = True) -> Equilibrium:
    """Descend from a start (N,) mm to a stable equilibrium.

    The start need not obey the support: the first step takes up the jump, on the tangent there.
    Unless `bold`, it gives up at the first tangent that is not positive, where the branch of the
    start may end.
    """
    system, (lift, free) = problem.system, problem.support
    zero = np.zeros_like(start)
    values, escapes, shift, work, far = start, 0, 0.0, np.inf, _FAR
    jump = lift + free @ (free.T @ (start - lift)) - start
    stress = system.stresses(values, zero)
    iteration = 0
    while True:
        iteration += 1
        step = _step(problem, values, stress, jump, shift)
        escapes += iteration > 1 and step.shift > 0 and shift == 0
        shift, before, jumped = step.shift, work, jump.any()
        work = np.inf if jumped else step.work / max(step.energy, TINY)
        settled = work <= _SETTLED or _STAYS * before < work <= _ROUNDING
        if settled and shift == 0:
            return Equilibrium(values + step.move, True, iteration, escapes, step.factor)
        if (shift > 0 and not bold) or iteration == _MAX_ITERATIONS:
            return Equilibrium(values, False, iteration, escapes, step.factor)
        length = 1.0
        if shift > 0:
            far = _ROUNDING
        if work <= _AT_SADDLE and shift > 0:
            length, move = 0.0, leave_unstable(problem, values, step.factor)
        else:
            if work > far and not jumped:
                length = _search(problem, values, step)
            move = length * step.move
        ahead = values + move
        stress = system.stresses(values, move) if length == 1.0 else system.stresses(ahead, zero)
        values, jump = ahead, zero


def _step(problem: Problem, values: F64, stress: F64, jump: F64, before: float) -> _Step:
    """Newton step with these membrane forces in the tangent, after a jump of the support."""
    system, free = problem.system, problem.support.free
    energy, gradient, _ = system.forces(values)
    tangent = system.tangent(values, stress)
    right = -(free.T @ (gradient - problem.load + tangent @ jump))
    factor, shift = _positive(problem, tangent, before)
    inner = factor.solve(right)
    return _Step(jump + free @ inner, float(right @ inner), energy, factor, shift)


def _positive(problem: Problem, tangent: sp.csr_array, before: float) -> tuple[Band, float]:
    """Factor the tangent of the free unknowns, with a part of the mass where it needs one."""
    free, shift = problem.support.free, 0.0
    for _ in range(_MAX_SHIFTS):
        factor = cholesky(free.T @ (tangent + shift * problem.system.mass) @ free)
        if factor is not None:
            return factor, shift
        shift = max(4.0 * shift, before / 4.0, problem.reference_eigenvalue)
    raise ArithmeticError("tangent of the shell must be finite; no added mass makes it positive")


def _search(problem: Problem, values: F64, step: _Step) -> float:
    """Length of a step, 1 or less, that lowers the potential enough.

    Where it rises, the model is work (-t + t² / 2) + c t⁴: stretch by deflection adds the last.
    """
    potential, work = step.energy - float(problem.load @ values), step.work
    length = 1.0
    while length > _SHORTEST:
        rise = problem.potential(values + length * step.move) - potential
        if rise <= -_ENOUGH * length * work:
            break
        quartic = (rise / work + length - 0.5 * length**2) / length**4
        best = _lowest(quartic) if np.isfinite(quartic) else 0.1 * length
        length = min(best, 0.5 * length)
    return length


def _lowest(quartic: float) -> float:
    """Where -t + t² / 2 + quartic t⁴ is lowest, for a positive quartic."""
    roots = np.roots([4.0 * quartic, 0.0, 1.0, -1.0])
    return float(roots[np.argmin(abs(roots.imag))].real)
