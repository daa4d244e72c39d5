"""How far each cause is to be reckoned with: its prior is as wide as what is measured shows.

A bench is built with care, and what is wrong with it is one thing or two, not all that may be. So
the standard deviation of each cause is that of its prior times a scale which is not known: anything
from a thirtieth to twice, and 1 in the mean square. Where a measurement says nothing of a cause, it
stays as uncertain as stated; where one shows a cause to be absent, all of its numbers are small,
those among them too that are hardly measured by themselves.

References
----------
MacKay 1994, ASHRAE Trans. 100, 1053; Neal 1996, Bayesian Learning for Neural Networks, §4.3
(automatic relevance determination).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from models.arrays import F64, Mask
from models.bench.bench import NAMES
from models.bench.causes import CAUSES

SCALES = np.array([0.03, 0.1, 0.3, 1.0, 2.0])
"""Of the standard deviations of a cause, all equally likely; their mean square is 1."""
_SWEEPS = 8
_SETTLED = 0.05  # change of the logarithm of any scale
_MEASURED = "the thickness"  # which a caliper states with its tolerance: nothing that goes wrong
_SAME = 1e-9
Numbers = NDArray[np.intp]


class Information(NamedTuple):
    """What a measurement says of P numbers, in standard deviations of their prior.

    Attributes
    ----------
    matrix : (P, P) float64
        Fisher's: all else that is unknown is eliminated, the prior left out.
    towards : (P,) float64
        Its product with the numbers that fit best without a prior.
    """

    matrix: F64
    towards: F64


class Posterior(NamedTuple):
    """Mean (P,) and covariance (P, P) of numbers, in standard deviations of their prior."""

    mean: F64
    covariance: F64


def causes_among(free: Mask, measured: Sequence[str] = ()) -> list[Numbers]:
    """Say which of the numbers that are free, (63,), belong to one cause each.

    What was measured beforehand is nothing that goes wrong, and belongs to none.
    """
    place, guessed = np.cumsum(free) - 1, free & [name not in measured for name in NAMES]
    members = [
        place[[k for k, name in enumerate(NAMES) if name in names and guessed[k]]]
        for cause, names in CAUSES.items()
        if cause != _MEASURED
    ]
    return [numbers for numbers in members if len(numbers)]


def posterior(information: Information, scales: F64) -> Posterior:
    """Combine information with a prior of as many times its standard deviations, (P,)."""
    inner = np.eye(len(scales)) + scales[:, None] * information.matrix * scales
    covariance = scales[:, None] * np.linalg.inv(inner) * scales
    return Posterior(covariance @ information.towards, covariance)


def likely_scales(information: Information, causes: list[Numbers]) -> F64:
    """Find the scale of each number (P,): geometric mean of what is likely of its cause.

    One cause after the other, by the evidence for each scale with its numbers integrated out and
    the other causes as they are, until none changes any more.
    """
    scales = np.ones(len(information.towards))
    for _ in range(_SWEEPS):
        before, found = scales.copy(), posterior(information, scales)
        for numbers in causes:
            was = float(scales[numbers[0]])
            likely = np.exp(scale_weights(found, numbers, was) @ np.log(SCALES))
            mean, covariance = _rescaled(found, numbers, was, float(likely), np.eye(len(scales)))
            found = Posterior(found.mean + mean, found.covariance + covariance)
            scales[numbers] = likely
        if np.abs(np.log(scales / before)).max() < _SETTLED:
            break
    return scales


def over_scales(
    information: Information, causes: list[Numbers], scales: F64, onto: F64
) -> Posterior:
    """Mean and covariance of numbers of which the scales are not known, projected.

    To that at the likely scales comes what each cause changes over its own, the others as likely.

    Parameters
    ----------
    information : Information
    causes : list of (n,) int
    scales : (P,) float64
        See `likely_scales`.
    onto : (q, P) float64
        What is wanted of the numbers.

    Returns
    -------
    Posterior
        (q,) and (q, q).
    """
    found = posterior(information, scales)
    mean, covariance = onto @ found.mean, onto @ found.covariance @ onto.T
    for numbers in causes:
        was = float(scales[numbers[0]])
        weights = scale_weights(found, numbers, was)
        changes = [_rescaled(found, numbers, was, scale, onto) for scale in SCALES.tolist()]
        means = np.array([change.mean for change in changes])
        away = means - weights @ means
        mean = mean + weights @ means
        covariance = covariance + (weights[:, None] * away).T @ away
        covariance += sum(
            weight * change.covariance for weight, change in zip(weights, changes, strict=True)
        )
    return Posterior(mean, covariance)


def scale_weights(found: Posterior, numbers: Numbers, scale: float, scales: F64 = SCALES) -> F64:
    """Probability of each of some scales, all equally likely beforehand, for numbers of one cause.

    They were found with a prior of `scale` times its standard deviations.
    """
    precision = np.linalg.inv(found.covariance[np.ix_(numbers, numbers)])
    values, turned = np.linalg.eigh(precision)
    shown = np.maximum(values - scale**-2, 0.0)  # what is measured, without the prior
    towards = turned.T @ (precision @ found.mean[numbers])
    return evident_scales(shown, towards, scales)


def evident_scales(shown: F64, towards: F64, scales: F64) -> F64:
    """Probability of each of some scales, all equally likely beforehand, of numbers by themselves.

    Parameters
    ----------
    shown : (n,) float64
        Information on each number, in standard deviations of its prior, that left out.
    towards : (n,) float64
        Its product with the number that fits best.
    scales : (S,) float64
    """
    squares = scales[:, None] ** 2
    grown = 1.0 + squares * shown
    evidence = 0.5 * (squares * towards**2 / grown - np.log(grown)).sum(axis=1)
    likelihood = np.exp(evidence - evidence.max())
    return likelihood / likelihood.sum()


def _rescaled(
    found: Posterior, numbers: Numbers, before: float, after: float, onto: F64
) -> Posterior:
    """By how much mean and covariance change, projected (q, P), where a cause has another scale."""
    stiffer = after**-2 - before**-2
    if abs(stiffer) < _SAME * before**-2:
        return Posterior(np.zeros(len(onto)), np.zeros((len(onto), len(onto))))
    own = found.covariance[np.ix_(numbers, numbers)]
    inverse = np.linalg.inv(np.eye(len(numbers)) / stiffer + own)
    along = onto @ found.covariance[:, numbers]
    return Posterior(-along @ (inverse @ found.mean[numbers]), -along @ inverse @ along.T)
