"""Known presses on the whole pattern: where touches really are, and how hard.

What a camera that is a little off, a plate that is a little thicker and a lens that is not quite
known do to estimated touches is smooth: an affine map of their places and a factor of their forces.
A bench that is right needs neither, and a map that is fitted to noise makes it worse: so the map
has no more terms than the presses prove.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

import fe
from models import Estimate
from rig.live.evidence import Equations
from rig.system.arrays import F64, Mask

FEWEST = 6  # presses: an affine map has as many numbers as three places, and an error is wanted
STRETCHES = {2: "shift", 4: "turn and scale", 6: "shear"}
"""Numbers of ever freer maps, and what each adds to the one before."""


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
        RMS error of the force after it, as a fraction of it.
    sigma_gain : float
        Standard deviation of `gain`.
    slips : tuple of int
        Presses that were left out because they do not fit the others.
    terms : tuple of str
        What the presses prove; empty where the bench is right as it is.
    """

    matrix: F64
    gain: float
    error: float
    error_force: float
    sigma_gain: float
    slips: tuple[int, ...]
    terms: tuple[str, ...] = ()

    def correct(self, touches: F64) -> F64:
        """Correct touches x, y, F, (n, 3) mm, mm, N."""
        places = touches[:, :2] @ self.matrix[:, :2].T + self.matrix[:, 2]
        return np.column_stack([places, self.gain * touches[:, 2]])

    def apply(self, estimate: Estimate) -> Estimate:
        """Correct places, forces and covariance of an estimate."""
        count = estimate.count
        block = np.zeros((3, 3))
        block[:2, :2], block[2, 2] = self.matrix[:, :2], self.gain
        turn, systematic = np.kron(np.eye(count), block), estimate.systematic
        corrected = self.correct(np.column_stack([estimate.xy, estimate.force]))
        return replace(
            estimate,
            xy=corrected[:, :2],
            force=corrected[:, 2],
            covariance=turn @ estimate.covariance @ turn.T,
            systematic=None if systematic is None else turn @ systematic @ turn.T,
        )


def align(presses: tuple[fe.Touch, ...], found: F64, sigma: F64) -> Alignment:
    """Fit the map from touches that were found to those that were pressed.

    Every press weighs by its own variance and one that all share, which is how well fingers and
    model do: it is as large as makes the freest map fit (R. C. Paule and J. Mandel, "Consensus
    values and weighting factors", 1982). Of the maps in `STRETCHES` and of a factor of the force
    only what an F-test against that scatter proves is taken.

    Parameters
    ----------
    presses : tuple of fe.Touch
    found : (P, 3) float64, mm, mm, N
        x, y, F.
    sigma : (P, 3) float64, mm, mm, N
        Their standard deviations, of one frame: presses that are averages may scatter less.

    Raises
    ------
    ValueError
        If fewer than `FEWEST` presses agree, they do not span the plate, or something has no σ.
    """
    if len(presses) < FEWEST:
        raise ValueError(
            f"an alignment needs {FEWEST} known presses or more, got {len(presses)}; add some"
        )
    if not (sigma > 0).all():
        raise ValueError(f"sigma of a press must be positive, got {sigma.min():g}; state its noise")
    true = np.array([(press.x, press.y, press.force) for press in presses])
    middle = found[:, :2].mean(axis=0)
    if np.linalg.matrix_rank(found[:, :2] - middle, 1e-6 * np.abs(found[:, :2]).max()) < 2:
        raise ValueError("known presses lie on one line; spread them over the plate")
    places = Equations(_maps(found[:, :2] - middle), true[:, :2] - found[:, :2], sigma[:, :2])
    forces = Equations(
        np.ones((len(true), 1, 1)),
        np.log(true[:, 2:] / found[:, 2:]),
        sigma[:, 2:] / found[:, 2:],
    )
    kept = places.agreeing() & forces.agreeing()
    if kept.sum() < FEWEST:
        raise ValueError(
            f"only {kept.sum()} of {len(kept)} known presses agree, and {FEWEST} are needed; press"
            " again"
        )
    return _alignment(places.of(kept).fitting(), forces.of(kept).fitting(), middle, kept)


def _alignment(places: Equations, forces: Equations, middle: F64, kept: Mask) -> Alignment:
    stretches, pushed = places.proven(tuple(STRETCHES)), forces.proven((1,))
    shift = np.zeros(6)
    shift[:stretches] = places.first(stretches).fit()
    turn = np.eye(2) + np.array([[shift[2] + shift[4], shift[5] - shift[3]],
                                 [shift[5] + shift[3], shift[2] - shift[4]]])  # fmt: skip
    terms = [name for numbers, name in STRETCHES.items() if numbers <= stretches]
    gain = float(np.exp(forces.fit()[0])) if pushed else 1.0
    return Alignment(
        matrix=np.column_stack([turn, shift[:2] + middle - turn @ middle]),
        gain=gain,
        error=places.first(stretches).left_out(),
        error_force=forces.first(pushed).left_out(),
        sigma_gain=gain * float(np.sqrt(forces.scatter / forces.normal[0, 0])),
        slips=tuple(np.flatnonzero(~kept).tolist()),
        terms=(*terms, *(["force"] if pushed else [])),
    )


def _maps(xy: F64) -> F64:
    """Motion (P, 2, 6) of places about their middle by the terms of `STRETCHES`, in their order."""
    x, y = xy.T
    one, none = np.ones(len(xy)), np.zeros(len(xy))
    along = [one, none, x, -y, x, y]
    across = [none, one, y, x, -y, x]
    return np.stack([np.stack(along, 1), np.stack(across, 1)], axis=1)
