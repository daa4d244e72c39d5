"""What all frames so far say of one touch: where it is, how hard it presses and how fast it moves.

Interacting multiple models (Blom & Bar-Shalom 1988; Bar-Shalom, Li & Kirubarajan 2001, 11.6): a
finger rests, or taps where it is, or slides. Each is a Kalman filter of x, y, vx, vy and F, and the
frames say which of them holds. A finger that rests so is averaged, and one that slides is not held
back.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.linalg import expm

from rig.system.arrays import F64

STILL, TAPPING, GLIDING, SLIDING = range(4)

# Changes a second from one to another: a rest lasts about a second, a tap some tenths of one.
_RATES = np.array(
    [
        [-2.0, 0.6, 0.7, 0.7],
        [4.0, -6.0, 1.0, 1.0],
        [1.5, 0.5, -4.0, 2.0],
        [1.5, 0.5, 2.0, -4.0],
    ]
)
_FIRST = np.array([0.3, 0.3, 0.2, 0.2])  # a finger that lands
# What wanders in a second, standard deviations: the place of a finger that does not slide, and the
# force of each.
_REST_PLACE = 0.05  # mm
_FORCES = np.array([0.05, 15.0, 1.0, 3.0])  # N
# Of those that slide: how fast they gain or lose speed, mm/s² (a stroke of 100 mm takes half a
# second), and how fast they set off, mm/s.
_HASTE = np.array([0.0, 0.0, 150.0, 5000.0])
_QUICK = np.array([0.0, 0.0, 15.0, 200.0])
# Speeds of a glide and of a slide, mm/s, and for how long one speed counts as one, s.
_USUAL, _PACE = np.array([25.0, 200.0]), 0.1
_SEEN = np.array([0, 1, 4])  # x, y and F of the five
_SPEED = slice(2, 4)
# No frame says more than this of a place, mm, and of a force, N.
_FLOOR = np.diag([0.01, 0.01, 0.002]) ** 2
_STARTS = np.square(_QUICK)[:, None, None] * np.eye(2)


@dataclass(frozen=True, eq=False)
class TouchFilter:
    """Posterior of a touch as a mixture of four Gaussians.

    Attributes
    ----------
    weights : (4,) float64
        Probability that it rests, taps, glides, slides.
    means : (4, 5) float64, mm, mm/s and N
        x, y, vx, vy, F in each case.
    covariances : (4, 5, 5) float64
    """

    weights: F64
    means: F64
    covariances: F64

    @property
    def mean(self) -> F64:
        """Posterior mean of x, y, vx, vy, F: (5,) float64."""
        return self.weights @ self.means

    @property
    def covariance(self) -> F64:
        """Posterior covariance of the same, (5, 5) float64."""
        away = self.means - self.mean
        return np.einsum("m,mij->ij", self.weights, self.covariances) + np.einsum(
            "m,mi,mj->ij", self.weights, away, away
        )

    @property
    def seen(self) -> tuple[F64, F64]:
        """Posterior mean (3,) and covariance (3, 3) of x, y, F, as an estimate of a frame is."""
        return self.mean[_SEEN], self.covariance[np.ix_(_SEEN, _SEEN)]

    def distance(self, place: F64, spread: F64) -> float:
        """Squared Mahalanobis distance of a place (2,) mm with covariance (2, 2) mm².

        That of whatever it may be doing that explains the place best: a finger at rest that sets
        off is where a slide takes it, however improbable that was.
        """
        away = place - self.means[:, :2]
        whole = self.covariances[:, :2, :2] + spread
        solved = np.linalg.solve(whole, away[..., None])[..., 0]
        return float(np.einsum("mi,mi->m", away, solved).min())

    def predict(self, step: float) -> TouchFilter:
        """Carry it on by some time, s: what it does may change, and it moves on."""
        change = _transition(round(step, 6))
        joint = self._by_speed(step)[:, None] * change
        weights = joint.sum(axis=0)
        mixing = joint / weights
        starts = _setting_off(self.covariances)
        means = np.einsum("ij,ik->jk", mixing, self.means)
        away = self.means[:, None] - means[None]
        spread = starts + np.einsum("ijk,ijl->ijkl", away, away)
        covariances = np.einsum("ij,ijkl->jkl", mixing, spread)
        carry, noise = _motion(round(step, 6))
        return TouchFilter(
            weights,
            np.einsum("mij,mj->mi", carry, means),
            carry @ covariances @ carry.swapaxes(1, 2) + noise,
        )

    def _by_speed(self, step: float) -> F64:
        """Probabilities after the speeds of those that move: a glide is slow, a slide is not."""
        speed, usual = np.square(self.means[GLIDING:, _SPEED]).sum(axis=1), _USUAL**2
        fit = -0.5 * speed / usual - np.log(usual)
        weights = self.weights.copy()
        both = weights[GLIDING:].sum()
        weights[GLIDING:] *= np.exp((fit - fit.max()) * min(step / _PACE, 1.0))
        weights[GLIDING:] *= both / weights[GLIDING:].sum()
        return weights

    def update(self, seen: F64, spread: F64) -> TouchFilter:
        """Correct it by what a frame says.

        Parameters
        ----------
        seen : (3,) float64, mm, mm, N
            x, y, F.
        spread : (3, 3) float64
            Covariance of these.
        """
        inner = self.covariances[:, _SEEN[:, None], _SEEN] + spread + _FLOOR
        gain = np.linalg.solve(inner, self.covariances[:, _SEEN]).swapaxes(1, 2)
        away = seen - self.means[:, _SEEN]
        means = self.means + np.einsum("mij,mj->mi", gain, away)
        covariances = self.covariances - gain @ self.covariances[:, _SEEN]
        covariances = 0.5 * (covariances + covariances.swapaxes(1, 2))
        distance = np.einsum("mi,mi->m", away, np.linalg.solve(inner, away[..., None])[..., 0])
        fit = np.log(self.weights) - 0.5 * (distance + np.linalg.slogdet(inner)[1])
        weights = np.exp(fit - fit.max()) + 1e-12
        return TouchFilter(weights / weights.sum(), means, covariances)


def landed(seen: F64, spread: F64) -> TouchFilter:
    """Begin with x, y, F (3,) of the first frame and their covariance (3, 3)."""
    means, covariances = np.zeros((4, 5)), np.zeros((4, 5, 5))
    means[:, _SEEN] = seen
    covariances[:, _SEEN[:, None], _SEEN] = spread + _FLOOR
    covariances[:, _SPEED, _SPEED] = _STARTS
    return TouchFilter(_FIRST, means, covariances)


def _setting_off(covariances: F64) -> F64:
    """Covariances (4, 4, 5, 5) from one to another: who begins to move may do so at any speed."""
    starts = np.repeat(covariances[:, None], 4, axis=1)
    starts[:GLIDING, :, _SPEED, _SPEED] += _STARTS
    return starts


@lru_cache(maxsize=256)
def _transition(step: float) -> F64:
    """Probabilities (4, 4) of going from one to another within a time."""
    return np.asarray(expm(_RATES * step), dtype=np.float64)


@lru_cache(maxsize=256)
def _motion(step: float) -> tuple[F64, F64]:
    """Matrices (4, 5, 5) that carry each on, and the noise that they gather."""
    carry = np.repeat(np.eye(5)[None], 4, axis=0)
    carry[:GLIDING, 2, 2] = carry[:GLIDING, 3, 3] = 0.0
    carry[GLIDING:, 0, 2] = carry[GLIDING:, 1, 3] = step
    # White acceleration that is constant over a step (Bar-Shalom, 6.3.2).
    push = np.array([[step**2 / 2, 0], [0, step**2 / 2], [step, 0], [0, step], [0, 0]])
    noise = np.square(_HASTE)[:, None, None] * (push @ push.T)
    noise[:GLIDING, :2, :2] = _REST_PLACE**2 * step * np.eye(2)
    noise[:, 4, 4] = np.square(_FORCES) * step
    return carry, noise
