"""A plate of plastic that creeps: finite elements with a history, stepped through time.

A generalised Maxwell solid (Ferry 1980): beside a spring there are branches of a spring and a
dashpot each, three of them, with Poisson's ratios of their own, so that the shape of the deflection
changes with time as well. None of this is the compliance of two terms that the estimator knows.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from scipy.sparse.linalg import splu

import fe
from fe.elements.functional import derivative
from fe.elements.mesh import Mesh
from fe.linear.energy import free, stiffness
from rig.system.arrays import F64

# Parts of the stiffness that relax, in what time (s), and with what Poisson's ratio. After half a
# second of a steady force they let the deflection grow by 5 % in a minute.
BRANCHES = ((0.012, 2.0, 0.30), (0.022, 15.0, 0.36), (0.034, 90.0, 0.45))


def crept_readings(
    plate: fe.Plate,
    mesh: Mesh,
    readings: F64,
    place: F64,
    force: Callable[[float], float],
    step: float,
    duration: float,
) -> F64:
    """Measure a plate that creeps under one press.

    Parameters
    ----------
    readings : (m, unknowns) float64
        Measurement of each free unknown.
    place : (2,) float64, mm
    force : callable
        Force at a time, N.
    step, duration : float, s

    Returns
    -------
    (steps, m) float64
        At each multiple of `step`, from 0.
    """
    keep = free(plate, mesh)
    slow = [
        stiffness(replace(plate, young=part * plate.young, poisson=poisson), mesh)
        for part, _, poisson in BRANCHES
    ]
    fading = [np.exp(-step / time) for _, time, _ in BRANCHES]
    lasting = stiffness(
        replace(plate, young=(1 - sum(part for part, _, _ in BRANCHES)) * plate.young), mesh
    )
    whole = lasting
    for branch, fade in zip(slow, fading, strict=True):
        whole = whole + fade * branch
    solve = splu(whole.tocsc()).solve
    table = np.zeros((*mesh.shape, 1))
    derivative(mesh, place[None]).add_to(table, -np.ones(1), np.zeros(1, dtype=np.int64))
    load = table[keep[0]][:, keep[1]].ravel()
    flown = [np.zeros_like(load) for _ in BRANCHES]
    seen: list[F64] = []
    for k in range(round(duration / step) + 1):
        right = load * force(k * step)
        for branch, fade, strain in zip(slow, fading, flown, strict=True):
            right = right + fade * (branch @ strain)
        moved = solve(right)
        flown = [
            fade * strain + (1 - fade) * moved for fade, strain in zip(fading, flown, strict=True)
        ]
        seen.append(readings @ moved)
    return np.array(seen)
