"""What fixed places of the plate measure under large touches, with derivatives, at a live pace."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from math import inf
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from fe.arrays import F64
from fe.linear.adjoint import Adjoint
from fe.plate.checks import array, number
from fe.plate.plate import Plate
from fe.reduced.equilibrium import Balance, Settled
from fe.reduced.result import Trust

if TYPE_CHECKING:
    from fe.reduced.reduced import Reduced

_RECENT = 8
"""Readings kept: an estimator asks for the state that it ended in, and began from, again."""


class Reading(NamedTuple):
    """What M places measure under T touches.

    Attributes
    ----------
    values : (M, 3) float64, read only
        Strain exx, eyy, exy, or displacement u, v, w in mm.
    jacobian : (M, 3, T, 3) float64, read only
        Their derivatives by x, y in mm and F in N of each touch.
    stretch : float, (N mm)^½
        Root of twice the energy by which the plate is stretched.
    result : Trust
    """

    values: F64
    jacobian: F64
    stretch: float
    result: Trust


@dataclass(frozen=True, eq=False)
class ReducedReadings:
    """M fixed places of a reduced plate, ready to be read.

    Each of 3 M channels is linear in all that makes up a state.

    Attributes
    ----------
    reduced : Reduced
    moving : Adjoint
        Of 3 M times A channels: each channel for each function that moves with a touch.
    fixed : (3 M, n) float64
        Channels of the fixed shapes.
    plane : (3 M, M' + U) float64
        Channels of the stresses and of the displacements in the plane.
    sheet : (2 M, 3 Q) float64 or None
        What the displacements in the plane leave of u and v, by the strain at the samples of the
        sheet; None where nothing in the plane is read but what `plane` holds.
    """

    reduced: Reduced
    moving: Adjoint
    fixed: F64
    plane: F64
    sheet: F64 | None = None

    _last: dict[int, Settled] = field(default_factory=dict[int, Settled], repr=False)

    @property
    def plate(self) -> Plate:
        """The plate."""
        return self.reduced.plate

    def read(self, xy: ArrayLike, force: ArrayLike, radius: float = 0.0) -> Reading:
        """Measure under touches.

        Parameters
        ----------
        xy : (T, 2) array_like, mm
            Places of the touches.
        force : (T,) array_like, N
            Positive into the plate.
        radius : float, mm
            Of their discs; 0 for points.

        Raises
        ------
        ValueError
            A touch, or a part of its disc, lies outside the plate, there is none, or it has no
            force or radius that makes sense.
        """
        xy = self.plate.points(xy, "touch")
        force = _checked(force, len(xy))
        return self._recent(xy.tobytes(), force.tobytes(), _radius(radius))

    @cached_property
    def _recent(self) -> Callable[[bytes, bytes, float], Reading]:
        return lru_cache(_RECENT)(self._read)

    def _read(self, places: bytes, forces: bytes, radius: float) -> Reading:
        xy, force = np.frombuffer(places).reshape(-1, 2), np.frombuffer(forces)
        radii, last = np.full(len(xy), radius), self._last.get(len(xy))
        state = self.reduced.balance(xy, force, radii, last)
        self._last[len(xy)] = Settled(xy, force, radii, state)
        n, channels = self.fixed.shape[1], len(self.fixed)
        read, gradient = self.moving.read_and_gradient(xy, radius)
        moving = read.reshape(len(xy), channels, -1)
        slopes = gradient.reshape(*moving.shape, 2)
        weights = state.weights[n:].reshape(len(xy), -1)
        by_weights = np.concatenate([self.fixed, *moving], axis=1)
        plane = np.concatenate([state.stress, state.drift])
        plane_by = np.concatenate([state.stress_by, state.drift_by])
        values = by_weights @ state.weights + self.plane @ plane
        jacobian = by_weights @ state.weights_by + self.plane @ plane_by
        jacobian = jacobian.reshape(channels, len(xy), 3)
        jacobian[:, :, :2] += np.einsum("tcad,ta->ctd", slopes, weights)
        if self.sheet is not None:
            self._add_sheet(self.sheet, (xy, radius), state, (values, jacobian))
        values.flags.writeable = jacobian.flags.writeable = False
        jacobian, stretch = jacobian.reshape(-1, 3, len(xy), 3), float(np.linalg.norm(state.stress))
        return Reading(values.reshape(-1, 3), jacobian, stretch, self.reduced.trust(xy, state))

    def _add_sheet(
        self, sheet: F64, touches: tuple[F64, float], state: Balance, found: tuple[F64, F64]
    ) -> None:
        """Add to values and Jacobian what the fields in the plane leave."""
        strain, strain_by = self.reduced.sheet.stretched(
            self.plate, self.reduced.mesh, touches, (state.weights, state.weights_by)
        )
        values, jacobian = (part.reshape(len(sheet) // 2, 3, -1) for part in found)
        values[:, :2, 0] += (sheet @ strain).reshape(-1, 2)
        jacobian[:, :2] += (sheet @ strain_by).reshape(len(sheet) // 2, 2, -1)


def _checked(given: ArrayLike, touches: int) -> F64:
    """Check forces (T,) N, one for each touch."""
    force = array(given, "forces", "N")
    if force.shape != (touches,) or touches == 0:
        raise ValueError(
            f"touches must be one or more, each with a force in N, got {touches} places and forces "
            f"of shape {force.shape}"
        )
    if not np.isfinite(force).all():
        k = int(np.argmin(np.isfinite(force)))
        raise ValueError(f"force of touch {k} must be finite, got {force[k]} N")
    return force


def _radius(radius: float) -> float:
    if not 0.0 <= number(radius, "touch radius", "mm") < inf:
        raise ValueError(
            f"touch radius must be 0 mm or more and finite, got {radius:g} mm; write 0 for a point"
        )
    return radius
