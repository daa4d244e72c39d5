"""The way down from an unstable equilibrium."""

from __future__ import annotations

import numpy as np

from fe.arrays import F64
from fe.elements.band import Band
from fe.shell.problem import Problem

# First length of the way, largest deflection in parts of the thickness; then it is doubled.
_FIRST = 0.1
# What decides the sense of a direction: up on the whole; where it goes up as much as down, up
# towards the west; then towards the south.
_WEST, _SOUTH = 0.1, 0.01
_INVERSE_ITERATIONS = 20


def leave_unstable(problem: Problem, values: F64, factor: Band) -> F64:
    """Step along the softest direction to about where the potential is lowest.

    Of the two senses the one that moves the plate to +z is tried first, so that plates that are
    pressed together bow to the touched side.

    Parameters
    ----------
    problem : Problem
    values : (N,) float64, mm
    factor : Band
        Of the tangent there, with a part of the mass that makes it positive.

    Returns
    -------
    (N,) float64, mm
    """
    first = _upward(problem, _softest(problem, factor))
    here = problem.potential(values)
    for way in (first, -first):
        length, lowest = 1.0, here
        while (found := problem.potential(values + length * way)) < lowest:
            length, lowest = 2.0 * length, found
        if length > 1.0:
            return 0.5 * length * way
    return first


def _softest(problem: Problem, factor: Band) -> F64:
    """Direction of the smallest eigenvalue by inverse iteration, on all unknowns."""
    free, mass = problem.support.free, problem.system.mass
    direction = np.random.default_rng(0).standard_normal(len(problem.load))
    for _ in range(_INVERSE_ITERATIONS):
        direction = free @ factor.solve(free.T @ (mass @ direction))
        direction /= np.linalg.norm(direction)
    return direction


def _upward(problem: Problem, direction: F64) -> F64:
    """Scale a direction to the first length, in the sense that raises the plate."""
    deflection = problem.system.table(direction)[::2, ::2, 2]
    x, y = (np.linspace(0.5, -0.5, count) for count in deflection.shape)
    sense = np.sign((deflection * (1.0 + _WEST * x[:, None] + _SOUTH * y)).sum())
    first = _FIRST * problem.system.plate.thickness / abs(deflection).max()
    return sense * first * direction
