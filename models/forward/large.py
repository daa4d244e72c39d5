"""Large touches as a measurement: the reduced plate of von Kármán behind the solver.

Nothing is linear in force here, so that the solver asks for the measurement of all touches together
and its derivatives. Whatever is measured - strain of gauges, or the whole pattern as amplitudes of
smooth fields - is linear in the state of the reduced plate, and is whitened by a matrix.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import sqrt

import numpy as np
from numpy.typing import ArrayLike

import fe
from fe import ReducedReadings, drift_at, hermite_gram
from models.arrays import F64
from models.checks import read_measured

# A light touch has the shape of the response, but a finger's is what is looked for: N.
TYPICAL = 1.5
# The reduced plate differs from the shell by up to so much of what is measured.
MODEL_ERROR = 0.02
# Its motion differs by this part of what stretching moves over a side of the plate: states of the
# shell, one and two touches, four and two clamped edges, 136 in all (decision 84).
_MISSED = 0.0151
# And its strain by this part of the mean strain of stretching: 48 states of the shell, one and two
# touches, at gauges all round four plates (0.012 to 0.052).
_MISSED_STRAIN = 0.031


@dataclass(frozen=True, eq=False)
class LargeForward:
    """What a view of the reduced plate reads, in units of its noise.

    Attributes
    ----------
    view : ReducedReadings
        Of C readings.
    whitening : (m, C) float64
        Rows of zeros for what is missing.
    missed : float, (N mm)^-½
        What the reduced plate misses of the measurement where it is stretched by a unit.
    """

    view: ReducedReadings
    whitening: F64
    missed: float = 0.0

    @property
    def plate(self) -> fe.Plate:
        """The plate that is touched."""
        return self.view.plate

    @property
    def model_error(self) -> float:
        """See `Forward.model_error`."""
        return MODEL_ERROR

    @property
    def freedom(self) -> int:
        """Numbers that were measured."""
        return self._freedom

    @cached_property
    def _freedom(self) -> int:
        return int(self.whitening.any(axis=1).sum())

    def response(self, xy: F64) -> F64:
        """Measurement per N under a touch of `TYPICAL` N at each place, (n, 2) mm → (n, m)."""
        force = np.array([TYPICAL])
        read = [self.view.read(place[None], force).values.ravel() for place in np.asarray(xy)]
        return np.array(read).reshape(len(read), -1) @ self.whitening.T / TYPICAL

    def read(self, touches: F64) -> tuple[F64, F64]:
        """Measurement (m,) under touches x, y, F, (n, 3), and its exact derivatives (3n, m)."""
        if not len(touches):
            return np.zeros(len(self.whitening)), np.empty((0, len(self.whitening)))
        reading = self.view.read(touches[:, :2], touches[:, 2])
        jacobian = self.whitening @ reading.jacobian.reshape(self.whitening.shape[1], -1)
        return self.whitening @ reading.values.ravel(), jacobian.T

    def own_error(self, touches: F64) -> float:
        """See `Forward.own_error`."""
        if not self.missed or not len(touches):
            return 0.0
        return self.missed * self.view.read(touches[:, :2], touches[:, 2]).stretch

    def trust(self, touches: F64) -> fe.Trust:
        """Say whether the reduced plate is good for touches (n, 3), one or more."""
        return self.view.read(touches[:, :2], touches[:, 2]).result

    def whiten(self, measured: ArrayLike) -> F64:
        """Put readings (C / 3, 3) into units of their noise, (m,); what is missing may be NaN.

        Raises
        ------
        ValueError
            If the readings have another shape or are no real numbers.
        """
        readings = read_measured(measured, (self.whitening.shape[1] // 3, 3)).ravel()
        return self.whitening @ np.where(self.whitening.any(axis=0), readings, 0.0)


def large_gauges(reduced: fe.Reduced, xy: ArrayLike, sigma: float) -> LargeForward:
    """Forward model of strain gauges on the touched face, with noise `sigma` in each channel.

    Parameters
    ----------
    reduced : fe.Reduced
    xy : (M, 2) array_like, mm
        Places of the gauges.
    sigma : float, strain

    Raises
    ------
    ValueError
        If a gauge lies outside the plate or sigma is not positive.
    """
    if not sigma > 0:
        raise ValueError(f"sigma of strain must be positive, got {sigma:g}; give its noise")
    view, plate = reduced.gauges(xy), reduced.plate
    whitening = np.eye(len(view.fixed)) / sigma
    # The energy E h A ε² of a strain ε, as for motion below.
    stiff = sqrt(plate.young * plate.thickness * plate.area)
    return LargeForward(view, whitening, _MISSED_STRAIN * float(np.linalg.norm(whitening)) / stiff)


@dataclass(frozen=True, eq=False)
class LargePlate:
    """Motion of a plate under large touches as amplitudes of smooth fields.

    The deflection is carried by plate modes, as that of small touches is, and the motion in the
    plane by the fields of the reduced plate.

    Attributes
    ----------
    reduced : fe.Reduced
    modes : fe.Modes
        K modes on the mesh of the reduced plate.
    view : ReducedReadings
        Reads K + U amplitudes, and up to two zeros.
    """

    reduced: fe.Reduced
    modes: fe.Modes
    view: ReducedReadings

    @property
    def drifts(self) -> int:
        """Number U of fields in the plane."""
        return self.reduced.drifts.shape[-1]

    def amplitudes(self, xy: F64, force: F64) -> F64:
        """Amplitudes of modes and of fields in the plane under touches, (K + U,)."""
        return self.view.read(xy, force).values.ravel()[: self._count]

    def drift(self, places: F64) -> F64:
        """Motion of the plate in its plane by a unit of each field, (N, 2) mm → (N, 2, U) mm."""
        return drift_at(self.reduced.mesh, self.reduced.drifts, places)

    def forward(self, factor: F64) -> LargeForward:
        """Forward model of amplitudes whitened by a factor (K + U, m)."""
        whitening = np.zeros((factor.shape[1], len(self.view.fixed)))
        whitening[:, : self._count] = factor.T
        plate, modes = self.reduced.plate, len(self.modes.stiffness)
        # Fields are orthonormal over the area A: 1 mm everywhere is √A of one. The energy E h A ε²
        # of a strain ε moves the plate over a side √A by √A ε.
        fields = whitening[:, modes : self._count]
        in_plane = np.linalg.norm(fields) * sqrt(plate.area / self.drifts)
        missed = _MISSED * float(in_plane) / sqrt(plate.young * plate.thickness)
        return LargeForward(self.view, whitening, missed)

    @property
    def _count(self) -> int:
        return len(self.modes.stiffness) + self.drifts


def large_plate(reduced: fe.Reduced, count: int = 200) -> LargePlate:
    """Carry the motion of a reduced plate by `count` of its modes and its fields in the plane."""
    modes = fe.modes(reduced.plate, count, reduced.mesh)
    x, y = (hermite_gram(line, 0, 0) for line in reduced.mesh.lines)
    # ∫ φ w dA of each mode: modes are orthonormal, so these are amplitudes.
    loads = np.einsum("ai,ijk,jb->abk", x.toarray(), modes.values, y.toarray(), optimize=True)
    drifts = reduced.drifts.shape[-1]
    size = -(-(count + drifts) // 3) * 3
    moving = np.zeros((*reduced.mesh.shape, size, reduced.forms.functions))
    # A touch of 1 N is -1 N along z.
    moving[:, :, :count] = reduced.touch_shapes.solve(-loads)
    fixed = np.zeros((size, reduced.shapes.shape[2]))
    fixed[:count] = np.tensordot(loads, reduced.shapes, axes=((0, 1), (0, 1)))
    plane = np.zeros((size, reduced.forms.stresses + drifts))
    plane[count : count + drifts, reduced.forms.stresses :] = np.eye(drifts)
    channels = moving.reshape(*reduced.mesh.shape, -1)
    adjoint = fe.Adjoint(reduced.plate, reduced.mesh, channels)
    return LargePlate(reduced, modes, ReducedReadings(reduced, adjoint, fixed, plane))
