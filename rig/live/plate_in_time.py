"""A plate that rings after a tap and creeps under a press, as the live loop follows it."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from rig.live.baseline import is_consistent
from rig.scene.source import DeviceSection
from rig.system.arrays import F64

if TYPE_CHECKING:
    import fe
    from models import (
        Creep,
        Estimate,
        Estimator,
        InTime,
        RingingPlate,
        Seeing,
        Tap,
    )
    from rig.scene import Scene

EXPOSED = 0.25  # of the time between two frames, where nothing says how long they are exposed
BOWS = 6  # lowest modes by which a plate drifts under a press
FITS = 1e-3  # p-value above which what touches leave of a frame may be a drift


class MeasuredFrame(NamedTuple):
    """A frame as it was measured.

    Attributes
    ----------
    measured : (m,) float64
        In units of its noise.
    factor : (K, m) float64
        What a unit of each mode shows, times the noise.
    noise : float, grey levels
    time : float, s
        When it was complete.
    """

    measured: F64
    factor: F64
    noise: float
    time: float


@dataclass(frozen=True, eq=False)
class Past:
    """What goes from one frame to the next.

    Attributes
    ----------
    ringing : InTime or None
        None before the first frame.
    crept : (terms, K) float64 or None
        Amplitudes that the plate has crept by.
    elastic : (K,) float64 or None
        Those of the last touches at equilibrium, without creep.
    time : float or None, s
        Of the last frame.
    seeing : Seeing or None
        What its modes showed.
    source : (K, m) float64 or None
        The factor that this was made of.
    """

    ringing: InTime | None = None
    crept: F64 | None = None
    elastic: F64 | None = None
    time: float | None = None
    seeing: Seeing | None = None
    source: F64 | None = None

    @property
    def taps(self) -> tuple[Tap, ...]:
        """Touches that ended and of which the last frame has said the last."""
        return self.ringing.taps if self.ringing else ()


@dataclass(frozen=True, eq=False)
class FoundInTime:
    """What a frame of such a plate shows.

    Attributes
    ----------
    estimate : Estimate
    beside : (K,) float64
        Amplitudes of the modes that no force holds: of ringing and of creep.
    left : (m,) float64 or None
        What of the measurement may be a drift; None where nothing is.
    past : Past
    """

    estimate: Estimate
    beside: F64
    left: F64 | None
    past: Past


@dataclass(frozen=True, eq=False)
class PlateInTime:
    """How a plate moves in time.

    Attributes
    ----------
    modes : fe.Modes
    ringing : RingingPlate or None
        None where each frame is an equilibrium.
    creep : Creep or None
        None where the plate is elastic.
    """

    modes: fe.Modes
    ringing: RingingPlate | None = None
    creep: Creep | None = field(default=None)

    def estimate(
        self, estimator: Estimator, seen: MeasuredFrame, start: F64, past: Past
    ) -> FoundInTime:
        """Find the touches of a frame.

        Parameters
        ----------
        estimator : Estimator
            Of a frame at equilibrium.
        seen : MeasuredFrame
        start : (n, 3) float64, mm, mm, N
            Touches of the last frame.
        past : Past
        """
        crept = self._crept(past, seen.time)
        beside = crept.sum(axis=0) if len(crept) else np.zeros(self.modes.count)
        seeing = self._seeing(seen, past)
        measured = seen.measured - beside @ seeing.factor if len(crept) else seen.measured
        estimate, ringing, swing = self._rung(estimator, seeing, measured, seen.time, start, past)
        beside[: len(swing)] += swing
        elastic = np.zeros(self.modes.count)
        if estimate.count:
            elastic = estimate.force @ self.modes.response(estimate.xy)
        left = None
        if ringing is None or ringing.bank is None:
            left = self._left(estimator, seeing, estimate, measured)
        after = Past(ringing, crept, elastic, seen.time, seeing, seen.factor)
        return FoundInTime(estimate, beside, left, after)

    def _seeing(self, seen: MeasuredFrame, past: Past) -> Seeing:
        """Return what modes show; the same as before where the visible pattern is the same."""
        if past.seeing is not None and past.source is seen.factor:
            return past.seeing
        from models import Seeing

        return Seeing(self.modes, seen.factor / seen.noise)

    def _crept(self, past: Past, time: float) -> F64:
        """Amplitudes (terms, K) that the plate has crept by at a time."""
        if self.creep is None:
            return np.zeros((0, self.modes.count))
        if past.crept is None or past.elastic is None or past.time is None:
            return self.creep.rest(self.modes.count)
        return self.creep.after(past.crept, past.elastic, time - past.time)

    def _rung(
        self,
        estimator: Estimator,
        seeing: Seeing,
        measured: F64,
        time: float,
        start: F64,
        past: Past,
    ) -> tuple[Estimate, InTime | None, F64]:
        """Touches, what is known of the ringing, and by how much modes are off equilibrium."""
        if self.ringing is None:
            return estimator.fit_whitened(measured, start), None, np.zeros(0)
        from models import InTime, estimate_in_time

        before = past.ringing or InTime()
        estimate, after = estimate_in_time(self.ringing, estimator, seeing, measured, before, time)
        return estimate, after, after.swing

    def _left(
        self, estimator: Estimator, seeing: Seeing, estimate: Estimate, measured: F64
    ) -> F64 | None:
        """Return what of a measurement (m,) may be a drift; None where nothing is.

        Under a press the lowest modes are free beside the touches where creep is followed: a plate
        bows by them, and a touch needs many more.
        """
        if not estimate.count:
            return measured if is_consistent(estimate) else None
        if self.creep is None or estimate.p_value < FITS:
            return None
        touches = np.column_stack([estimate.xy, estimate.force])
        predicted, slope = estimator.forward.read(touches)
        bows = seeing.factor[:BOWS]
        found = np.linalg.lstsq(np.vstack([slope, bows]).T, measured - predicted)[0]
        return found[len(slope) :] @ bows


def require_own_modes(scene: Scene, theory: str, *, exact: bool) -> None:
    """Refuse [dynamics] where a plate has no modes that ring by themselves.

    Raises
    ------
    ValueError
        If touches are large, or the bench is not just as described.
    """
    if scene.dynamics and (theory != "linear" or not exact):
        raise ValueError(
            f"scene '{scene.title}' follows the plate in time, which needs the linear theory of an"
            " exact bench; set plate.theory to 'linear' and estimator.bench to 'exact', or leave"
            " [dynamics] out"
        )


def in_time(scene: Scene, modes: fe.Modes) -> PlateInTime | None:
    """Build what a scene says of the plate in time; None where it says nothing."""
    dynamics, camera = scene.dynamics, scene.camera
    if dynamics is None or camera is None:
        return None
    creep = dynamics.build_creep()
    if dynamics.density is None:
        return PlateInTime(modes, None, creep)
    from models import RingingPlate, plate_dynamics

    held = scene.source.exposure if isinstance(scene.source, DeviceSection) else None
    exposure = dynamics.exposure or held or EXPOSED / camera.rate
    ringing = plate_dynamics(modes, dynamics.density, dynamics.damping)
    return PlateInTime(modes, RingingPlate(modes, ringing, exposure), creep)
