"""A plate that rings after a tap and creeps under a press, as the live loop follows it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from rig.live.baseline import is_consistent
from rig.live.fitted import fitted, touches_of
from rig.live.memory import Memory
from rig.scene.source import DeviceSection
from rig.system.arrays import F64

if TYPE_CHECKING:
    import fe
    from models import (
        Creep,
        Estimate,
        Estimator,
        ImageMotions,
        InTime,
        RingingPlate,
        Seeing,
        Tap,
    )
    from rig.calibration.store import Calibration
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
        What a unit of each field of the plate shows, times the noise.
    noise : float, grey levels
    time : float, s
        When it was complete.
    motions : ImageMotions
        What knows these fields under touches.
    """

    measured: F64
    factor: F64
    noise: float
    time: float
    motions: ImageMotions


@dataclass(frozen=True, eq=False)
class Past:
    """What goes from one frame to the next.

    Attributes
    ----------
    ringing : InTime or None
        None before the first frame.
    crept : (terms, K) float64 or None
        Amplitudes that the plate has crept by, as it shows them where nothing stretches it.
    touches : (n, 3) float64 or None, mm, mm, N
        Those of the last frame.
    time : float or None, s
        Of the last frame.
    seeing : Seeing or None
        What its modes showed.
    source : (K, m) float64 or None
        The factor that this was made of.
    """

    ringing: InTime | None = None
    crept: F64 | None = None
    touches: F64 | None = None
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
        Amplitudes of the fields that no force holds: of ringing and of creep.
    left : (m,) float64 or None
        What of the measurement may be a drift; None where nothing is.
    past : Past
    memory : Memory
        Touches that ended; as before on an exact bench.
    measured : (m,) float64 or None
        What the touches explain at equilibrium; None where the plate is followed as it rings.
    """

    estimate: Estimate
    beside: F64
    left: F64 | None
    past: Past
    memory: Memory
    measured: F64 | None


@dataclass(frozen=True, eq=False)
class PlateInTime:
    """How a plate moves in time.

    Attributes
    ----------
    ringing : RingingPlate or None
        None where each frame is an equilibrium.
    creep : Creep or None
        None where the plate is elastic.
    """

    ringing: RingingPlate | None = None
    creep: Creep | None = None

    def estimate(
        self,
        estimator: Estimator,
        seen: MeasuredFrame,
        start: F64,
        past: Past,
        memory: Memory | None = None,
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
        memory : Memory, optional
            Touches that ended, where the bench is known only so well.
        """
        crept = self._crept(seen.motions, past, seen.time)
        beside = self._shown(seen.motions, crept, past)
        measured = (
            seen.measured - beside @ seen.factor / seen.noise if len(crept) else seen.measured
        )
        before = memory or Memory()
        if self.ringing is None:
            estimate, after = fitted(estimator, measured, start, before)
            left = self._left(estimator, seen, estimate, measured, after)
            now = Past(None, crept, touches_of(estimate), seen.time)
            return FoundInTime(estimate, beside, left, now, after, measured)
        seeing = _seeing(self.ringing, seen, past)
        estimate, ringing = _rung(self.ringing, estimator, seeing, measured, seen.time, past)
        beside[: len(ringing.swing)] += ringing.swing
        left = None
        if ringing.bank is None:
            left = self._left(estimator, seen, estimate, measured, before)
        now = Past(ringing, crept, touches_of(estimate), seen.time, seeing, seen.factor)
        return FoundInTime(estimate, beside, left, now, before, None)

    def _crept(self, motions: ImageMotions, past: Past, time: float) -> F64:
        """Amplitudes (terms, K) that the plate has crept by at a time."""
        if self.creep is None:
            return np.zeros((0, motions.fields))
        if past.crept is None or past.touches is None or past.time is None:
            return self.creep.rest(motions.fields)
        light = _light(motions, past.touches)
        return self.creep.after(past.crept, light, time - past.time)

    def _shown(self, motions: ImageMotions, crept: F64, past: Past) -> F64:
        """Amplitudes (K,) by which a plate that has crept differs from an elastic one.

        A force that has lasted shows as one that is larger, in the place of it. Where it stretches
        the plate that moves it less than it would one at rest, which is what creep is followed in.
        """
        shown = crept.sum(axis=0)
        if past.touches is None or not len(past.touches) or not shown.any():
            return shown
        light = _light(motions, past.touches)
        lasted = float(shown @ light) / float(light @ light)
        grown = past.touches * (1.0, 1.0, 1.0 + lasted)
        more = _amplitudes(motions, grown) - _amplitudes(motions, past.touches)
        return shown + more - lasted * light

    def _left(
        self,
        estimator: Estimator,
        seen: MeasuredFrame,
        estimate: Estimate,
        measured: F64,
        memory: Memory,
    ) -> F64 | None:
        """Return what of a measurement (m,) may be a drift; None where nothing is.

        Under a press the lowest modes are free beside the touches where creep is followed: a plate
        bows by them, and a touch needs many more. What touches leave on a bench that is known only
        so well may as well be the bench.
        """
        if not estimate.count:
            consistent = is_consistent(estimate)
            return estimator.without_memory(measured, memory.left) if consistent else None
        if self.creep is None or estimate.p_value < FITS or estimator.bench is not None:
            return None
        touches = np.column_stack([estimate.xy, estimate.force])
        predicted, slope = estimator.forward.read(touches)
        bows = seen.factor[:BOWS] / seen.noise
        found = np.linalg.lstsq(np.vstack([slope, bows]).T, measured - predicted)[0]
        return found[len(slope) :] @ bows


