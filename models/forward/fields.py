"""Fields by which a plate moves: functions of its deflection, and of its motion in the plane."""

from __future__ import annotations

from typing import Protocol

import fe
from models.arrays import F64
from models.forward.linear import Forward


class Deflections(Protocol):
    """Functions that carry the deflection of a plate."""

    @property
    def plate(self) -> fe.Plate:
        """The plate."""
        ...

    @property
    def count(self) -> int:
        """How many functions there are, K."""
        ...

    def value(self, xy: F64) -> F64:
        """Functions at points (N, 2) mm: (N, K)."""
        ...

    def slope(self, xy: F64) -> F64:
        """Their slopes along x and y: (N, K, 2)."""
        ...

    def response(self, xy: F64) -> F64:
        """Amplitudes per N under a light touch at each place, (n, 2) mm → (n, K)."""
        ...


class LargeFields(Protocol):
    """What knows the amplitudes of a plate under large touches."""

    @property
    def drifts(self) -> int:
        """Number U of fields in the plane."""
        ...

    def drift(self, places: F64) -> F64:
        """Motion in the plane by a unit of each field, (N, 2) mm → (N, 2, U) mm."""
        ...

    def amplitudes(self, xy: F64, force: F64) -> F64:
        """Amplitudes of all fields under touches (n, 2) mm and (n,) N, (K + U,)."""
        ...

    def forward(self, factor: F64) -> Forward:
        """Forward model of amplitudes whitened by a factor (K + U, m)."""
        ...


class InPlane(Deflections, LargeFields, Protocol):
    """Fields of both kinds in one."""
