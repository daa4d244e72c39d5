"""States of a plate on one bench, by Newton's method, and their derivatives by touch and bench."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from scipy.linalg import lu_factor, lu_solve

from fe.arrays import F64
from fe.elements.functional import derivative
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
# Of the load, at which forces are in balance: a millionth of what any image tells.
_BALANCED = 1e-9
# Fall of what is out of balance in a step, above which the tangent is made anew.
_SLOW = 0.2


@dataclass(frozen=True, eq=False)
class Pressed:
    """A state of the plate under touches, as amplitudes of n functions and U drifts.

    Attributes
    ----------
    bench : BenchPlate
    touches : (T, 3) float64, mm, mm, N
        x, y, F.
    amplitudes : (n,) float64
        Of the functions of the deflection.
    stress : (M,) float64
        Of the stresses in the plane.
    converged : bool
        Whether forces are in balance.
    tangent : tuple
        Factors of the stiffness somewhere near this state.
    """

    bench: BenchPlate
    touches: F64
    amplitudes: F64
    stress: F64
    converged: bool
    tangent: Any

    @property
    def values(self) -> F64:
        """Amplitudes of the n functions and the U drifts, (n + U,)."""
        pulls, shaped = self._pulls
        stresses = len(self.stress)
        part = self.amplitudes[self.bench.taking_part]
        drift = 0.5 * pulls[stresses:] @ part + shaped[stresses:] @ part
        return np.concatenate([self.amplitudes, drift + self.bench.slipping @ self.stress])

    @cached_property
    def _pulls(self) -> tuple[F64, F64]:
        return self.bench.pulls(self.amplitudes)

    @cached_property
    def _exact(self) -> tuple[Any, F64]:
        """Factors of the tangent at this very state, and stresses by the functions, (M, c)."""
        pulls, shaped = self._pulls
        return self.bench.tangent(self.stress, (pulls + shaped)[: len(self.stress)])

    def jacobian(self) -> F64:
        """Compute derivatives of `values` by x1, y1, F1, x2, …: (n + U, 3T)."""
        force = self.touches[:, 2]
        slopes = self.bench.at(self.touches, 1, 0), self.bench.at(self.touches, 0, 1)
        along_x, along_y = (-force[:, None] * slope for slope in slopes)
        pushes = np.stack([along_x, along_y, -self.bench.at(self.touches)], axis=1)
        loads = pushes.reshape(3 * len(force), -1).T
        return self._moved(self.bench.released(loads), np.zeros((len(self.stress), len(loads.T))))

    def by_parameters(self) -> F64:
        """Compute derivatives of `values` by the parameters of the bench: (n + U, 30)."""
        return self.bench.by_parameters(self)

    def _moved(self, loads: F64, strains: F64) -> F64:
        """Compute changes of `values` by loads (n, P) and by stresses that come of themselves (M, P)."""
        factors, gained = self._exact
        bench, stresses = self.bench, len(self.stress)
        pulls, shaped = self._pulls
        along = (pulls + shaped)[:stresses]
        loads = loads.copy()
        forces = np.zeros_like(loads)
        forces[bench.taking_part] = along.T @ strains
        loads -= bench.released(forces)
        moved = lu_solve(factors, loads, check_finite=False)
        part = moved[bench.taking_part]
        drift = (pulls + shaped)[stresses:] @ part + bench.slipping @ (gained @ part + strains)
        return np.concatenate([moved, drift])


@dataclass(frozen=True, eq=False)
class BenchPlate:
    """A plate on a bench: the modal plate with all its parameters known.

    Attributes
    ----------
    modal : ModalPlate
    values : (30,) float64
        See `fe.modal.parameters`; how edges give beside what the description says.
    """

    modal: ModalPlate
    values: F64

    @cached_property
    def taking_part(self) -> F64:
        """Indices (c,) of the functions that stretch the plate."""
        total, part = len(self.modal.stiffness), self.modal.tense.shape[1]
        first = np.arange(part - self.modal.turns)
        return np.concatenate([first, np.arange(self.modal.count, total)])

    @cached_property
    def slipping(self) -> F64:
        """Drifts by stresses, (U, M)."""
        return np.tensordot(self._compliances(MEMBRANE), self.modal.slipping, 1)

    @cached_property
    def stiffness(self) -> F64:
        """Stiffness of the functions at rest, (n, n)."""
        modal = self.modal
        matrix = modal.stiffness + np.tensordot(self.values[GRADED], modal.graded, 1)
        matrix = matrix * np.exp(self.values[YOUNG] + 3.0 * self.values[THICKNESS])
        self._add(matrix, np.tensordot(self.values[TENSION], modal.tense, 1))
        return matrix

    @cached_property
    def _giving(self) -> F64:
        """Turns by moments, (J, J)."""
        return np.tensordot(self._compliances(ROTATION), self.modal.turning, 1)

    @cached_property
    def _shaped(self) -> F64:
        """Products of the stresses and drifts with the shape at rest, (M + U, c)."""
        return np.tensordot(self.values[SHAPE], self.modal.shaped, 1)

    @cached_property
    def stretch_compliance(self) -> F64:
        """Complementary energy of the stresses, (M, M)."""
        modal = self.modal
        soft = np.exp(-self.values[YOUNG] - self.values[THICKNESS])
        easing = np.tensordot(self.values[GRADED], modal.easing, 1)
        giving = np.tensordot(self._compliances(MEMBRANE), modal.giving, 1)
        return soft * (np.eye(len(easing)) - easing) + giving

    @cached_property
    def _stiffening(self) -> F64:
        """Stresses by what stretches, (M, M)."""
        return np.linalg.inv(self.stretch_compliance)

    def _compliances(self, kind: slice) -> F64:
        return self.values[kind] + self.modal.described[kind]

    def at(self, touches: F64, p: int = 0, q: int = 0) -> F64:
        """Compute derivatives of the functions where touches press, (T, n)."""
        return derivative(self.modal.mesh, touches[:, :2], p, q).of(self.modal.values)

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
        loads = self.at(touches).T @ -touches[:, 2]
        state = self._near(touches) if start is None else self._moved_on(start, touches)
        tangent, last = state.tangent, np.inf
        amplitudes, stress = state.amplitudes, state.stress
        scale = float(np.linalg.norm(self._scaled(loads))) + 1e-300
        for step in range(_STEPS):
            left, stress, along = self._balance(amplitudes, loads)
            size = float(np.linalg.norm(self._scaled(left))) / scale
            if size <= _BALANCED or not np.isfinite(size):
                break
            if size > _SLOW * last or tangent is None:
                tangent = self.tangent(stress, along)[0]
            last = size
            amplitudes = amplitudes - lu_solve(tangent, left, check_finite=False)
            if step == _STEPS - 1:
                size = np.inf
        return Pressed(self, touches, amplitudes, stress, bool(size <= _BALANCED), tangent)

    def _scaled(self, forces: F64) -> F64:
        """Put forces into units of the square root of energy, by the stiffness of each function."""
        return forces / self._roots

    @cached_property
    def _roots(self) -> F64:
        return np.sqrt(np.abs(np.diag(self.modal.stiffness)))

    def _near(self, touches: F64) -> Pressed:
        """Linear answer, cut back as much as the stretching demands."""
        loads = self.at(touches).T @ -touches[:, 2]
        amplitudes = lu_solve(self._at_rest, self.released(loads), check_finite=False)
        pulls, shaped = self.pulls(amplitudes)
        part, count = amplitudes[self.taking_part], len(self.stretch_compliance)
        square, line = 0.5 * pulls[:count] @ part, shaped[:count] @ part
        work, solve = float(loads @ amplitudes), self._stiffening
        # Least energy along the line t a: work (t - 1) + 2 s² t³ + 3 s l t² + l² t = 0.
        roots = np.roots(
            [
                2.0 * square @ solve @ square,
                3.0 * square @ solve @ line,
                work + line @ solve @ line,
                -work,
            ]
        )
        real = roots[np.abs(roots.imag) < 1e-9].real
        factor = float(real[np.argmin(np.abs(real - 0.5))]) if len(real) else 1.0
        return Pressed(self, touches, factor * amplitudes, np.zeros(count), False, None)

    def _moved_on(self, start: Pressed, touches: F64) -> Pressed:
        """State by the derivatives of one near by; by itself where there are other touches."""
        amplitudes, tangent = start.amplitudes, start.tangent
        if start.bench is not self:
            tangent = None
        elif start.touches.shape == touches.shape and "_exact" in start.__dict__:
            change = self.at(touches).T @ -touches[:, 2]
            change = change - self.at(start.touches).T @ -start.touches[:, 2]
            amplitudes = amplitudes + lu_solve(
                start._exact[0], self.released(change), check_finite=False
            )
            tangent = start._exact[0]
        return Pressed(self, touches, amplitudes, start.stress, False, tangent)

    @cached_property
    def _at_rest(self) -> Any:
        """Factors of the tangent at rest."""
        shaped = self._shaped[: len(self.stretch_compliance)]
        return self.tangent(np.zeros(len(shaped)), shaped)[0]

    def pulls(self, amplitudes: F64) -> tuple[F64, F64]:
        """Pull of each stress and drift on each function, (M + U, c), by w and by the shape."""
        products = self.modal.stretching
        part = amplitudes[self.taking_part]
        pulls = (products.reshape(-1, len(part)) @ part).reshape(products.shape[:2])
        return pulls, self._shaped

    def _balance(self, amplitudes: F64, loads: F64) -> tuple[F64, F64, F64]:
        """Compute what is out of balance (n,), released; stress (M,) and its pulls (M, c)."""
        pulls, shaped = self.pulls(amplitudes)
        part, count = amplitudes[self.taking_part], len(self.stretch_compliance)
        stress = self._stiffening @ (0.5 * pulls[:count] @ part + shaped[:count] @ part)
        along = (pulls + shaped)[:count]
        forces = self.stiffness @ amplitudes - loads
        forces[self.taking_part] += along.T @ stress
        left = self.released(forces)
        left[self.modal.count :] += amplitudes[self.modal.count :]
        return left, stress, along

    def tangent(self, stress: F64, along: F64) -> tuple[Any, F64]:
        """Factors of the released tangent stiffness (n, n), and stresses by functions (M, c)."""
        count = len(stress)
        products = self.modal.stretching[:count]
        gained = self._stiffening @ along
        more = (stress @ products.reshape(count, -1)).reshape(products.shape[1:])
        matrix = self.stiffness.copy()
        self._add(matrix, more + along.T @ gained)
        matrix = self.released(matrix)
        turned = np.arange(self.modal.count, len(matrix))
        matrix[turned, turned] += 1.0
        return lu_factor(matrix, overwrite_a=True, check_finite=False), gained

    def _add(self, matrix: F64, part: F64) -> None:
        """Add a product of the functions that stretch to one of all."""
        matrix[np.ix_(self.taking_part, self.taking_part)] += part

    def by_parameters(self, state: Pressed) -> F64:
        """See `Pressed.by_parameters`."""
        modal, a, stress = self.modal, state.amplitudes, state.stress
        count, names = len(stress), len(NAMES)
        part = a[self.taking_part]
        pulls, shaped = state._pulls
        along = (pulls + shaped)[:count]
        loads = np.zeros((len(a), names))  # change of the forces that the plate holds against
        strains = np.zeros((count, names))  # change of what stretches, at the same deflection
        drifts = np.zeros((len(modal.slipping[0]), names))
        bending = np.exp(self.values[YOUNG] + 3.0 * self.values[THICKNESS])
        bent = bending * (modal.stiffness + np.tensordot(self.values[GRADED], modal.graded, 1)) @ a
        soft = np.exp(-self.values[YOUNG] - self.values[THICKNESS])
        giving = np.tensordot(self._compliances(MEMBRANE), modal.giving, 1)
        eased = (self.stretch_compliance - giving) @ stress
        for which, power in ((YOUNG, 1.0), (THICKNESS, 3.0)):
            loads[:, which], strains[:, which] = power * bent, eased
        loads[:, GRADED] = bending * (modal.graded @ a).T
        strains[:, GRADED] = soft * (modal.easing @ stress).T
        loads[self.taking_part, TENSION] += (modal.tense @ part).T
        loads[self.taking_part, SHAPE] += np.tensordot(stress, modal.shaped[:, :count], (0, 1)).T
        strains[:, SHAPE] = (modal.shaped[:, :count] @ part).T
        drifts[:, SHAPE] = (modal.shaped[:, count:] @ part).T
        strains[:, MEMBRANE] = -(modal.giving @ stress).T
        drifts[:, MEMBRANE] = (modal.slipping @ stress).T
        left = -self.released(loads)
        forces = self.stiffness @ a - self.at(state.touches).T @ -state.touches[:, 2]
        forces[self.taking_part] += along.T @ stress
        left[modal.count :, ROTATION] -= (modal.turning @ forces[modal.count :]).T
        moved = state._moved(left, self._stiffening @ strains)
        moved[len(a) :] += drifts
        return moved
