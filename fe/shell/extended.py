"""Equilibria that double precision is too coarse for: forces in extended precision, and refinement.

A displacement of 1 mm is rounded by 1e-16 mm. Where a patch is 1e10 times as stiff that alone
leaves 2e-6 of the forces of its elements: the equilibrium lies between two numbers. It is found by
iterative refinement, with forces and displacement in extended precision and steps by the factors
that there are (Demmel et al., 2006, doi 10.1145/1141885.1141894). Extended precision is that of
`numpy.longdouble`; where it has no more digits than a double, nothing is gained and the residual
says so.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from fe.arrays import F64
from fe.elements.band import Band
from fe.shell.measure import ORDERS, surface
from fe.shell.problem import TINY, Problem
from fe.shell.system import System

# A step that lowers the residual by less than this part is the last one.
_FALLS = 0.5

# Component of the second derivatives xx, yy, xy behind each curvature αβ.
_SECOND = ((2, 4), (4, 3))

# Displacements, forces and the like in extended precision, of which SciPy's types know nothing.
_Long = Any


def refine(problem: Problem, values: F64, factor: Band) -> tuple[F64, float]:
    """Step on from an equilibrium (N,) mm of double precision as long as the residual falls.

    Parameters
    ----------
    problem : Problem
    values : (N,) float64, mm
    factor : Band
        Of the tangent of the free unknowns there.

    Returns
    -------
    values : (N,) float64, mm
        Rounded.
    residual : float
        As `Problem.residual`, before they were rounded.
    """
    free, smallest = problem.support.free, np.inf
    kept: _Long = values
    ahead: _Long = values.astype(np.longdouble)
    while True:
        gradient, size = forces(problem.system, ahead)
        left = free.T @ (gradient - problem.load).astype(np.float64)
        residual = float(np.linalg.norm(left) / max(np.linalg.norm(size), TINY))
        if not residual < _FALLS * smallest:
            return kept.astype(np.float64), smallest
        kept, smallest = ahead, residual
        ahead = kept - free @ factor.solve(left)


def forces(system: System, values: _Long) -> tuple[_Long, F64]:
    """Compute forces (N,) N, and the size of what adds up to them, as `System.forces` does.

    In extended precision: values (N,) longdouble, mm.
    """
    rule, table = system.rule, system.table(values)
    windows = np.lib.stride_tricks.sliding_window_view(table, (4, 4), (0, 1))[::2, ::2]
    lines = [(rule.x[:, :, p], rule.y[:, :, q]) for p, q in ORDERS]
    change = np.stack([np.einsum("egi,efcij,fhj->efghc", x, windows, y) for x, y in lines], axis=4)
    at_points = _forces_at_points(system, change)
    # Of one element on its 4 x 4 functions.
    parts = (
        np.einsum("egi,efghc,fhj->efijc", x, at_points[..., d, :], y)
        for d, (x, y) in enumerate(lines)
    )
    elements = np.sum(list(parts), axis=0)
    gradient, size = np.zeros(table.shape, np.longdouble), np.zeros(table.shape)
    (nx, ny), pull = system.mesh.counts, system.springs @ values
    for i, j in np.ndindex(4, 4):
        there = slice(i, i + 2 * nx, 2), slice(j, j + 2 * ny, 2)
        gradient[there] += elements[:, :, i, j]
        size[there] += np.abs(elements[:, :, i, j])
    return gradient.ravel() + pull - system.at_rest, size.ravel() + np.abs(pull).astype(np.float64)


def _forces_at_points(system: System, change: _Long) -> _Long:
    """Work, times the area, on the five derivatives of the displacement: both (nx, ny, G, G, 5, 3).

    See `fe.shell.point` for the variations.
    """
    rule = system.rule
    rest = np.zeros_like(change)
    rest[..., 2] = rule.rest
    bent, before = surface(_flat(rest + change)), surface(_flat(rest))
    points = change.shape[:4]
    area = rule.weight_x[:, None, :, None] * rule.weight_y[None, :, None]
    membrane, bending = (np.broadcast_to(part[:, :, None, None], points) for part in rule[4:6])
    xx, yy, xy = system.plate.tension
    tension = np.array([[xx, xy], [xy, yy]])
    strain, curvature = bent.strain - before.strain, bent.curvature - before.curvature
    stress = _law(membrane, rule.poisson, strain) + tension
    moment = _law(bending, rule.poisson, curvature)
    along = np.einsum("kabc,kgc->kabg", _flat(rest + change)[:, _SECOND], bent.duals)
    work: _Long = np.zeros((len(stress), 5, 3), np.longdouble)
    work[:, :2] = stress @ bent.tangents
    work[:, :2] -= np.einsum("kab,kabg->kg", moment, along)[..., None] * bent.normal[:, None]
    for a, b in np.ndindex(2, 2):
        work[:, _SECOND[a][b]] += moment[:, a, b, None] * bent.normal
    return work.reshape(change.shape) * area[..., None, None]


def _flat(derivatives: _Long) -> _Long:
    return derivatives.reshape(-1, 5, 3)


def _law(stiffness: F64, poisson: float, strain: _Long) -> _Long:
    """Plane stress (K, 2, 2) of strains (K, 2, 2)."""
    trace = np.trace(strain, axis1=1, axis2=2)[:, None, None] * np.eye(2)
    return stiffness.reshape(-1, 1, 1) * ((1.0 - poisson) * strain + poisson * trace)
