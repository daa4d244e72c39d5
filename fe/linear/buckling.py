"""How much compression in its plane a plate bears before it buckles."""

from __future__ import annotations

from dataclasses import replace
from math import inf

import numpy as np
from scipy.sparse.linalg import eigsh

from fe.arrays import F64
from fe.elements.factor import factor, operator
from fe.elements.mesh import even_grid
from fe.linear.energy import stiffness
from fe.plate.plate import Plate

# On this many elements along the longer side the load of a clamped square is right to 3e-7.
_SIDE = 24
# Nearer to buckling than this part of its load a plate is refused: digits run out there.
_NEAREST = 1e-3


def buckling_factor(plate: Plate) -> float:
    """Return by how much the tension of a plate may grow until it buckles, were it flat.

    Parameters
    ----------
    plate : Plate
        With a tension; its shape does not count.

    Returns
    -------
    float
        Smallest positive λ for which the plate under λ times its tension has no stiffness in some
        deflection; below 1 where it has buckled, `math.inf` where no multiple of it buckles.
    """
    xx, yy, xy = plate.tension
    if xx >= 0 and yy >= 0 and xx * yy >= xy**2:
        return inf
    mesh = even_grid(plate, _SIDE)
    plain = stiffness(replace(plate, tension=(0.0, 0.0, 0.0), shape=None), mesh)
    tense = stiffness(plate, mesh) - plain
    ready = factor(plain)

    def solve(right: F64) -> F64:
        return ready.solve(right.reshape(len(right), -1)).reshape(right.shape)

    size = len(ready.scale)
    start = np.random.default_rng(0).standard_normal(size)
    # Energy of the tension in parts of that of bending, at its most negative.
    (lowest,) = eigsh(
        tense,
        1,
        plain,
        which="SA",
        Minv=operator(size, solve),
        v0=start,
        return_eigenvectors=False,
    )
    return -1.0 / float(lowest) if lowest < 0 else inf


def check_buckling(plate: Plate) -> None:
    """Raise where a flat plate buckles under the tension it has at rest.

    Raises
    ------
    ValueError
        It is pressed together by its buckling load or more.
    """
    bears = buckling_factor(plate)
    if bears * (1.0 - _NEAREST) <= 1.0:
        given, critical = (
            ", ".join(f"{scale * part + 0.0:.4g}" for part in plate.tension)
            for scale in (1.0, bears)
        )
        raise ValueError(
            f"plate tension must press less than buckling does, got ({given}) N/mm where "
            f"({critical}) N/mm is critical; press or heat the plate less, or hold its edges more "
            "firmly"
        )
