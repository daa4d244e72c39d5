"""Known presses: gain and place of every gauge, and how stiff the plate really is.

A gauge at p + δ with a gain g, on a plate softer by a factor s, reads for a touch of F N at x

    g s F b(x; p + δ) ≈ F (α b + β_x ∂b/∂p_x + β_y ∂b/∂p_y),   α = g s, β = α δ,

with b the influence that the model has. That is linear in three numbers a gauge, and 20 presses
give it 60 equations. What is known beforehand (gains are near to one another, gauges near to where
they should be) enters as a normal prior, whose mean α is fitted to all gauges first. A second
round begins at the places that the first found, since what is not linear in δ counts too (0.05 %).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import cast

import numpy as np

import fe
from fe import Adjoint
from rig.system.arrays import F64

STEP = 0.5  # mm to each side, over which an influence is differentiated in the place of its gauge
FEWEST = 5  # presses; fewer leave a gauge to its prior


@dataclass(frozen=True, eq=False)
class Presses:
    """What known presses say of gauges.

    Attributes
    ----------
    softness : float
        Strain of the real plate over that of the model, common to all gauges.
    gain : (M,) float64
        Of each gauge, over `softness`.
    shift : (M, 2) float64, mm
        Of each gauge from where the model has it.
    sigma_gain, sigma_shift : (M,), (M, 2) float64
        Standard deviations of the two.
    chi2, dof : float, int
        Of the fit; `chi2` near `dof` says that model and noise are as stated.
    influence : fe.Influence
        That of the real gauges on the real plate.
    """

    softness: float
    gain: F64
    shift: F64
    sigma_gain: F64
    sigma_shift: F64
    chi2: float
    dof: int
    influence: fe.Influence


def fit_presses(
    presses: tuple[fe.Touch, ...],
    strain: F64,
    influence: fe.Influence,
    sigma: float,
    gain_spread: float = 0.02,
    place_spread: float = 0.5,
) -> Presses:
    """Fit softness, gains and places of gauges to the strains of known presses.

    Parameters
    ----------
    presses : tuple of fe.Touch
    strain : (P, M, 3) float64, strain
        What the gauges read under each of them.
    influence : fe.Influence
        As the model has it.
    sigma : float, strain
        Standard deviation of a reading.
    gain_spread : float
        Standard deviation of the gains about their common value, as a fraction of it.
    place_spread : float, mm
        Standard deviation of a gauge's place along x and along y.

    Raises
    ------
    ValueError
        If there are too few presses or the strains do not fit presses and gauges.
    """
    count = len(influence.gauges)
    if len(presses) < FEWEST:
        raise ValueError(
            f"gauges need {FEWEST} known presses or more, got {len(presses)}; add some"
        )
    if strain.shape != (len(presses), count, 3):
        raise ValueError(
            f"strain of {len(presses)} presses on {count} gauges must be"
            f" ({len(presses)}, {count}, 3), got {strain.shape}"
        )
    touches = np.array([(press.x, press.y, press.force) for press in presses])
    spread = np.array([gain_spread, place_spread, place_spread])
    begin = np.zeros((count, 2))
    first = _round(influence, influence, begin, touches, strain, sigma, spread)
    places = np.clip(influence.gauges + first.shift, 0, influence.plate.size)
    seen = fe.influence(influence.plate, places, influence.mesh)
    return _round(influence, seen, first.shift, touches, strain, sigma, spread)


def _round(
    influence: fe.Influence,
    seen: fe.Influence,
    shift: F64,
    touches: F64,
    strain: F64,
    sigma: float,
    spread: F64,
) -> Presses:
    """Fit about places that lie `shift` from those of the model, where the influence is `seen`."""
    parts = (seen, *_by_place(seen))
    unit = [part.strain(touches[:, :2]) * touches[:, 2, None, None] for part in parts]
    softness = float(np.vdot(unit[0], strain) / np.vdot(unit[0], unit[0]))
    fit = _fit(np.stack(unit, axis=-1) / sigma, strain / sigma, softness, spread, shift)
    return Presses(
        softness=softness,
        gain=fit.numbers[:, 0] / softness,
        shift=shift + fit.numbers[:, 1:] / fit.numbers[:, :1],
        sigma_gain=fit.sigma[:, 0] / softness,
        sigma_shift=fit.sigma[:, 1:] / fit.numbers[:, :1],
        chi2=fit.chi2,
        dof=strain.size - fit.numbers.size,
        influence=_with_values(influence, _corrected(parts, fit.numbers)),
    )


@dataclass(frozen=True, eq=False)
class _Fit:
    """α, β_x, β_y of every gauge (M, 3), their standard deviations, and χ² of the fit."""

    numbers: F64
    sigma: F64
    chi2: float


def _fit(unit: F64, measured: F64, softness: float, spread: F64, shift: F64) -> _Fit:
    """Fit every gauge for itself: `unit` (P, M, 3, 3) by its numbers, `measured` (P, M, 3), σ 1.

    `spread` (3,) is that of gain and places beforehand; `shift` (M, 2) was taken out before.
    """
    count = measured.shape[1]
    design = unit.transpose(1, 0, 2, 3).reshape(count, -1, 3)
    values = measured.transpose(1, 0, 2).reshape(count, -1)
    weight = (softness * spread) ** -2.0
    normal = design.transpose(0, 2, 1) @ design + np.diag(weight)
    right = np.einsum("mek,me->mk", design, values)
    right += weight * softness * np.column_stack([np.ones(count), -shift])
    numbers = cast(F64, np.linalg.solve(normal, right[..., None]))[..., 0]
    sigma = np.sqrt(np.diagonal(np.linalg.inv(normal), axis1=1, axis2=2))
    left: F64 = values - np.einsum("mek,mk->me", design, numbers)
    return _Fit(numbers, sigma, float(np.vdot(left, left)))


def _by_place(influence: fe.Influence) -> tuple[fe.Influence, fe.Influence]:
    """Differentiate an influence by the x and y of its gauges, per mm."""
    derivatives: list[fe.Influence] = []
    for axis in (0, 1):
        step = np.zeros(2)
        step[axis] = STEP
        low, high = (
            np.clip(influence.gauges + sign * step, 0, influence.plate.size) for sign in (-1, 1)
        )
        before, after = (fe.influence(influence.plate, at, influence.mesh) for at in (low, high))
        apart = np.repeat((high - low)[:, axis], 3)
        values = (after.adjoint.values - before.adjoint.values) / apart
        derivatives.append(_with_values(influence, values))
    return derivatives[0], derivatives[1]


def _corrected(parts: tuple[fe.Influence, ...], numbers: F64) -> F64:
    """Values of the influence of the real gauges."""
    weights = np.repeat(numbers, 3, axis=0).T
    values = [weight * part.adjoint.values for weight, part in zip(weights, parts, strict=True)]
    return np.sum(values, axis=0)


def _with_values(influence: fe.Influence, values: F64) -> fe.Influence:
    adjoint = Adjoint(influence.plate, influence.mesh, values)
    return replace(influence, adjoint=adjoint)
