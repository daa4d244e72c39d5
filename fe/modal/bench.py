"""States of a plate on one bench, by Newton's method, and their derivatives by touch and bench."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.linalg.lapack import dgetrf, dgetrs

from fe.arrays import F64, I32
from fe.elements.functional import derivative
from fe.modal.correction import Correction, corrected
from fe.modal.kernel import pulls, summed
from fe.modal.parameters import (
    GRADED,
    MEMBRANE,
    NAMES,
    ROTATION,
    SHAPE,
    TENSION,
    THICKNESS,
    YOUNG,
)
from fe.modal.plate import ModalPlate

_STEPS = 60
# Of the load, up to which forces may be out of balance before the last step. That is one of Newton:
# it leaves about the square of this, and what the plate does to touches is right to it.
_BALANCED = 1e-6
# Fall of what is out of balance in a step, above which the tangent is made anew.
_SLOW = 0.2


class Tangent(NamedTuple):
    """Stiffness of a state.

    Attributes
    ----------
    factors : (n, n) float64
        Of the released stiffness, L and U in one.
    pivots : (n,) int32
        Rows that were exchanged for it.
    gained : (M, n) float64
        Stresses by the functions.
    """

    factors: F64
    pivots: I32
    gained: F64

    def solve(self, right: F64) -> F64:
        """Solve for right-hand sides (n,) or (n, C)."""
        return np.asarray(dgetrs(self.factors, self.pivots, right)[0], dtype=np.float64)


@dataclass(frozen=True, eq=False)
class Pressed:
    """A state of the plate under touches, as amplitudes of n functions, D details and U drifts.

    Attributes
    ----------
    bench : BenchPlate
    touches : (T, 3) float64, mm, mm, N
        x, y, F.
    amplitudes : (n,) float64
        Of the functions of the deflection.
    stress : (M,) float64
        Of the stresses in the plane.
    along : (M, n) float64
        Pull of each stress on each function, before the last step.
    converged : bool
        Whether forces are in balance.
    tangent : Tangent
        Before the last step.
    """

    bench: BenchPlate
    touches: F64
    amplitudes: F64
    stress: F64
    along: F64
    converged: bool
    tangent: Tangent

    @cached_property
    def values(self) -> F64:
        """Amplitudes of the n functions, the D details and the U drifts, (n + D + U,)."""
        drifting, shaped = self.drifting
        drift = (0.5 * drifting + shaped) @ self.amplitudes
        drift += self.bench.slipping @ self.stress
        return np.concatenate([self.amplitudes, self.details, drift])

    @cached_property
    def details(self) -> F64:
        """Amplitudes of the details, (D,): no one bends another."""
        own = -self.touches[:, 2] @ self.bench.details_at(self.touches)
        return own if self.correction is None else own + self.correction.value

    @cached_property
    def correction(self) -> Correction | None:
        """What the plane does to the details, where it does."""
        bench, products = self.bench, self.bench.modal.corrections
        if products is None:
            return None
        return corrected(products, bench.whole, bench.firmness, self.amplitudes, self.stress)

    @cached_property
    def drifting(self) -> tuple[F64, F64]:
        """Forms of each drift and each function, two (U, n), by w and by the shape."""
        return self.bench.drifting(self.amplitudes)

    def is_of(self, bench: BenchPlate) -> bool:
        """Whether it is a state of a bench, or of another with the same numbers."""
        own = self.bench
        return own is bench or (
            own.modal is bench.modal and np.array_equal(own.values, bench.values)
        )

    def jacobian(self) -> F64:
        """Compute derivatives of `values` by x1, y1, F1, x2, …: (n + D + U, 3T)."""
        return self._by_touch

    @cached_property
    def _by_touch(self) -> F64:
        loads = self._by_touches(self.bench.at)
        moved = self.moved(self.bench.released(loads), np.zeros((len(self.stress), len(loads.T))))
        moved[self._detailed] += self._by_touches(self.bench.details_at)
        return moved

    def _by_touches(self, at: Callable[..., F64]) -> F64:
        """Compute derivatives of what touches press by x1, y1, F1, x2, …: (k, 3T)."""
        force, here = self.touches[:, 2], self.touches
        along_x, along_y = (-force[:, None] * at(here, *order) for order in ((1, 0), (0, 1)))
        return np.stack([along_x, along_y, -at(here)], axis=1).reshape(3 * len(force), -1).T

    def by_parameters(self) -> F64:
        """Compute derivatives of `values` by the parameters of the bench: (n + D + U, 54)."""
        return self._by_parameters

    @cached_property
    def _by_parameters(self) -> F64:
        moved = self.bench.by_parameters(self)
        details = moved[self._detailed]
        details[:, YOUNG] -= self.details
        details[:, THICKNESS] -= 3.0 * self.details
        if self.correction is not None:
            details += self.correction.by_parameters
        return moved

    @cached_property
    def _detailed(self) -> slice:
        """Rows of the details among all."""
        first = len(self.amplitudes)
        return slice(first, first + len(self.details))

    def moved(self, loads: F64, strains: F64) -> F64:
        """Compute changes of all `values` by loads (n, P) and by stresses (M, P)."""
        bench = self.bench
        moved = self.tangent.solve(loads - bench.released(self.along.T @ strains))
        drifting, shaped = self.drifting
        stresses = self.tangent.gained @ moved + strains
        details = np.zeros((len(self.details), loads.shape[1]))
        if self.correction is not None:
            details = self.correction.by_functions @ moved + self.correction.by_stresses @ stresses
        drift = (drifting + shaped) @ moved + bench.slipping @ stresses
        return np.concatenate([moved, details, drift])


@dataclass(frozen=True, eq=False)
class BenchPlate:
    """A plate on a bench: the modal plate with all its parameters known.

    Attributes
    ----------
    modal : ModalPlate
    values : (54,) float64
        See `fe.modal.parameters`: how it differs from its description. Derivatives by compliances
        are those of edges that give, also where an end would push.
    """

    modal: ModalPlate
    values: F64

    @cached_property
    def slipping(self) -> F64:
        """Drifts by stresses, (U, M)."""
        return np.tensordot(self.whole[MEMBRANE], self.modal.slipping, 1)

    @cached_property
    def stiffness(self) -> F64:
        """Stiffness of the functions at rest, (n, n)."""
        return self._bending + np.tensordot(self.whole[TENSION], self.modal.tense, 1)

    @cached_property
    def _bending(self) -> F64:
        """The same without tension, (n, n)."""
        matrix = self.modal.stiffness + np.tensordot(self.values[GRADED], self.modal.graded, 1)
        return matrix * self._firmer

    @cached_property
    def _giving(self) -> F64:
        """Turns by moments, (J, J)."""
        return np.tensordot(self.whole[ROTATION], self.modal.turning, 1)

    @cached_property
    def _shaped(self) -> F64:
        """Products of the stresses and drifts with the shape at rest, (M + U, n)."""
        return np.tensordot(self.whole[SHAPE], self.modal.shaped, 1)

    @cached_property
    def stretch_compliance(self) -> F64:
        """Complementary energy of the stresses, (M, M)."""
        return self._stretching + np.tensordot(self.whole[MEMBRANE], self.modal.giving, 1)

    @cached_property
    def _stretching(self) -> F64:
        """The same between rigid edges, (M, M)."""
        easing = np.tensordot(self.values[GRADED], self.modal.easing, 1)
        return self._softer * (np.eye(len(easing)) - easing)

    @property
    def _firmer(self) -> float:
        """Factor by which the plate is stiffer in bending than described."""
        return float(np.exp(self.values[YOUNG] + 3.0 * self.values[THICKNESS]))

    @property
    def _softer(self) -> float:
        """Factor by which it is softer in its plane."""
        return float(np.exp(-self.values[YOUNG] - self.values[THICKNESS]))

    @cached_property
    def _stiffening(self) -> F64:
        """Stresses by what stretches, (M, M)."""
        return np.asarray(np.linalg.inv(self.stretch_compliance), dtype=np.float64)

    @cached_property
    def whole(self) -> F64:
        """All numbers, those of the description included, (54,).

        Edges give and never push: the compliance of an end that would push is none. Where it is
        below 0, stresses in the plane soon have a state that grows by itself.
        """
        whole = self.values + self.modal.described
        for kind in (ROTATION, MEMBRANE):
            mean, slope = whole[kind].reshape(-1, 2).T
            ends = np.maximum([mean + slope, mean - slope], 0.0)
            whole[kind] = np.column_stack([ends[0] + ends[1], ends[0] - ends[1]]).ravel() / 2.0
        return whole

    def at(self, touches: F64, p: int = 0, q: int = 0) -> F64:
        """Compute derivatives of the functions where touches press, (T, n)."""
        return derivative(self.modal.mesh, touches[:, :2], p, q).of(self.modal.values)

    def details_at(self, touches: F64, p: int = 0, q: int = 0) -> F64:
        """Compute derivatives of the details by 1 N where touches press, (T, D)."""
        at = derivative(self.modal.mesh, touches[:, :2], p, q).of(self.modal.details)
        return at / self.firmness

    @cached_property
    def firmness(self) -> F64:
        """Bending energy of the details, (D,)."""
        return self._firmer * self.modal.firmness

    def released(self, forces: F64) -> F64:
        """Let edges give to forces (n, …): a turn moves by its compliance times its moment.

        All equations are so written, which holds for rigid edges too.
        """
        released = forces.copy()
        released[self.modal.count :] = self._giving @ forces[self.modal.count :]
        return released

    def press(self, touches: F64, start: Pressed | None = None) -> Pressed:
        """Bend the plate by touches x, y, F (T, 3), mm and N, from a state near by if there is one.

        Points outside the plate are the caller's to refuse.
        """
        loads = self.loads(touches)
        near = self._near(loads) if start is None else self._moved_on(start, loads)
        amplitudes, tangent = near
        scale, last, size = self._size(loads) + 1e-300, np.inf, np.inf
        left, stress, along = self._balance(amplitudes, loads)
        for _ in range(_STEPS):
            last, size = size, self._size(left) / scale
            if size <= _BALANCED or not np.isfinite(size):
                break
            if size > _SLOW * last or tangent is None:
                tangent = self.tangent(stress, along)
            amplitudes = amplitudes - tangent.solve(left)
            left, stress, along = self._balance(amplitudes, loads)
        tangent = self.tangent(stress, along)
        step = tangent.solve(left)
        amplitudes, stress = amplitudes - step, stress - tangent.gained @ step
        return Pressed(self, touches, amplitudes, stress, along, bool(size <= _BALANCED), tangent)

    def loads(self, touches: F64) -> F64:
        """Compute forces of touches (T, 3) on the functions, (n,)."""
        return self.at(touches).T @ -touches[:, 2]

    def _size(self, forces: F64) -> float:
        """Size of forces, each in units of the root of the stiffness of its function."""
        return float(np.linalg.norm(forces / self._roots))

    @cached_property
    def _roots(self) -> F64:
        return np.sqrt(np.abs(np.diag(self.modal.stiffness)))

    def _near(self, loads: F64) -> tuple[F64, None]:
        """Linear solution under loads (n,), cut back as much as the stretching demands."""
        amplitudes = self._at_rest.solve(self.released(loads))
        pulling, shaped = self.pulling(amplitudes)
        square, line = 0.5 * pulling @ amplitudes, shaped @ amplitudes
        work, solve = float(loads @ amplitudes), self._stiffening
        # Least energy along the line t a: work (t - 1) + 3 s l t² + 2 s² t³ = 0.
        cubic, squared = 2.0 * square @ solve @ square, 3.0 * square @ solve @ line
        roots = np.roots(np.array([float(cubic), float(squared), work, -work]))
        real = roots[np.abs(roots.imag) < 1e-9].real
        factor = float(real[np.argmin(np.abs(real - 0.5))]) if len(real) else 1.0
        return factor * amplitudes, None

    def _moved_on(self, start: Pressed, loads: F64) -> tuple[F64, Tangent]:
        """State under loads (n,) by the derivatives of one near by, on this bench or another."""
        change = self.released(loads - self.loads(start.touches))
        amplitudes = start.amplitudes + start.tangent.solve(change)
        if not start.is_of(self):
            by_parameters = start.by_parameters()[: len(amplitudes)]
            amplitudes += by_parameters @ (self.values - start.bench.values)
        return amplitudes, start.tangent

    @cached_property
    def _at_rest(self) -> Tangent:
        """Factors of the tangent at rest."""
        shaped = self._shaped[: len(self.stretch_compliance)]
        return self.tangent(np.zeros(len(shaped)), shaped)

    def pulling(self, amplitudes: F64) -> tuple[F64, F64]:
        """Pull of each stress on each function, two (M, n), by w and by the shape."""
        return self._products(amplitudes, 0, len(self.stretch_compliance))

    def drifting(self, amplitudes: F64) -> tuple[F64, F64]:
        """Forms of each drift and each function, two (U, n), by w and by the shape."""
        return self._products(amplitudes, len(self.stretch_compliance), len(self._shaped))

    def _products(self, amplitudes: F64, first: int, last: int) -> tuple[F64, F64]:
        return pulls(self.modal.stretching, amplitudes, first, last), self._shaped[first:last]

    def _balance(self, amplitudes: F64, loads: F64) -> tuple[F64, F64, F64]:
        """Compute what is out of balance (n,), released; stress (M,) and its pulls (M, n)."""
        pulling, shaped = self.pulling(amplitudes)
        along = pulling + shaped
        stress = self._stiffening @ ((0.5 * pulling + shaped) @ amplitudes)
        forces = self.stiffness @ amplitudes - loads + along.T @ stress
        left = self.released(forces)
        left[self.modal.count :] += amplitudes[self.modal.count :]
        return left, stress, along

    def tangent(self, stress: F64, along: F64) -> Tangent:
        """Factor the released tangent stiffness of a state."""
        gained = self._stiffening @ along
        stretched = summed(self.modal.stretching, stress)
        matrix = self.released(self.stiffness + stretched + along.T @ gained)
        turned = np.arange(self.modal.count, len(matrix))
        matrix[turned, turned] += 1.0
        return Tangent(*dgetrf(matrix)[:2], gained)

    def by_parameters(self, state: Pressed) -> F64:
        """Compute derivatives of functions, details and drifts, (n + D + U, 54).

        Those of the details are by what functions and stresses change.
        """
        modal, a, stress = self.modal, state.amplitudes, state.stress
        count, names = len(stress), len(NAMES)
        loads = np.zeros((len(a), names))  # change of the forces that the plate holds against
        strains = np.zeros((count, names))  # change of what stretches, at the same deflection
        drifts = np.zeros((len(modal.slipping[0]), names))
        bent, eased = self._bending @ a, self._stretching @ stress
        for which, power in ((YOUNG, 1.0), (THICKNESS, 3.0)):
            loads[:, which], strains[:, which] = power * bent, eased
        loads[:, GRADED] = self._firmer * (modal.graded @ a).T
        strains[:, GRADED] = self._softer * (modal.easing @ stress).T
        loads[:, TENSION] += (modal.tense @ a).T
        loads[:, SHAPE] += (stress @ modal.shaped[:, :count]).T
        strains[:, SHAPE] = (modal.shaped[:, :count] @ a).T
        drifts[:, SHAPE] = (modal.shaped[:, count:] @ a).T
        strains[:, MEMBRANE] = -(modal.giving @ stress).T
        drifts[:, MEMBRANE] = (modal.slipping @ stress).T
        left = -self.released(loads)
        forces = self.stiffness @ a - self.loads(state.touches) + state.along.T @ stress
        left[modal.count :, ROTATION] -= (modal.turning @ forces[modal.count :]).T
        moved = state.moved(left, self._stiffening @ strains)
        moved[len(moved) - len(drifts) :] += drifts
        return moved
