"""Whether an equilibrium is one, and how far from losing its hold."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from math import isnan, nan
from typing import NamedTuple

import numpy as np
from scipy.sparse.linalg import ArpackNoConvergence, LinearOperator, eigsh

from fe.arrays import F64
from fe.elements.band import Band, Compressed
from fe.linear.demand import OVERSTRAINED

# A stiffness against snapping that has fallen to this part of that at rest is called near.
NEAR = 0.02

# An eigenvalue is known where rounding is bounded by this part of it. The bound was seen to be 3 to
# 10 times what rounding does.
_KNOWN = 0.05
_ROUNDING = float(np.finfo(np.float64).eps)
# Vectors of Lanczos's method, how often it begins anew, and its tolerance. The lowest frequencies
# of a long plate lie so close together that the first search finds none of them by itself: the
# second knows their value to 1e-3, and it is within 5e-5 at 100:1.
_SEARCH = 12, 3, 1e-6
_CLOSE_SEARCH = 48, 1000, 1e-3


class Verdict(Enum):
    """What a state is worth; the value is the sentence to show."""

    STABLE = "the equilibrium is stable"
    NEAR_LIMIT = (
        "the equilibrium is near a limit: whether the plate stays in it cannot be known, for a "
        "small touch may snap it to another shape"
    )
    OTHER_BRANCH = (
        "the shape that was followed became unstable and the plate went over to another one or "
        "back to it; it is stable there"
    )
    OVERSTRAINED = OVERSTRAINED
    UNRESOLVED = (
        "an equilibrium was found, but its parts are so unlike in stiffness that rounding hides "
        "whether it is stable"
    )
    NOT_CONVERGED = "no equilibrium was found: the values are those of the last iteration"


@dataclass(frozen=True)
class Stability:
    """How good an equilibrium is.

    Attributes
    ----------
    verdict : Verdict
    residual : float
        Forces left over, in parts of the element forces that cancel in them; where stiff parts make
        more than 1e-6 of the rounding of displacements alone, before they are rounded.
    iterations : int
        Newton iterations on the way, all of them.
    eigenvalue : float
        Smallest eigenvalue of the tangent against the mass, in parts of that of the plate at
        rest: the square of the lowest natural frequency in parts of that at rest. It does not
        depend on the mesh; 1 at rest, 0 at a limit point or a branching; NaN where no equilibrium
        was found, or rounding hides it.
    escapes : int
        How often the tangent ceased to be positive on the way, where the shape that was followed
        may have ended.
    demand : float
        Largest equivalent strain of the faces in parts of the strain limit of the material, beside
        point forces left out; NaN where no equilibrium was found.
    """

    verdict: Verdict
    residual: float
    iterations: int
    eigenvalue: float
    escapes: int
    demand: float = 0.0

    @property
    def converged(self) -> bool:
        """Whether this is an equilibrium."""
        return self.verdict is not Verdict.NOT_CONVERGED

    @property
    def tangent_known(self) -> bool:
        """Whether its tangent stiffness is known, and with it what small touches do."""
        return self.converged and self.verdict is not Verdict.UNRESOLVED


def judge(converged: bool, eigenvalue: float, escapes: int, demand: float) -> Verdict:
    """Put the worst that is known into a verdict."""
    if not converged:
        return Verdict.NOT_CONVERGED
    if isnan(eigenvalue):
        return Verdict.UNRESOLVED
    if demand > 1.0:
        return Verdict.OVERSTRAINED
    if eigenvalue < NEAR:
        return Verdict.NEAR_LIMIT
    return Verdict.OTHER_BRANCH if escapes else Verdict.STABLE


class Eigenvalue(NamedTuple):
    """Smallest eigenvalue of a tangent against the mass.

    Attributes
    ----------
    value : float, N/mm³
    rounding : float, N/mm³
        Bound on what the rounding of the tangent makes of it.
    """

    value: float
    rounding: float

    @property
    def known(self) -> float:
        """The value, NaN where rounding hides it."""
        return self.value if self.rounding <= _KNOWN * self.value else nan


def smallest(tangent: Compressed, mass: Compressed, factor: Band) -> Eigenvalue:
    """Smallest eigenvalue of tangent - λ mass, by Lanczos on the inverse.

    Parameters
    ----------
    tangent, mass : (Z, Z) sparse
        Both positive.
    factor : Band
        Of the tangent.
    """
    inverse = LinearOperator(tangent.shape, matvec=factor.solve)  # pyright: ignore[reportCallIssue]
    start = np.random.default_rng(0).standard_normal(len(factor.scale))

    def search(vectors: int, restarts: int, tolerance: float) -> tuple[F64, F64]:
        found: tuple[F64, F64] = eigsh(
            tangent,
            k=1,
            M=mass,
            sigma=0.0,
            OPinv=inverse,
            v0=start,
            tol=tolerance,  # pyright: ignore[reportArgumentType]
            ncv=vectors,
            maxiter=restarts,
        )
        return found

    try:
        (value,), modes = search(*_SEARCH)
    except ArpackNoConvergence:
        (value,), modes = search(*_CLOSE_SEARCH)
    # Its vectors have mass 1.
    sizes = np.abs(modes[:, 0])
    return Eigenvalue(float(value), _ROUNDING * float(sizes @ (abs(tangent) @ sizes)))
