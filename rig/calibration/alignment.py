"""Known presses on the whole pattern: where touches really are, and how hard.

What a camera that is a little off, a plate that is a little thicker and a lens that is not quite
known do to estimated touches is smooth: an affine map of their places and a factor of their forces.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

import fe
from models.estimate import Estimate

FEWEST = 6  # presses: an affine map has as many numbers as three places, and an error is wanted
FAR = 4.0  # robust standard deviations beyond which a press was a slip


@dataclass(frozen=True, eq=False)
class Alignment:
    """From estimated to true touches.

    Attributes
    ----------
    matrix : (2, 3) float64, mm
        Affine map of places.
    gain : float
        True over estimated force.
    error : float, mm
        RMS distance of the presses after it, each left out of its own fit.
    error_force : float
        RMS error of the force after it, as a share of it.
    sigma_gain : float
        Standard deviation of `gain`.
    slips : tuple of int
        Presses that were left out because they do not fit the others.
    """

    matrix: NDArray[np.float64]
    gain: float
    error: float
    error_force: float
    sigma_gain: float
    slips: tuple[int, ...]

    def apply(self, estimate: Estimate) -> Estimate:
        """Mend places, forces and covariance of an estimate."""
        count = estimate.count
        block = np.zeros((3, 3))
        block[:2, :2], block[2, 2] = self.matrix[:, :2], self.gain
        turn = np.kron(np.eye(count), block)
        return replace(
            estimate,
            xy=estimate.xy @ self.matrix[:, :2].T + self.matrix[:, 2],
            force=self.gain * estimate.force,
            covariance=turn @ estimate.covariance @ turn.T,
        )


def align(presses: tuple[fe.Touch, ...], found: NDArray) -> Alignment:
    """Fit the map from touches that were found, (P, 3) x, y, F, to those that were pressed.

    Raises
    ------
    ValueError
        If there are fewer than `FEWEST` presses, or they do not span the plate.
    """
    if len(presses) < FEWEST:
        raise ValueError(
            f"an alignment needs {FEWEST} known presses or more, got {len(presses)}; add some"
        )
    true = np.array([(press.x, press.y, press.force) for press in presses])
    kept = np.ones(len(true), dtype=bool)
    for _ in range(2):
        away = np.linalg.norm(true[:, :2] - _design(found) @ _fit(found[kept], true[kept]), axis=1)
        kept = away <= FAR * max(1.4826 * float(np.median(away)), 1e-9)
    design, wanted = _design(found[kept]), true[kept]
    matrix = _fit(found[kept], wanted)
    # A press left out of its own fit lies further by 1 / (1 - h), h its leverage.
    leverage = np.einsum("pi,pi->p", design @ np.linalg.inv(design.T @ design), design)
    left = (wanted[:, :2] - design @ matrix) / (1.0 - leverage)[:, None]
    ratios = wanted[:, 2] / found[kept, 2]
    gain = float(np.median(ratios))
    scatter = float(np.std(ratios, ddof=1))
    return Alignment(
        matrix=matrix.T,
        gain=gain,
        error=float(np.sqrt(np.square(left).sum(axis=1).mean())),
        error_force=scatter / gain,
        sigma_gain=1.2533 * scatter / float(np.sqrt(len(ratios))),  # of a median
        slips=tuple(np.flatnonzero(~kept).tolist()),
    )


def _design(found: NDArray) -> NDArray[np.float64]:
    return np.column_stack([found[:, :2], np.ones(len(found))])


def _fit(found: NDArray, true: NDArray) -> NDArray[np.float64]:
    """Affine map (3, 2) by least squares."""
    solved, _, rank, _ = np.linalg.lstsq(_design(found), true[:, :2], rcond=1e-6)
    if rank < 3:
        raise ValueError("known presses lie on one line; spread them over the plate")
    return np.asarray(solved, dtype=np.float64)
