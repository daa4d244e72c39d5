"""The reduced plate: large deflection in few numbers, after von Kármán."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from fe.arrays import F64
from fe.elements.functional import Functional, derivative, recovered
from fe.elements.mesh import Mesh
from fe.elements.rise import rise
from fe.elements.storage import restore, store
from fe.linear.adjoint import Adjoint
from fe.linear.demand import strain_demand
from fe.linear.linear import CURVATURES, Face, LinearState, height
from fe.linear.load import disc
from fe.plate.plate import Plate, Touch
from fe.reduced.assembly import assemble
from fe.reduced.basis import spread_out
from fe.reduced.equilibrium import Balance, Settled, balance
from fe.reduced.forms import Forms
from fe.reduced.karman import Karman
from fe.reduced.large_state import LargeState, drift_at, middle_strain
from fe.reduced.result import Trust
from fe.reduced.sheet import Sheet, at_points, by_stretch, samples
from fe.reduced.spline import SplineTable
from fe.reduced.touch_shape import TouchShapes, touch_shapes
from fe.reduced.training import MARGIN
from fe.reduced.view import ReducedReadings

# Orders of derivative of w behind u, v, w.
_MOTION = ((1, 0), (0, 1), (0, 0))
# Adjoint channels a solve.
_BLOCK = 48

_ARRAYS = ("stresses", "fixed", "moving", "slopes", "shapes", "nodal", "drifts", "stretched")


@dataclass(frozen=True, eq=False)
class Reduced:
    """A plate under large touches in n + A T numbers.

    Attributes
    ----------
    plate : Plate
    mesh : Mesh
    forms : Forms
        Energy, stress and displacement in the plane as forms of the deflection.
    shapes : (2 nx + 2, 2 ny + 2, n) float64, mm
        Fixed shapes of w; the last is 0 for a plate that is not flat at rest, see `Forms`.
    stresses : (nx + 1, ny + 1, 3, M) float64, N/mm
        Stresses in the plane at the nodes.
    drifts : (2, 2 nx + 2, 2 ny + 2, U) float64
        Displacements in the plane.
    stretched : float
        Largest |s| among the states that it was made from, N mm to the power ½.
    """

    plate: Plate
    mesh: Mesh
    forms: Forms
    shapes: F64
    stresses: F64
    drifts: F64
    stretched: float

    @cached_property
    def karman(self) -> Karman:
        """The whole plate."""
        return Karman(self.plate, self.mesh)

    @cached_property
    def touch_shapes(self) -> TouchShapes:
        """The functions that move with a touch."""
        return touch_shapes(self.karman)

    @cached_property
    def sheet(self) -> Sheet:
        """Slopes of all that makes up a deflection."""
        resting, shapes = np.zeros(self.shapes.shape[2]), self.shapes
        if len(self.forms.resting):
            resting[self.forms.resting] = 1.0
            shapes = shapes + resting * rise(self.plate, self.mesh)
        return Sheet(samples(self.mesh).slopes(shapes), self.forms.slopes, resting)

    @cached_property
    def drifts_by_stretch(self) -> F64:
        """Amplitudes of the `drifts` as the samples of the sheet are stretched, (U, 3 Q)."""
        return by_stretch(self.karman, np.stack([spread_out(self.mesh, d) for d in self.drifts]))

    def solve(self, touches: Sequence[Touch]) -> LargeState:
        """Bend and stretch the plate by touches.

        Raises
        ------
        ValueError
            A touch, or a part of its disc, lies outside the plate, or there is none.
        """
        if not touches:
            raise ValueError("touches must be one or more, got none; without any nothing moves")
        xy = self.plate.points([(t.x, t.y) for t in touches], "touch")
        radius = np.array([t.radius for t in touches])
        state = self.balance(xy, np.array([t.force for t in touches]), radius)
        fixed, moving = np.split(state.weights, [self.shapes.shape[2]])
        values = self.shapes @ fixed
        for touch, part in zip(touches, moving.reshape(len(touches), -1), strict=True):
            points = disc(self.plate, self.mesh, np.array([[touch.x, touch.y]]), touch.radius)
            values += self.touch_shapes.at(*points) @ part
        bent = LinearState(self.plate, self.mesh, values[:, :, None], tuple(touches))
        membrane = self.karman.membrane
        plane = membrane.relax(membrane.stretching(values[:, :, None])).values
        stress = (self.stresses @ state.stress)[..., None]
        found = LargeState(bent, plane, stress, self.trust(xy, state))
        if found.converged and strain_demand(found) > 1.0:
            return replace(found, result=Trust.OVERSTRAINED)
        return found

    def balance(self, xy: F64, force: F64, radius: F64, near: Settled | None = None) -> Balance:
        """Numbers that make up the state under touches at (T, 2) mm: see `Balance`.

        It is found sooner where one near by is known. A plate that is not flat at rest can snap, so
        that its state is looked for afresh.
        """
        assembled = assemble(self.plate, self.mesh, self.forms, xy, radius)
        begun = None
        if near is not None and self.plate.shape is None:
            begun = near.leading_to(xy, force, radius, min(self.plate.size))
        return balance(self.forms, assembled, force, begun)

    def trust(self, xy: F64, state: Balance) -> Trust:
        """Say whether a state under touches at (T, 2) mm can be trusted."""
        if not state.converged:
            return Trust.NOT_CONVERGED
        if np.linalg.norm(state.stress) > self.stretched:
            return Trust.BEYOND
        room = np.minimum(xy, np.array(self.plate.size) - xy).min()
        return Trust.TRAINED if room >= MARGIN * min(self.plate.size) else Trust.NEAR_EDGE

    def gauges(self, xy: ArrayLike, face: Face = "top") -> ReducedReadings:
        """Prepare strain gauges at (M, 2) mm: the view reads Green-Lagrange strain exx, eyy, exy.

        Raises
        ------
        ValueError
            A gauge lies outside the plate, or the face has another name.
        """
        at = self.plate.points(xy, "gauge")
        lever = -height(self.plate, at, face)
        reads = [(recovered(self.mesh, at, p, q), lever) for p, q in CURVATURES]
        middle = middle_strain(self.plate, self.mesh, self.stresses, at)
        still = np.zeros((*middle.shape[:2], self.drifts.shape[-1]))
        return self._view(reads, np.concatenate([middle, still], axis=2))

    def points(self, xy: ArrayLike, face: Face = "top") -> ReducedReadings:
        """Prepare points at (M, 2) mm of a face: the view reads displacement u, v, w in mm.

        Raises
        ------
        ValueError
            A point lies outside the plate, or the face has another name.
        """
        at = self.plate.points(xy)
        lever = -height(self.plate, at, face)
        scale = (lever, lever, np.ones(len(at)))
        reads = [
            (derivative(self.mesh, at, p, q), part)
            for (p, q), part in zip(_MOTION, scale, strict=True)
        ]
        plane = np.zeros((len(at), 3, self.forms.stresses + self.drifts.shape[-1]))
        drifts = drift_at(self.mesh, self.drifts, at)
        plane[:, :2, self.forms.stresses :] = drifts
        # What the fields hold is theirs: forms are smooth in the place of a touch, samples less.
        held = drifts.reshape(2 * len(at), -1) @ self.drifts_by_stretch
        return self._view(reads, plane, at_points(self.karman, at) - held)

    def _view(
        self, reads: list[tuple[Functional, F64]], plane: F64, sheet: F64 | None = None
    ) -> ReducedReadings:
        """Solve for three channels a place: functionals of w with scales (M,), and the plane."""
        count = len(plane)
        fixed = np.stack([scale[:, None] * read.of(self.shapes) for read, scale in reads], axis=1)
        functions = self.forms.functions
        values = np.empty((*self.mesh.shape, 3 * count, functions))
        loads = np.zeros((*self.mesh.shape, 3 * count))
        for component, (read, scale) in enumerate(reads):
            # A touch of 1 N is -1 N along z.
            read.add_to(loads, -scale, 3 * np.arange(count) + component)
        for first in range(0, 3 * count, _BLOCK):
            part = slice(first, first + _BLOCK)
            values[:, :, part] = self.touch_shapes.solve(loads[:, :, part])
        moving = Adjoint(self.plate, self.mesh, values.reshape(*self.mesh.shape, -1))
        return ReducedReadings(
            self, moving, fixed.reshape(3 * count, -1), plane.reshape(3 * count, -1), sheet
        )

    def arrays(self) -> dict[str, np.ndarray]:
        """Return all of it as named arrays, for a file."""
        return store(
            self.plate,
            self.mesh,
            stresses=self.forms.stresses,
            fixed=self.forms.fixed,
            moving=self.forms.moving.coefficients,
            slopes=self.forms.slopes.coefficients,
            shapes=self.shapes,
            nodal=self.stresses,
            drifts=self.drifts,
            stretched=self.stretched,
        )

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, np.ndarray]) -> Reduced:
        """Build the reduced plate that `arrays` wrote.

        Raises
        ------
        ValueError
            An array is missing or has the wrong shape.
        """
        plate, mesh, found = restore(arrays, *_ARRAYS)
        stresses, fixed, moving, slopes, shapes, nodal, drifts, stretched = found
        tables = (SplineTable(plate.size, part) for part in (moving, slopes))
        parts = Forms(int(stresses), fixed, *tables)
        return cls(plate, mesh, parts, shapes, nodal, drifts, float(stretched))
