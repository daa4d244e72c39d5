"""What a frame shows of modes that ring, and of those so stiff that they follow a force at once.

The lowest modes are followed in time; all others are at equilibrium. A measurement is reduced to
what it says of both: the span of the low modes, and of the others the response to each touch with
its derivatives by the place.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

import fe
from models.arrays import F64

RINGING = 48
"""Modes that are followed; the next ones swing at 20 times the lowest frequency and more."""


@dataclass(frozen=True, eq=False)
class Seeing:
    """What turns the modes of a plate into a measurement.

    Attributes
    ----------
    modes : fe.Modes
        K of them.
    factor : (K, m) float64
        Whitened measurement of a unit of each mode.
    """

    modes: fe.Modes
    factor: F64

    @property
    def low(self) -> int:
        """Number of modes that are followed, k."""
        return min(RINGING, self.modes.count)

    @cached_property
    def basis(self) -> F64:
        """Orthonormal basis of what the low modes show, (m, k)."""
        return np.linalg.qr(self.factor[: self.low].T)[0]

    @cached_property
    def of_low(self) -> F64:
        """What a unit of each low mode shows in that basis, (k, k)."""
        return self.basis.T @ self.factor[: self.low].T

    @cached_property
    def size(self) -> F64:
        """Standard deviations of a measurement by a unit of each low mode, (k,)."""
        return np.linalg.norm(self.factor[: self.low], axis=1)

    @cached_property
    def _alone(self) -> TouchTangent:
        """No response, for no place."""
        low, stiff = np.empty((0, 3, self.low)), np.empty((0, 3, self.basis.shape[1]))
        return TouchTangent(np.empty((0, 2)), low, stiff, np.empty((len(self.basis), 0)))

    def within(self, places: F64) -> F64:
        """Places (n, 2) mm, those beside the plate on its edge."""
        return np.clip(places, 0.0, np.array(self.modes.plate.size))

    def equilibrium(self, places: F64, forces: F64) -> F64:
        """Amplitudes (k,) of the low modes at rest under touches (n, 2) mm and (n,) N."""
        if not len(forces):
            return np.zeros(self.low)
        return forces @ self.modes.response(self.within(places))[:, : self.low]

    def about(self, places: F64) -> TouchTangent:
        """Response to touches at some places (n, 2) mm, and how it changes with them."""
        if not len(places):
            return self._alone
        places = self.within(places)
        response = self.modes.response(places)
        slope = self.modes.gradient(places).transpose(0, 2, 1)
        rows = np.concatenate([response[:, None], slope], axis=1)  # (n, 3, K)
        stiff = rows[:, :, self.low :] @ self.factor[self.low :]
        wide = stiff.reshape(-1, stiff.shape[2])
        beside = wide - (wide @ self.basis) @ self.basis.T
        extra = np.linalg.qr(beside.T)[0]
        seen = np.concatenate([stiff @ self.basis, stiff @ extra], axis=2)
        return TouchTangent(places, rows[:, :, : self.low], seen, extra)


@dataclass(frozen=True, eq=False)
class TouchTangent:
    """Response to touches of 1 N, and its derivatives by x and y of each.

    Attributes
    ----------
    places : (n, 2) float64, mm
    low : (n, 3, k) float64
        Of the low modes at equilibrium: value, by x, by y.
    stiff : (n, 3, d) float64
        Of all others, as they show in the reduced measurement.
    extra : (m, e) float64
        What of a measurement the stiff modes need beyond the span of the low ones.
    """

    places: F64
    low: F64
    stiff: F64
    extra: F64

    def reduced(self, seeing: Seeing, measured: F64) -> F64:
        """Numbers (d,) of a measurement (m,) that are looked at."""
        return np.concatenate([measured @ seeing.basis, measured @ self.extra])
