"""How much of its linear solution a plate takes that also stretches."""

from __future__ import annotations

import numpy as np


def min_energy_fraction(work: float, bowed: float, mixed: float, stretching: float) -> float:
    """Find the fraction t of the linear solution that has the least energy.

    The energy is W (t²/2 - t) + (A t² + 2 B t³ + C t⁴) / 2.

    Parameters
    ----------
    work : float
        W of the force on the linear solution, N mm.
    bowed, mixed, stretching : float
        A, B and C, N mm: works of stress on strain of the stretch that is linear in the
        deflection (of a plate with a shape), of both, and of that which is square in it.
    """
    if work <= 0:
        return 1.0
    found = np.roots([2.0 * stretching, 3.0 * mixed, work + bowed, -work])
    t = found.real[found.imag == 0]
    energy = work * (0.5 * t - 1.0) * t + 0.5 * t**2 * (bowed + t * (2.0 * mixed + t * stretching))
    return float(t[energy.argmin()])
