"""The whole pattern, or gauges, on a bench whose parameters are known only so well.

Plate, edges and camera have forty numbers beside what a scene says. The forward model is exact in
them and gives its derivatives by them, so that they can be found from touches, and so that what is
not known of them enters the uncertainty of every touch.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike

import fe
from models.arrays import F64
from models.checks import read_measured
from models.forward.camera_change import CAMERA, Seen
from models.forward.rolling import Rolled, read_at

BENCH: tuple[tuple[str, str], ...] = (*fe.BENCH_PARAMETERS, *CAMERA)
"""Name and unit of every number of a bench: of the plate and its edges, then of the camera."""

MEASURED_DRIFTS = 36
"""Fields in the plane that a pattern resolves. A plate moves by many more, each a little; what they
add to the motion is taken for those and for the modes, as the images will take it."""

THICKNESS = [name for name, _ in BENCH].index("thickness")

_PLATE = len(fe.BENCH_PARAMETERS)
_Each = TypeVar("_Each")
ASTRAY = 4.0  # mm: fingers glide and roll as they lift
# Change of a measurement, in standard deviations of its noise, up to which the derivatives of a
# state near by tell it: to a hundredth of one, for it comes from tenths of a millimetre.
_CARRIED = 2.0
# The same of all amplitudes in parts of their size, where they only say how the image has moved.
_CHANGED = 2e-3
# Of the shorter side, by which a touch may have moved for that: weak ones change little anywhere.
_BESIDE = 1e-3


@dataclass(frozen=True, eq=False)
class BenchFields:
    """Amplitudes of a plate on a bench, as the camera that is described would see them.

    Attributes
    ----------
    bench : fe.BenchPlate
    seen : Seen, optional
        What the camera makes of them; where it is left out, it tells all fields apart.
    camera : (9,) float64
        Numbers of the camera, about which `seen` was made.
    resolved : int
        Fields in the plane that are measured, where there are as many.
    detailed : int
        Details of the deflection that are measured: none, an image takes them for its modes.
    """

    bench: fe.BenchPlate
    seen: Seen | None = None
    camera: F64 = field(default_factory=lambda: np.zeros(len(CAMERA)))
    resolved: int = MEASURED_DRIFTS
    detailed: int = 0
    _near: dict[int, fe.Pressed] = field(default_factory=dict[int, "fe.Pressed"], repr=False)

    @property
    def plate(self) -> fe.Plate:
        """The plate as it is described."""
        return self.bench.modal.plate

    @property
    def count(self) -> int:
        """Number of functions of the deflection that are measured, K."""
        return len(self.bench.modal.stiffness) + self.detailed

    @property
    def drifts(self) -> int:
        """Number of fields in the plane that are measured, U."""
        return min(self.resolved, self.bench.modal.drifts.shape[-1])

    @property
    def whole(self) -> BenchFields:
        """The same with all details and all fields in the plane."""
        drifts, details = self.bench.modal.drifts.shape[-1], len(self.bench.modal.firmness)
        return replace(self, seen=None, resolved=drifts, detailed=details)

    def through(self, seen: Seen, camera: F64) -> BenchFields:
        """Return the same through a camera of given numbers (9,), which sees them so."""
        return replace(self, seen=seen, camera=camera)

    @property
    def values(self) -> F64:
        """All numbers of the bench, (63,); see `BENCH`."""
        return np.concatenate([self.bench.values, self.camera])

    def value(self, xy: F64) -> F64:
        """Functions of the deflection at points (N, 2) mm: (N, K)."""
        return self.bench.modal.value(xy, self.detailed)

    def slope(self, xy: F64) -> F64:
        """Their slopes along x and y: (N, K, 2)."""
        return self.bench.modal.slope(xy, self.detailed)

    def drift(self, places: F64) -> F64:
        """Motion in the plane by a unit of each field, (N, 2) mm → (N, 2, U) mm."""
        modal = self.bench.modal
        return fe.drift_at(modal.mesh, modal.drifts[..., : self.drifts], places)

    def response(self, xy: F64) -> F64:
        """Amplitudes per N of all functions under a light touch at each place, (n, K)."""
        return (light_touches(self.bench, xy) @ self.seeing.T)[:, : self.count]

    def amplitudes(self, xy: F64, force: F64) -> F64:
        """Amplitudes seen under touches (n, 2) mm and (n,) N, (K + U,)."""
        if not len(force):
            return np.zeros(self.count + self.drifts)
        touches = np.column_stack([xy, force])
        near = self.beside(touches)
        if near is not None:
            change = near.jacobian() @ (touches - near.touches).ravel()
            if np.linalg.norm(change) < _CHANGED * np.linalg.norm(near.values):
                return self.seeing @ (near.values + change)
        return self.seen_of(self.state(touches))

    def state(self, touches: F64) -> fe.Pressed:
        """State of the plate under touches (n, 3); the last one is where the next begins."""
        near = self._near.get(len(touches))
        if near is not None and near.is_of(self.bench) and np.array_equal(near.touches, touches):
            return near
        touches = touches.copy()  # kept with the state, and the caller may go on writing
        state = self.bench.press(touches, near)
        if not state.converged:
            state = self.bench.press(touches)
        self._near[len(touches)] = state
        return state

    def beside(self, touches: F64) -> fe.Pressed | None:
        """Return the last state of this bench, if its touches (n, 3) were hardly elsewhere."""
        near = self._near.get(len(touches))
        if near is None or not near.is_of(self.bench) or not near.converged:
            return None
        apart = np.abs(near.touches[:, :2] - touches[:, :2]).max()
        return near if apart <= _BESIDE * min(self.plate.size) else None

    def seen_of(self, state: fe.Pressed) -> F64:
        """Amplitudes seen of a state of the plate, (K + U,)."""
        return self.seeing @ state.values

    @cached_property
    def seeing(self) -> F64:
        """Amplitudes measured by those of the plate, (K + U, all of them)."""
        if self.seen is not None:
            return self.seen.matrix
        modal = self.bench.modal
        functions = len(modal.stiffness) + len(modal.firmness)
        every = np.eye(functions + modal.drifts.shape[-1])
        return np.concatenate([every[: self.count], every[functions : functions + self.drifts]])

    def forward(self, factor: F64) -> BenchForward:
        """Forward model of amplitudes whitened by a factor (K + U, m)."""
        return BenchForward(self, np.ascontiguousarray(factor.T))

    def rolling_forward(self, factor: F64, rolled: Rolled) -> BenchForward:
        """Forward model of an image whose rows are read one after the other.

        Parameters
        ----------
        factor : (K + U, m) float64
            By which amplitudes are whitened.
        rolled : Rolled
            Whitened measurement by a change of each amplitude.
        """
        return replace(self.forward(factor), rolled=rolled)


@dataclass(frozen=True, eq=False)
class BenchForward:
    """What is measured of a plate on its bench, in units of the noise.

    Attributes
    ----------
    fields : BenchFields
    whitening : (m, K + U) float64
        From the amplitudes that are seen; rows of zeros for what is missing.
    rolled : Rolled, optional
        By what is seen of their change, where rows are read one after the other.
    """

    fields: BenchFields
    whitening: F64
    rolled: Rolled | None = None
    _left: dict[bytes, fe.Pressed] = field(default_factory=dict[bytes, "fe.Pressed"], repr=False)
    _left_by_bench: dict[bytes, F64] = field(default_factory=dict[bytes, F64], repr=False)
    _last: dict[int, tuple[fe.Pressed, F64, F64]] = field(
        default_factory=dict[int, "tuple[fe.Pressed, F64, F64]"], repr=False
    )

    @property
    def plate(self) -> fe.Plate:
        """The plate that is touched."""
        return self.fields.plate

    @property
    def model_error(self) -> float:
        """None beside what is not known of the bench."""
        return 0.0

    @property
    def freedom(self) -> int:
        """Numbers that were measured."""
        return self._freedom

    @cached_property
    def _freedom(self) -> int:
        return int(self.whitening.any(axis=1).sum())

    @cached_property
    def reading(self) -> F64:
        """From the amplitudes of the plate to what is measured, (m, all of them)."""
        return self.whitening @ self.fields.seeing

    def own_error(self, touches: F64) -> float:
        """None beside what is not known of the bench: see `Forward.own_error`."""
        return 0.0

    def whiten(self, measured: ArrayLike) -> F64:
        """Return what the pattern has whitened already, (m,)."""
        return read_measured(measured, (len(self.whitening),))

    def response(self, xy: F64) -> F64:
        """See `Forward.response`."""
        return light_touches(self.fields.bench, xy) @ self.reading.T

    def read(self, touches: F64) -> tuple[F64, F64]:
        """See `Forward.read`."""
        if not len(touches):
            return np.zeros(len(self.whitening)), np.empty((0, len(self.whitening)))
        state = self._about(touches)
        values, jacobian = self._read(state)
        return values + (touches - state.touches).ravel() @ jacobian, jacobian

    def _about(self, touches: F64) -> fe.Pressed:
        """State of touches (n, 3), or the last one, where they moved so little since."""
        near = self.fields.beside(touches)
        if near is not None:
            change = (touches - near.touches).ravel() @ self._read(near)[1]
            if change @ change < _CARRIED**2:
                return near
        return self.fields.state(touches)

    def _read(self, state: fe.Pressed) -> tuple[F64, F64]:
        """Measurement (m,) of a state, and by its touches, (3n, m); those of the last are kept."""
        known = self._last.get(len(state.touches))
        if known is None or known[0] is not state:
            known = state, self.reading @ state.values, (self.reading @ state.jacobian()).T
            self._last[len(state.touches)] = known
        return known[1:]

    def by_bench(self, touches: F64) -> F64:
        """Compute derivatives of the measurement by every number of the bench, (63, m)."""
        if not len(touches):
            return np.zeros((len(BENCH), len(self.whitening)))
        return self._by_bench(self._about(touches))

    def _by_bench(self, state: fe.Pressed) -> F64:
        """Compute derivatives of what a state shows by every number of the bench, (63, m)."""
        derivatives = np.zeros((len(BENCH), len(self.whitening)))
        derivatives[:_PLATE] = (self.reading @ state.by_parameters()).T
        if self.fields.seen is not None:
            seen = self.fields.seen
            derivatives[_PLATE:] = (seen.derivatives @ state.values) @ self.whitening.T
            derivatives[THICKNESS] += self.whitening @ (seen.by_thickness @ state.values)
        return derivatives

    def by_rate(self, touches: F64) -> F64:
        """Compute derivatives of the measurement by the rates of x, y, F of touches, (3n, m).

        A touch is that of the moment when its own row is read. Zeros where all are read at once.
        """
        if self.rolled is None or not len(touches):
            return np.zeros((touches.size, len(self.whitening)))
        seen = self.fields.seeing @ self._about(touches).jacobian()
        own = np.repeat(read_at(self.rolled.places, touches[:, :2]), 3)
        return (self.rolled.reading @ seen - self.whitening @ (seen * own)).T

    def left(self, touches: F64) -> F64:
        """Compute what each of n touches that ended would show if it still pressed, (3n, m).

        Three rows for each: itself, and what it shows more if it pressed a little further along x
        and y, by the standard deviation of where the plate keeps its trace.
        """
        shown = [
            np.concatenate([state.values[None], ASTRAY * state.jacobian().T[:2]])
            for state in self._ended(touches)
        ]
        return np.array([values @ self.reading.T for values in shown]).reshape(
            -1, len(self.whitening)
        )

    def left_by_bench(self, touches: F64) -> F64:
        """Compute derivatives of what each would show by every number of the bench, (n, 63, m)."""
        shape = len(touches), len(BENCH), len(self.whitening)
        states = self._ended(touches)
        derivatives = _kept(self._left_by_bench, touches, lambda k: self._by_bench(states[k]))
        return np.array(derivatives).reshape(shape)

    def _ended(self, touches: F64) -> list[fe.Pressed]:
        """States of the plate under each of n touches alone; those of the last ones are kept."""
        return _kept(self._left, touches, lambda k: self._alone(touches[k]))

    def _alone(self, touch: F64) -> fe.Pressed:
        """State of the plate under a touch (3,)."""
        # One that slid is taken to have gone on, which may lead beyond an edge.
        on_plate = np.clip(touch, 0.0, (*self.plate.size, np.inf))
        return self.fields.bench.press(on_plate[None])

    def through(self, whitening: F64) -> BenchForward:
        """Return the same forward model of another part of the pattern, whitened otherwise."""
        return replace(self, whitening=whitening, _left_by_bench={}, _last={})

    def near(self, state: fe.Pressed) -> BenchForward:
        """Return the same forward model, whose next state of so many touches begins at one."""
        return replace(self, fields=replace(self.fields, _near={len(state.touches): state}))

    def apart(self) -> BenchForward:
        """Return the same forward model for another thread: it remembers no state of this one."""
        fields = replace(self.fields, _near={})
        return replace(self, fields=fields, _left={}, _left_by_bench={}, _last={})

    def moved(self, values: F64) -> BenchForward:
        """Return the same measurement on a bench near by, (63,), its camera to first order."""
        seen, change = self.fields.seen, values - self.fields.values
        if seen is not None:
            matrix = seen.matrix + np.tensordot(change[_PLATE:], seen.derivatives, 1)
            seen = seen._replace(matrix=matrix + change[THICKNESS] * seen.by_thickness)
        return self.on(values, seen)

    def on(self, values: F64, seen: Seen | None) -> BenchForward:
        """Return the same measurement on another bench, (63,), through what its camera sees."""
        bench = fe.BenchPlate(self.fields.bench.modal, values[:_PLATE])
        fields = BenchFields(bench, seen, values[_PLATE:])
        return replace(self, fields=fields, _left={}, _left_by_bench={}, _last={})


def light_touches(bench: fe.BenchPlate, xy: F64) -> F64:
    """Amplitudes of the plate per N of a light touch at each place, (n, 2) mm → (n, all of them).

    Touches without any force leave the plate at rest, and what it does by each of their forces is
    one solution for all.
    """
    resting = bench.press(np.column_stack([xy, np.zeros(len(xy))]))
    return resting.jacobian()[:, 2::3].T


def _kept(known: dict[bytes, _Each], touches: F64, of: Callable[[int], _Each]) -> list[_Each]:
    """Compute something of each of n touches, unless it is known; no more than these stay known."""
    keys = [touch.tobytes() for touch in touches]
    found = [known[key] if key in known else of(k) for k, key in enumerate(keys)]
    known.clear()
    known.update(zip(keys, found, strict=True))
    return found
