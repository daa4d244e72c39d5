"""Touches from what a pattern measured, by the touch net: no search, a fixed amount of work."""

# SciPy states its types in part.
# pyright: reportUnknownArgumentType=false

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.special import chdtrc

from models.arrays import F32, F64, Mask
from models.compiled import njit
from models.estimate import Estimate, Result
from models.forward.linear import LinearForward
from models.touch_net.features import FAR, count_features, touch_features
from models.touch_net.maps import PLACES, Maps, grid, prepare_maps
from models.touch_net.network import COUNT, PROPOSE, SLOTS, TOUCH, Weights, run
from models.touch_net.posterior import Mixture, mixture
from models.touch_net.prior import MAX_TOUCHES, TouchRange
from models.touch_net.proposals import proposed_touches, slots
from models.touch_net.store import TouchNet, load_touch_net
from models.touch_net.unrolled import Fits, fit_all, fit_number, folded

SHIPPED_TOUCH_NET = Path(__file__).with_name("weights.npz")
"""The weights that come with the package."""

LIKELY = -5.0  # logarithm of how likely a number of touches must seem before it is fitted
UNUSUAL = 6.0  # standard deviations of χ² above its mean: what a fit does not explain
STRANGE = 5.0  # standard deviations that one touch more would explain of what is left
_SLACK = 0.15  # of the logarithm of a response beyond those of the training, or half their range


@dataclass(frozen=True, eq=False)
class NetTouches:
    """What the net says of one measurement.

    Attributes
    ----------
    probability : (5,) float64
        Of no touch, one, … four.
    touches : Mixture
        Where each may be, given the likeliest number; in the order of `estimate`.
    estimate : Estimate
        Means and covariances of these; UNRESOLVABLE where `reason` says so.
    reason : str
        Why the net does not know such a measurement, as a sentence; empty where it does.
    """

    probability: F64
    touches: Mixture
    estimate: Estimate
    reason: str = ""

    @property
    def count(self) -> int:
        """The likeliest number of touches."""
        return int(self.probability.argmax())

    @property
    def start(self) -> F64:
        """Touches (n, 3) from which a solver begins; none where the net does not know better."""
        if self.reason:
            return np.empty((0, 3))
        return np.column_stack([self.estimate.xy, self.estimate.force])


class Looked(NamedTuple):
    """How proposals fit a measurement.

    Attributes
    ----------
    fits : Fits
    features : (32,) float64
        See `count_features`.
    logits : (5,) float64
        Logarithms of how likely each number is by its fit alone.
    probability : (5,) float64
        The same after the net has looked at them.
    """

    fits: Fits
    features: F64
    logits: F64
    probability: F64


@dataclass(frozen=True, eq=False)
class TouchReader:
    """A touch net before a bench.

    Attributes
    ----------
    weights : dict of float32 arrays
        `propose0` reads the measurement itself: the maps are in it.
    touches : TouchRange
    forward : LinearForward
        With its whitening folded in.
    response : (256, m) float32
        Of norm 1, to 1 touch at each place of the maps.
    sharpness : float
    max_touches : int
    """

    weights: Weights
    touches: TouchRange
    forward: LinearForward
    response: F32
    sharpness: float
    max_touches: int

    def read(self, measured: F64) -> NetTouches:
        """Say what was measured, (m,) in units of its noise.

        Raises
        ------
        ValueError
            It has another length than the forward model, or is not finite.
        """
        if measured.shape != (self.response.shape[1],) or not np.isfinite(measured @ measured):
            raise ValueError(
                f"measurement of a touch net must be ({self.response.shape[1]},) finite numbers,"
                f" got {measured.shape}; whiten it by the forward model"
            )
        seen = self.look(measured)
        fits, probability = seen.fits, seen.probability
        number = int(probability.argmax())
        strange = self.strangeness(fits.residual[number - 1] if number else measured)
        found = self.scatter(fits, number, float(np.log(probability[number])), strange)
        reason = _reason(fits.chi2[number], len(measured) - 3 * number, strange)
        return _described(probability, fits, number, found, reason)

    def look(self, measured: F64) -> Looked:
        """Propose touches, fit them, and say how likely each number is."""
        out = run(self.weights, PROPOSE, "propose", measured.astype(np.float32))
        preliminary = log_probabilities(out[3 * SLOTS :].astype(np.float64))
        likely: Mask = preliminary[1:] > LIKELY
        likely[self.max_touches :] = False
        proposed = proposed_touches(out, self.touches)
        fits = fit_all(self.forward.table, measured, proposed, likely, self.touches)
        features = count_features(fits, preliminary, self.sharpness)
        change = run(self.weights, COUNT, "count", features.astype(np.float32))
        logits, probability = _numbers(fits.evidence, change, likely)
        return Looked(fits, features, logits, probability)

    def after(self, measured: F64, number: int, steps: int) -> F64:
        """Touches (n, 3) of which the number is known, after so many steps from their proposal."""
        out = run(self.weights, PROPOSE, "propose", measured.astype(np.float32))
        begun = proposed_touches(out, self.touches)[slots(number)]
        return fit_number(self.forward.table, measured, begun, self.touches, steps)

    def strangeness(self, residual: F64) -> float:
        """Largest part of a residual that one touch more would explain, standard deviations."""
        return float((self.response @ residual.astype(np.float32)).max())

    def scatter(self, fits: Fits, number: int, certainty: float, strange: float) -> Mixture:
        """Say where each of `number` touches may be about its fit."""
        if not number:
            return Mixture(np.empty((0, 1)), np.empty((0, 1, 3)), np.empty((0, 1, 3, 3)))
        features, factors = touch_features(fits, number, certainty, strange, self.touches.bounds)
        out = run(self.weights, TOUCH, "touch", features.astype(np.float32))
        return mixture(out, fits.touches[number - 1, :number], factors)


