"""A plate that is tapped: finite elements with their own mass, stepped through time by Newmark.

Nothing here knows the modes of the estimator: the mesh is another, damping is Rayleigh's
(proportional to mass and stiffness), and the steps are those of constant mean acceleration
(Newmark 1959), a hundredth of the period of the fifth mode.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import pi

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import splu

import fe
from fe.elements.functional import derivative
from fe.elements.hermite import hermite_gram
from fe.elements.mesh import Mesh
from fe.linear.energy import free, stiffness
from rig.system.arrays import F64

STEP = 1e-4  # s
KEPT = 5  # steps between two that are kept

Forces = Callable[[float], F64]
"""Forces of n taps at a time, s: (n,) N."""


@dataclass(frozen=True)
class Damping:
    """Ratios of damping at two frequencies, between which Rayleigh's is somewhat lower.

    Attributes
    ----------
    ratio : float
        At both frequencies, parts of critical damping.
    low, high : float, Hz
    """

    ratio: float
    low: float
    high: float

    @property
    def parts(self) -> tuple[float, float]:
        """Of the mass, 1/s, and of the stiffness, s."""
        low, high = 2 * pi * self.low, 2 * pi * self.high
        return 2 * self.ratio * low * high / (low + high), 2 * self.ratio / (low + high)


def summed_readings(
    plate: fe.Plate,
    mesh: Mesh,
    density: float,
    damping: Damping,
    readings: F64,
    places: F64,
    forces: Forces,
    duration: float,
) -> F64:
    """Time integrals of what is measured under n taps, each on a plate of its own.

    Parameters
    ----------
    density : float, t/mm³
    readings : (m, unknowns) float64
        Measurement of each free unknown.
    places : (n, 2) float64, mm
    forces : callable
    duration : float, s

    Returns
    -------
    (steps, n, m) float64
        ∫ y dt from 0 to each multiple of `STEP` · `KEPT`: their differences are exposures.
    """
    keep = free(plate, mesh)
    along, across = (
        hermite_gram(line, 0, 0)[kept][:, kept] for line, kept in zip(mesh.lines, keep, strict=True)
    )
    mass = density * plate.thickness * sp.csc_array(sp.kron(along, across))
    spring = stiffness(plate, mesh)
    of_mass, of_spring = damping.parts
    viscous = of_mass * mass + of_spring * spring
    half = STEP / 2
    solve = splu(sp.csc_matrix(mass + half * viscous + half**2 * spring)).solve
    table = np.zeros((*mesh.shape, len(places)))
    derivative(mesh, places).add_to(table, -np.ones(len(places)), np.arange(len(places)))
    load = table[keep[0]][:, keep[1]].reshape(-1, len(places))
    moved, speed = np.zeros_like(load), np.zeros_like(load)
    pushed = np.zeros_like(load)
    before, total = np.zeros((len(places), len(readings))), np.zeros((len(places), len(readings)))
    kept = [total.copy()]
    for step in range(1, round(duration / STEP) + 1):
        moved += STEP * speed + half**2 * pushed
        speed += half * pushed
        pushed = solve(load * forces(step * STEP) - viscous @ speed - spring @ moved)
        moved += half**2 * pushed
        speed += half * pushed
        if step % KEPT == 0:
            now = (readings @ moved).T
            total += 0.5 * KEPT * STEP * (before + now)
            before = now
            kept.append(total.copy())
    return np.array(kept)
