"""New results of a calibration, and the entries that keep them."""

from __future__ import annotations

from datetime import datetime
from math import isfinite

import numpy as np

import models
from rig.calibration.entries import (
    BenchEntry,
    CreepEntry,
    DampingEntry,
    Dated,
    LatencyEntry,
    LensEntry,
    NoiseEntry,
    PoseEntry,
    PressesEntry,
    ProjectorEntry,
    Row,
)
from rig.calibration.found_on import FoundOn
from rig.calibration.latency import Latency
from rig.calibration.lens import Lens
from rig.calibration.photon import Photon
from rig.calibration.pose import Pose
from rig.calibration.projector import ProjectorLight
from rig.calibration.ringing_plate import Ringing
from rig.live.alignment import Alignment

Part = (
    Lens
    | Pose
    | ProjectorLight
    | Photon
    | Latency
    | Alignment
    | Ringing
    | models.BenchEstimate
    | models.LearnedCreep
)
"""What can be calibrated."""


def entry_of(part: Part, now: datetime, on: FoundOn | None = None) -> dict[str, Dated]:
    """Return the entry of a new result, by the name of its part, for `Calibration`.

    Parameters
    ----------
    part : Part
    now : datetime
    on : FoundOn, optional
        What a bench was found on.
    """
    match part:
        case Lens():
            return {"lens": _lens_entry(part, now)}
        case Pose():
            return {"pose": _pose_entry(part, now)}
        case ProjectorLight():
            return {"projector": _projector_entry(part, now)}
        case Photon():
            return {"noise": _noise_entry(part, now)}
        case Latency():
            return {"latency": _latency_entry(part, now)}
        case models.BenchEstimate():
            return {"bench": bench_entry(part, now, on)}
        case Ringing():
            return {"damping": _damping_entry(part, now)}
        case models.LearnedCreep():
            return {"creep": _creep_entry(part, now)}
        case Alignment():
            return {"presses": _presses_entry(part, now)}


def _lens_entry(part: Lens, now: datetime) -> LensEntry:
    bent = part.distortion
    return LensEntry(
        date=now,
        error=part.error,
        residual=part.residual,
        size=part.size,
        focal=part.focal,
        sigma_focal=part.sigma_focal,
        centre=part.centre,
        distortion=(bent.k1, bent.k2, bent.p1, bent.p2, bent.k3),
        covariance=None if part.covariance is None else _rows(part.covariance),
    )


def _pose_entry(part: Pose, now: datetime) -> PoseEntry:
    return PoseEntry(
        date=now,
        error=part.error,
        residual=part.residual,
        T_cam_plate=_rows(part.camera.T_cam_plate),
        covariance=_rows(part.covariance),
    )


def _projector_entry(part: ProjectorLight, now: datetime) -> ProjectorEntry:
    return ProjectorEntry(
        date=now,
        error=part.error,
        residual=part.residual,
        size=part.screen.size,
        T_px_plate=_rows(part.screen.T_px_plate),
        strength=part.strength,
        black=part.black,
    )


def _noise_entry(part: Photon, now: datetime) -> NoiseEntry:
    return NoiseEntry(
        date=now,
        error=part.sigma_gain / part.gain,
        residual=part.residual,
        gain=part.gain,
        read=part.read,
    )


def _latency_entry(part: Latency, now: datetime) -> LatencyEntry:
    return LatencyEntry(date=now, error=part.sigma, median=part.median, p95=part.p95)


def bench_entry(part: models.BenchEstimate, now: datetime, on: FoundOn | None) -> BenchEntry:
    """Return the entry of a bench, and what it was found on where that is known."""
    held = part.held_out
    return BenchEntry(
        date=now,
        error=held.place if held else None,
        error_force=held.force if held and isfinite(held.force) else None,
        names=tuple(name for name, _ in models.BENCH),
        values=tuple(part.values.tolist()),
        covariance=_rows(part.covariance),
        prior=tuple(part.prior.tolist()),
        measured=part.measured,
        discrepancy=part.discrepancy,
        memory=part.memory,
        fixed_pattern=part.fixed_pattern if isfinite(part.fixed_pattern[1]) else None,
        converged=part.converged,
        outliers=part.outliers,
        found_on=on,
    )


def _damping_entry(part: Ringing, now: datetime) -> DampingEntry:
    return DampingEntry(
        date=now, error=part.sigma_damping, density=part.density, damping=part.damping
    )


def _creep_entry(part: models.LearnedCreep, now: datetime) -> CreepEntry:
    return CreepEntry(date=now, error=part.scatter, parts=part.creep.parts, times=part.creep.times)


def _presses_entry(part: Alignment, now: datetime) -> PressesEntry:
    return PressesEntry(
        date=now,
        error=part.error,
        matrix=_rows(part.matrix),
        gain=part.gain,
        sigma_gain=part.sigma_gain,
        error_force=part.error_force,
    )


def _rows(matrix: np.ndarray) -> tuple[Row, ...]:
    return tuple(tuple(row) for row in np.asarray(matrix).tolist())
