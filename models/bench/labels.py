"""How far the places and forces that a list states are to be believed.

A list says how well it was made; what the presses show of it says more. All places err by one σ and
all forces by another, found by expectation maximisation from what is left between labels and
touches; what is stated counts as one more label. One that lies far beyond is believed the less.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from models.arrays import F64, Mask

_PARTS = slice(0, 2), slice(2, 3)  # place and force
_STATED = 1.0  # labels that a stated σ counts as: a usual one may be off by a factor of two
_OUTLIER = 4.0  # standard deviations by which a press may miss its place or force
_OFFSET = 2.0  # standard deviations by which all places may lie to one side by chance
_MEDIAN = 0.9  # of the larger of one or two deviates, in standard deviations


class Shown(NamedTuple):
    """What N presses show of their labels, each (N, 3): x, y and F.

    Attributes
    ----------
    off : float64
        Touch that the measurement alone shows, less its label.
    spread : float64
        Standard deviation of that touch.
    left : float64
        Most likely touch less its label.
    variance : float64
        Of that touch, what is not known of the bench included.
    """

    off: F64
    spread: F64
    left: F64
    variance: F64


class LabelErrors(NamedTuple):
    """Standard deviations (N, 3) of labels, and which (N,) lie far beyond those of the others."""

    sigmas: F64
    outliers: Mask


def label_errors(stated: F64, shown: Shown) -> LabelErrors:
    """Find the standard deviations of labels from those stated (N, 3), infinite where unknown."""
    sigmas, outliers = stated.copy(), np.zeros(len(stated), dtype=bool)
    for part in _PARTS:
        known, far = np.isfinite(stated[:, part]).all(axis=1), _far(shown, stated, part)
        usual = known & (far <= _OUTLIER * _typical(far[known]))
        sizes = ((shown.left**2 + shown.variance) / stated**2)[usual, part]
        sigmas[:, part] *= np.sqrt((_STATED + sizes.sum()) / (_STATED + sizes.size))
        beyond = _far(shown, sigmas, part) / _OUTLIER
        sigmas[:, part] *= np.maximum(1.0, beyond)[:, None] ** 2
        outliers |= beyond > 1.0
    return LabelErrors(sigmas, outliers)


def common_offset(sigmas: F64, shown: Shown, sure: F64) -> F64:
    """Find how far the places of a list lie to one side of those that presses show, (2,) mm.

    Presses show a touch where the plate bends as it would there, and a plate that differs from its
    model a little in every press shows all of them beside themselves; labels that err by chance lie
    on both sides.

    Parameters
    ----------
    sigmas : (N, 3) float64
        Of the labels, infinite where nothing is known.
    shown : Shown
    sure : (2,) float64, mm
        Standard deviation of where the bench has all touches.

    Returns
    -------
    (2,) float64, mm
        Labels less touches along x and y; 0 where chance explains it.
    """
    weight = 1.0 / (sigmas**2 + shown.spread**2)[:, :2]
    total = np.maximum(weight.sum(axis=0), 1e-12)
    offset = -(weight * shown.off[:, :2]).sum(axis=0) / total
    return np.where(offset**2 > _OFFSET**2 * (1.0 / total + sure**2), offset, 0.0)


def _far(shown: Shown, sigmas: F64, part: slice) -> F64:
    """How many standard deviations each label lies from what is measured, (N,)."""
    expected = np.hypot(shown.spread, sigmas)
    return np.max((np.abs(shown.off) / expected)[:, part], axis=1)


def _typical(far: F64) -> float:
    """How many times as far as is stated most labels lie, 1 at least."""
    return max(1.0, float(np.median(far)) / _MEDIAN) if len(far) else 1.0
