"""Where a touch has landed, from the first frame that shows it: which place explains it best."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

import fe
from models.arrays import F64
from models.dynamics.follow import Seeing
from models.dynamics.oscillators import Span

_SIDE = 12  # places along a side
_INSET = 0.04  # of a side, from the edges
_FORCES = (100.0, 1000.0, 10000.0)  # N/s per √s: how fast the force of a landing gains speed


@dataclass(frozen=True, eq=False)
class Landings:
    """What forces at many places would show in a frame.

    Attributes
    ----------
    places : (C, 2) float64, mm
    shown : (C, m, p) float64
        Measurement by a unit of the noise of each knot.
    knots : (p + 1, p) float64, N
        Force at the knots by the same.
    """

    places: F64
    shown: F64
    knots: F64

    def best(self, left: F64) -> tuple[F64, F64]:
        """Place (2,) mm and force at the knots (p + 1,) that explain what is left, (m,), best."""
        towards = np.einsum("cmp,m->cp", self.shown, left)
        gram = np.einsum("cmp,cmq->cpq", self.shown, self.shown)
        best = -np.inf, self.places[0], np.zeros(len(self.knots))
        for size in _FORCES:
            inner = np.eye(gram.shape[1]) + size**2 * gram
            found = np.linalg.solve(inner, size**2 * towards[..., None])[..., 0]
            fit = 0.5 * np.einsum("cp,cp->c", found, towards) - 0.5 * np.linalg.slogdet(inner)[1]
            place = int(fit.argmax())
            if fit[place] > best[0]:
                best = float(fit[place]), self.places[place], self.knots @ found[place]
        return best[1], best[2]


def landings(span: Span, seeing: Seeing) -> Landings:
    """Lay places over the plate."""
    along = [np.linspace(_INSET, 1 - _INSET, _SIDE) * side for side in seeing.modes.plate.size]
    places = np.stack(np.meshgrid(*along), axis=-1).reshape(-1, 2)
    knots = force_knots(span.steps)
    pressed = np.einsum("jk,jp->kp", span.pressed, knots)
    response = seeing.modes.response(places)
    shown = np.einsum("ck,kp,km->cmp", response, pressed, seeing.factor, optimize=True)
    return Landings(places, shown, knots)


def force_knots(steps: F64) -> F64:
    """Force at the knots by a unit of noise between each two, from rest: (p + 1, p) N."""
    from models.dynamics.follow import KEPT

    forces = np.zeros((len(steps) + 1, len(steps)))
    rate = np.zeros(len(steps))
    for k, step in enumerate(steps.tolist()):
        after = np.exp(-step / KEPT) * rate
        after[k] += np.sqrt(step)
        forces[k + 1] = forces[k] + 0.5 * step * (rate + after)
        rate = after
    return forces