@njit(cache=True, nogil=True)
def log_probabilities(logits: F64) -> F64:
    """Logarithms of probabilities, of logits (n,) that are not normalised."""
    above = logits - logits.max()
    return above - np.log(np.exp(above).sum())


@njit(cache=True, nogil=True)
def _numbers(evidence: F64, change: F32, likely: Mask) -> tuple[F64, F64]:
    """Logits of each number of touches by its evidence, and its probability after a change."""
    logits = np.maximum(evidence - evidence.max(), -FAR)
    changed = logits + change
    for n in range(len(likely)):
        if not likely[n]:
            changed[n + 1] = -FAR
    return logits, np.exp(log_probabilities(changed))


def _reason(chi2: float, freedom: int, strange: float) -> str:
    """Say why touches do not explain a measurement; empty where they do."""
    above = (chi2 - freedom) / np.sqrt(2.0 * freedom)
    if above <= UNUSUAL and strange <= STRANGE:
        return ""
    return (
        f"the touch net leaves {max(above, strange):.0f} standard deviations unexplained: it has"
        " seen nothing like this frame"
    )


def _described(
    probability: F64, fits: Fits, number: int, found: Mixture, reason: str
) -> NetTouches:
    """Sort touches by x, and state their means and covariance."""
    size = 3 * number
    order, mean, covariance = (
        found.joint(fits.spread[number - 1, :size, :size]) if number else _NOBODY
    )
    touches = Mixture(found.weight[order], found.mean[order], found.factor[order])
    freedom = max(fits.residual.shape[1] - size, 1)
    chi2 = float(fits.chi2[number])
    result = Result.FOUND if number else Result.NO_TOUCH
    estimate = Estimate(
        xy=mean[:, :2],
        force=mean[:, 2],
        covariance=covariance,
        chi2=chi2,
        dof=freedom,
        p_value=float(chdtrc(freedom, chi2)),
        result=Result.UNRESOLVABLE if reason else result,
    )
    return NetTouches(probability, touches, estimate, reason)


_NOBODY = np.empty(0, np.int64), np.empty((0, 3)), np.empty((0, 0))
"""Order, means and covariance of no touch."""


def prepare_reader(
    net: TouchNet, forward: LinearForward, max_touches: int = MAX_TOUCHES
) -> TouchReader:
    """Prepare a net for a bench.

    Parameters
    ----------
    net : TouchNet
    forward : LinearForward
        Of the amplitudes of a pattern.
    max_touches : int
        Of them the net is asked for.

    Raises
    ------
    ValueError
        The net knows fewer touches, another plate, or no bench like this one.
    """
    if not 1 <= max_touches <= MAX_TOUCHES:
        raise ValueError(
            f"a touch net knows 1 to {MAX_TOUCHES} touches, got max_touches {max_touches}; set"
            f" touches.max_touches to {MAX_TOUCHES} or leave the net out"
        )
    known, size = net.touches.size, forward.plate.size
    if not np.allclose(known, size, rtol=0.01):
        raise ValueError(
            f"the touch net was trained on a plate of {known[0]:g} × {known[1]:g} mm, and this one"
            f" has {size[0]:g} × {size[1]:g} mm; train another by 'touchplate train' or leave the"
            " net out"
        )
    own = signature(forward, net.touches)
    outside = np.maximum(own - net.high, net.low - own)
    beyond = float((outside - np.maximum(_SLACK, 0.5 * (net.high - net.low))).max())
    if beyond > 0.0:
        raise ValueError(
            f"the touch net was trained on benches whose responses are all"
            f" {100 * np.expm1(float(outside.max())):.0f} % off this one's, somewhere on the plate;"
            " train another by 'touchplate train' or leave the net out"
        )
    return reader_of(net.weights, net.touches, know(forward, net.touches), max_touches)


class KnownForward(NamedTuple):
    """A forward model whose whitening is folded in, and its maps."""

    forward: LinearForward
    maps: Maps


def know(forward: LinearForward, touches: TouchRange) -> KnownForward:
    """Prepare what the net reads of a bench."""
    whole = folded(forward)
    return KnownForward(whole, prepare_maps(whole, touches))


def reader_of(
    weights: Weights, touches: TouchRange, known: KnownForward, max_touches: int = MAX_TOUCHES
) -> TouchReader:
    """Put weights before a bench."""
    response = known.forward.response(grid(touches))
    response /= np.linalg.norm(response, axis=1, keepdims=True)
    return TouchReader(
        weights=weights | _reading(weights, known.maps),
        touches=touches,
        forward=known.forward,
        response=response.astype(np.float32),
        sharpness=known.maps.sharpness,
        max_touches=max_touches,
    )


def _reading(weights: Weights, maps: Maps) -> Weights:
    """First layer of the proposals on a measurement itself."""
    matrix, bias = weights["propose0.weight"], weights["propose0.bias"]
    whole = matrix[:, : 2 * PLACES].astype(np.float64) @ maps.matrix.astype(np.float64)
    even = bias + maps.sharpness * matrix[:, -1]
    found = {"propose0.weight": whole, "propose0.bias": even}
    return {name: np.ascontiguousarray(array, dtype=np.float32) for name, array in found.items()}


def signature(forward: LinearForward, touches: TouchRange) -> F32:
    """Compute what tells benches apart, (257,): logarithms of responses, and of their mean."""
    norm = np.log(np.linalg.norm(forward.response(grid(touches)), axis=1))
    return np.append(norm - norm.mean(), norm.mean()).astype(np.float32)


@cache
def shipped_touch_net() -> TouchNet:
    """Return the net of the package, of the scene `touch-net`."""
    return load_touch_net(SHIPPED_TOUCH_NET)