def _seeing(ringing: RingingPlate, seen: MeasuredFrame, past: Past) -> Seeing:
    """Return what modes show; the same as before where the visible pattern is the same."""
    if past.seeing is not None and past.source is seen.factor:
        return past.seeing
    from models import Seeing

    return Seeing(ringing.modes, seen.factor / seen.noise)


def _rung(
    ringing: RingingPlate,
    estimator: Estimator,
    seeing: Seeing,
    measured: F64,
    time: float,
    past: Past,
) -> tuple[Estimate, InTime]:
    """Touches of a plate that rings, and what is known of the ringing."""
    from models import InTime, estimate_in_time

    before = past.ringing or InTime()
    return estimate_in_time(ringing, estimator, seeing, measured, before, time)


def _amplitudes(motions: ImageMotions, touches: F64) -> F64:
    return motions.modal_amplitudes(touches[:, :2], touches[:, 2])


def _light(motions: ImageMotions, touches: F64) -> F64:
    """Amplitudes (K,) under touches (n, 3) if they did not stretch the plate."""
    if not len(touches):
        return np.zeros(motions.fields)
    deflection = touches[:, 2] @ motions.modes.response(touches[:, :2])
    return np.pad(deflection, (0, motions.fields - len(deflection)))


def require_own_modes(scene: Scene, theory: str, *, exact: bool) -> None:
    """Refuse [dynamics] with a density where a plate has no modes that ring by themselves.

    Raises
    ------
    ValueError
        If touches are large, or the bench is not just as described.
    """
    rings = scene.dynamics is not None and scene.dynamics.density is not None
    if rings and (theory != "linear" or not exact):
        raise ValueError(
            f"scene '{scene.title}' follows the plate as it rings, which needs the linear theory of"
            " an exact bench; leave dynamics.density out (creep is followed on any bench), or set"
            " plate.theory to 'linear' and estimator.bench to 'exact'"
        )


def exposure_of(scene: Scene) -> float:
    """How long each frame of a scene is exposed, s."""
    said = scene.dynamics.exposure if scene.dynamics else None
    held = scene.source.exposure if isinstance(scene.source, DeviceSection) else None
    rate = scene.camera.rate if scene.camera else 1.0
    return said or held or EXPOSED / rate


def in_time(
    scene: Scene, motions: ImageMotions, calibration: Calibration | None = None
) -> PlateInTime | None:
    """Build what is known of the plate in time; None where nothing is.

    What was calibrated stands in the place of what the scene says.
    """
    dynamics = scene.dynamics
    creep = calibration.known_creep() if calibration else None
    creep = creep or (dynamics.build_creep() if dynamics else None)
    if dynamics is None or dynamics.density is None:
        return PlateInTime(None, creep) if creep else None
    from models import RingingPlate, plate_dynamics

    modes: fe.Modes = motions.plate_modes
    density, damping = dynamics.density, dynamics.damping
    if calibration and calibration.damping:
        density, damping = calibration.damping.density, calibration.damping.damping
    ringing = plate_dynamics(modes, density, damping)
    return PlateInTime(RingingPlate(modes, ringing, exposure_of(scene)), creep)
