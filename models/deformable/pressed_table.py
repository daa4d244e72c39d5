"""Touches of some forces at places all over a bent plate: where a search for one begins.

A light touch may move a bent plate in another way than a firm one at the same place, so that a
search by light ones begins where the true touch is not: on a line of symmetry for instance, at
which the plate begins to lean.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

import fe
from models.arrays import F64

# Places a side, in from the edge by so much of the side, and forces, N.
_PLACES, _EDGE = 21, 0.02
_FORCES = (0.3, 0.8, 1.6, 2.6)
# Descents that are tried.
_NEAREST = 3


@dataclass(frozen=True, eq=False)
class PressedTable:
    """What single touches show.

    Attributes
    ----------
    touches : (N, 3) float64, mm, mm, N
    shown : (N, m) float64
        In units of the noise of a measurement.
    squares : (N,) float64
        Of `shown`.
    """

    touches: F64
    shown: F64
    squares: F64

    def nearest(self, measured: F64) -> F64:
        """Return the few touches (n, 3) that come nearest to a measurement (m,)."""
        order = np.argsort(self.squares - 2.0 * (self.shown @ measured))
        return self.touches[order[:_NEAREST]]


def pressed_table(response: fe.ShellResponse, factor: F64, series: float) -> PressedTable:
    """Press a plate all over.

    Parameters
    ----------
    response : fe.ShellResponse
    factor : (K, m) float64
        From amplitudes to the measurement in units of its noise.
    series : float
        Ratio of the orders of the response beyond which a touch is left out.
    """
    lines = [np.linspace(_EDGE * side, (1 - _EDGE) * side, _PLACES) for side in response.plate.size]
    places = np.stack(np.meshgrid(*lines), axis=-1).reshape(-1, 2)
    xy, force = np.tile(places, (len(_FORCES), 1)), np.repeat(_FORCES, len(places))
    kept = response.nonlinearity(xy, force) < series
    xy, force = xy[kept], force[kept]
    shown = response.amplitudes(xy, force) @ factor
    return PressedTable(np.column_stack([xy, force]), shown, np.square(shown).sum(axis=1))
