"""Where a touch has landed, from the first frame that shows it: which place explains it best."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from models.arrays import F64
from models.dynamics.oscillators import Span
from models.dynamics.seeing import Seeing

_SIDE = 10  # places along a side
_INSET = 0.04  # of a side, from the edges


class Landing(NamedTuple):
    """A touch that has landed.

    Attributes
    ----------
    place : (2,) float64, mm
    forces : (p + 1,) float64, N
        At the knots since the last frame.
    """

    place: F64
    forces: F64


def find_landing(span: Span, seeing: Seeing, left: F64, agility: tuple[float, ...]) -> Landing:
    """Find the place of a touch that explains best what others leave of a measurement, (m,).

    Its force begins at nothing and changes by any of the steps given, N/s per √s.
    """
    along = [np.linspace(_INSET, 1 - _INSET, _SIDE) * side for side in seeing.modes.plate.size]
    places = np.stack(np.meshgrid(*along), axis=-1).reshape(-1, 2)
    knots = span.forces[:, 2:]
    response = seeing.modes.response(places)
    forced = np.einsum("jk,jp->kp", span.pressed, knots)
    held = span.weights @ knots
    # What each place shows in the span of the low modes: these in time, all others at once.
    low = response[:, : seeing.low, None] * forced
    shown = np.matmul(seeing.of_low, low)
    stiff = response[:, seeing.low :] @ (seeing.factor[seeing.low :] @ seeing.basis)
    shown += stiff[:, :, None] * held
    gram = shown.transpose(0, 2, 1) @ shown
    towards = np.einsum("cmp,m->cp", shown, left @ seeing.basis)
    best, landing = -np.inf, Landing(places[0], np.zeros(len(knots)))
    for size in agility:
        inner = np.eye(gram.shape[1]) + size**2 * gram
        pushed = size**2 * towards[..., None]
        found = np.asarray(np.linalg.solve(inner, pushed), dtype=np.float64)[..., 0]
        fit = 0.5 * np.einsum("cp,cp->c", found, towards) - 0.5 * np.linalg.slogdet(inner)[1]
        place = int(fit.argmax())
        if fit[place] > best:
            best, landing = float(fit[place]), Landing(places[place], knots @ found[place])
    return landing
