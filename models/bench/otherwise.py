"""What presses show to be other than described, of numbers of a bench that nobody asked for."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.stats import chi2

from models.bench.bench import NAMES, UNITS, BenchEstimate
from models.bench.causes import CAUSES
from models.bench.score_test import FALSE_ALARM

_GROUPS = {"Young's modulus": ("young",), **CAUSES}


class Otherwise(NamedTuple):
    """A cause that was not asked for, and the number of it that is farthest from described.

    Attributes
    ----------
    cause : str
        One of `CAUSES`, or Young's modulus.
    name : str
    value, sigma : float
        By which it is other than described, in its unit.
    p_value : float
        Probability that presses show as much of the cause where it is as described.
    """

    cause: str
    name: str
    value: float
    sigma: float
    p_value: float

    @property
    def sentence(self) -> str:
        """State it for the user."""
        unit = f" {UNITS[self.name]}".removesuffix(" 1")
        return f"{self.cause} ({self.name} {self.value:+.2g} ± {self.sigma:.1g}{unit})"


def otherwise(bench: BenchEstimate) -> tuple[Otherwise, ...]:
    """Name what presses show to be other than described and was not asked for, the surest first.

    By Wald's test of each cause on the bench with all numbers free, its rate of false alarms that
    of a diagnosis.

    Parameters
    ----------
    bench : BenchEstimate
        Of `identify`.
    """
    shown = bench.shown
    if shown is None:
        return ()
    away = shown.values - bench.values  # 0 for what was asked for
    found: list[Otherwise] = []
    for cause, members in _GROUPS.items():
        numbers = [k for k, name in enumerate(NAMES) if name in members and away[k] != 0.0]
        if not numbers:
            continue
        covariance = shown.covariance[np.ix_(numbers, numbers)]
        size = float(away[numbers] @ np.linalg.solve(covariance, away[numbers]))
        p_value = float(chi2.sf(size, len(numbers)))
        if p_value < FALSE_ALARM:
            far = max(numbers, key=lambda k: abs(away[k]) / shown.sigma[k])
            value, sigma = float(away[far]), float(shown.sigma[far])
            found.append(Otherwise(cause, NAMES[far], value, sigma, p_value))
    return tuple(sorted(found, key=lambda one: one.p_value))
