"""How far the places and forces that a list states are to be believed.

A list says how well it was made; what the presses show of it says more. All places err by one σ and
all forces by another: those that are stated times a scale, by the evidence of what is left between
labels and touches. One that lies far beyond is believed the less.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from models.arrays import F64, Mask
from models.bench.relevance import Posterior, scale_weights

_PARTS = slice(0, 2), slice(2, 3)  # place and force
_SCALES = np.geomspace(0.1, 10.0, 13)  # of how far most labels lie, or of σ where that is more
_PRIOR = np.exp(-0.5 * np.log(_SCALES) ** 2)  # a σ that nobody states may be e times off
_OUTLIER = 4.0  # standard deviations by which a press may miss its place or force
_OFFSET = 2.0  # standard deviations by which all places may lie to one side by chance
_MEDIAN = 0.9  # of the larger of one or two deviates, in standard deviations


class Shown(NamedTuple):
    """What N presses show of their labels, (N, 3) where nothing else is said: x, y and F.

    Attributes
    ----------
    off : float64
        Touch that the measurement alone shows, less its label.
    spread : float64
        Standard deviation of that touch.
    left : float64
        Most likely touch less its label.
    covariance : (3N, 3N) float64
        Of these touches, what is not known of the bench included.
    """

    off: F64
    spread: F64
    left: F64
    covariance: F64


class LabelErrors(NamedTuple):
    """Standard deviations (N, 3) of labels, and which (N,) lie far beyond those of the others."""

    sigmas: F64
    outliers: Mask


def label_errors(stated: F64, taken: F64, shown: Shown) -> LabelErrors:
    """Find the standard deviations of labels.

    Parameters
    ----------
    stated : (N, 3) float64
        Infinite where a label is unknown.
    taken : (N, 3) float64
        Those with which the touches were found.
    shown : Shown
    """
    sigmas, outliers = stated.copy(), np.zeros(len(stated), dtype=bool)
    for part in _PARTS:
        known, far = np.isfinite(stated[:, part]).all(axis=1), _far(shown, stated, part)
        typical = _typical(far[known])
        usual = known & (far <= _OUTLIER * typical)
        which = np.zeros(stated.shape, dtype=bool)
        which[usual, part] = True
        if which.any():
            scales = typical * _SCALES
            sigmas[:, part] *= _likely_scale(stated[which], taken[which], shown, which, scales)
        beyond = _far(shown, sigmas, part) / _OUTLIER
        sigmas[:, part] *= np.maximum(1.0, beyond)[:, None] ** 2
        outliers |= beyond > 1.0
    return LabelErrors(sigmas, outliers)


def _likely_scale(stated: F64, taken: F64, shown: Shown, which: Mask, scales: F64) -> float:
    """Geometric mean of the scales that are likely of some labels (n,), `which` (N, 3) of all."""
    scale = float(np.min(taken / stated))  # one that was believed less has a larger one
    unit, flat = taken / scale, which.ravel()
    covariance = shown.covariance[np.ix_(flat, flat)] / np.outer(unit, unit)
    found = Posterior(shown.left[which] / unit, covariance)
    weights = _PRIOR * scale_weights(found, np.arange(len(unit)), scale, scales)
    return float(np.exp(weights @ np.log(scales) / weights.sum()))


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
