"""Creep: under a steady force a plate of plastic goes on yielding, and comes back as slowly.

Linear viscoelasticity with two Prony terms of the compliance: beside the deflection q of elastic
equilibrium there is c₁ + c₂ with dcᵢ/dt = (aᵢ q - cᵢ) / τᵢ (Ferry 1980, chapter 3). All modes of a
plate of one material creep alike, so that two vectors of amplitudes are all that it remembers.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from models.arrays import F64

_SHORTEST = 0.2  # s: what creeps faster is over before a touch is known
_READINGS = 4.0  # within the time of a term, or nothing is known of it
_FEWEST = 20  # readings after a release to learn from
_SURE = 5.0  # standard deviations by which a plate must have crept


@dataclass(frozen=True)
class Creep:
    """Prony terms of the compliance of a material.

    Attributes
    ----------
    parts : tuple of float
        aᵢ: what each term adds to the elastic deflection in the end, parts of it.
    times : tuple of float, s
        τᵢ.

    Raises
    ------
    ValueError
        A part is negative, a time is not positive, or there are more of one than of the other.
    """

    parts: tuple[float, ...]
    times: tuple[float, ...]

    def __post_init__(self) -> None:
        """Refuse what no material does."""
        if len(self.parts) != len(self.times):
            raise ValueError(
                f"creep has {len(self.parts)} parts and {len(self.times)} times; give one a term"
            )
        for part, time in zip(self.parts, self.times, strict=True):
            if not (0 <= part < 1 and time > 0):
                raise ValueError(
                    f"a term of creep must have a part from 0 to 1 and a positive time, got"
                    f" {part:g} and {time:g} s; PVC has about 0.03 and 30 s"
                )

    def rest(self, size: int) -> F64:
        """Remember nothing: amplitudes (terms, size)."""
        return np.zeros((len(self.parts), size))

    def after(self, crept: F64, elastic: F64, seconds: float) -> F64:
        """Amplitudes (terms, K) after some time under a steady elastic deflection (K,)."""
        kept = np.exp(-max(seconds, 0.0) / np.array(self.times))[:, None]
        return kept * crept + (1.0 - kept) * np.array(self.parts)[:, None] * elastic


@dataclass(frozen=True, eq=False)
class LearnedCreep:
    """Creep that a held press has shown.

    Attributes
    ----------
    creep : Creep
    scatter : float, N
        Root mean square of what it leaves of the readings after the release.
    """

    creep: Creep
    scatter: float


def learn_creep(times: F64, shown: F64, released: float, sigma: float) -> LearnedCreep:
    """Learn the creep of a plate from one press that was held and let go.

    How hard the finger pressed need not be known: after the release no force is, and all that the
    plate shows then it has crept.

    Parameters
    ----------
    times : (N,) float64, s
    shown : (N,) float64, N
        Force that the plate shows at the place of the press, if it were elastic; from before the
        press to well after the release.
    released : float, s
        From when on nothing touched.
    sigma : float, N
        Standard deviation of one reading.

    Raises
    ------
    ValueError
        There are too few readings after the release, or the plate has hardly crept.
    """
    after = times >= released
    if np.count_nonzero(~after) < 2:
        raise ValueError(
            f"creep needs 2 readings before the release, got {np.count_nonzero(~after)}; begin to"
            " record before the plate is pressed"
        )
    if np.count_nonzero(after) < _FEWEST:
        raise ValueError(
            f"creep needs {_FEWEST} readings after the release, got {np.count_nonzero(after)};"
            " record the plate for a minute after a press of a minute"
        )
    first = shown[after][: max(np.count_nonzero(after) // 10, _FEWEST // 4)]
    if first.mean() < _SURE * sigma / np.sqrt(len(first)):
        raise ValueError(
            f"the plate shows {first.mean():.2g} N after the release, which is no more than noise;"
            " press harder or longer to learn its creep"
        )
    span = float(times[-1] - times[0])
    shortest = max(_SHORTEST, _READINGS * float(np.median(np.diff(times))))

    def of(unknown: F64) -> Creep:
        parts = tuple(np.exp(unknown[:2]).tolist())
        return Creep(parts, tuple(np.exp(unknown[2:]).tolist()))

    def left(unknown: F64) -> F64:
        return (crept_force(of(unknown), times, shown, released) - shown)[after] / sigma

    start = np.log([0.02, 0.04, span / 40, span / 4])
    bounds = (
        np.log([1e-5, 1e-5, min(shortest, span / 20), span / 15]),
        np.log([0.3, 0.3, span / 15, 2 * span]),
    )
    fit = least_squares(left, np.clip(start, *bounds), bounds=bounds, x_scale="jac")
    scatter = sigma * float(np.sqrt(np.mean(np.square(fit.fun))))
    return LearnedCreep(of(np.asarray(fit.x, dtype=np.float64)), scatter)


def crept_force(creep: Creep, times: F64, shown: F64, released: float) -> F64:
    """Part of a force (N,) that a plate shows only because it has crept, N.

    Parameters
    ----------
    creep : Creep
    times, shown, released
        As for `learn_creep`.
    """
    crept = creep.rest(1)
    found = np.zeros(len(times))
    elastic = 0.0
    for k in range(1, len(times)):
        crept = creep.after(crept, np.array([elastic]), float(times[k] - times[k - 1]))
        found[k] = float(crept.sum())
        elastic = 0.0 if times[k] >= released else float(shown[k]) - found[k]
    return found
