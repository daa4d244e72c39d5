"""From estimates to what is drawn: marks, the plate's outline and the strain map."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np

import fe
import synthetic
from models import Estimate
from rig.live.snapshot import Mark, Snapshot, StrainOverlay
from rig.live.strain_chain import StrainChain
from rig.live.tracks import Track
from rig.system.arrays import F64
from rig.system.frame import Frame


@dataclass(frozen=True, eq=False)
class View:
    """Where the plate lies in the image: corners (4, 2) px, and face mm → px as a homography."""

    outline: F64
    T_px_plate: F64


def plate_view(plate: fe.Plate, camera: synthetic.AnyCamera) -> View:
    """Return where a camera sees the face of a plate that is turned to it."""
    height = camera.face_height(plate.thickness)
    a, b = plate.size
    corners = np.array([(0.0, 0.0), (a, 0.0), (a, b), (0.0, b)])
    outline = camera.project(np.column_stack([corners, np.full(4, height)]))
    T = cv2.getPerspectiveTransform(corners.astype(np.float32), outline.astype(np.float32))
    return View(outline, np.asarray(T, dtype=np.float64))


def marks(estimate: Estimate) -> tuple[Mark, ...]:
    """Touches of an estimate with their uncertainty, as one frame shows them."""
    seen = [np.append(estimate.xy[k], estimate.force[k]) for k in range(estimate.count)]
    return tuple(
        replace(_mark(seen[k], estimate.touch_covariance(k)), force_interval=interval)
        for k, interval in enumerate(_intervals(estimate))
    )


def tracked_marks(tracks: Sequence[Track], estimate: Estimate) -> tuple[Mark, ...]:
    """Touches as all frames so far show them: which they are and how fast.

    The intervals of forces are those of the last frame, whose touches the tracks are of.
    """
    return tuple(
        replace(
            _mark(*track.seen),
            identity=track.identity,
            velocity=track.sure_velocity,
            force_interval=interval,
        )
        for track, interval in zip(tracks, _intervals(estimate), strict=True)
    )


def true_marks(touches: tuple[fe.Touch, ...]) -> tuple[Mark, ...]:
    """Touches that are known exactly."""
    return tuple(Mark(touch.x, touch.y, touch.force) for touch in touches)


def _intervals(estimate: Estimate) -> list[tuple[float, float] | None]:
    """Bounds of 95 % of each force, where they are not even."""
    found = estimate.force_intervals or (None,) * estimate.count
    return [None if one is None else one.level_95 for one in found]


def _mark(seen: F64, covariance: F64) -> Mark:
    """Draw x, y, F (3,) with their covariance (3, 3)."""
    x, y, force = seen.tolist()
    variances, axes = np.linalg.eigh(np.nan_to_num(covariance[:2, :2], posinf=1e6))
    semi = np.sqrt(variances.clip(0.0))
    angle = float(np.arctan2(axes[1, 1], axes[0, 1]))
    return Mark(
        x=x,
        y=y,
        force=force,
        sigma=(float(semi[1]), float(semi[0]), angle),
        sigma_force=float(np.sqrt(covariance[2, 2])),
    )


def strain_map(chain: StrainChain, strain: F64) -> StrainOverlay:
    """Strain (T, 3) as a grid over the image."""
    tiles = chain.blocks.reference.tiles
    exx, eyy, exy = strain.T.reshape(3, *tiles.shape).astype(np.float32)
    sigma = chain.noise * np.median(chain.map.sigma, axis=0)
    return StrainOverlay(tiles.xs, tiles.ys, exx, eyy, exy, tuple(sigma.tolist()))


def empty_snapshot(
    frame: Frame, plate_size: tuple[float, float], view: View, status: str
) -> Snapshot:
    """Return a snapshot of an image in which no touch was sought, because of `status`."""
    nothing = float("nan")
    return Snapshot(
        sequence=frame.sequence,
        captured=frame.captured,
        late=frame.late,
        image=frame.image,
        plate_size=plate_size,
        plate_outline=view.outline,
        T_px_plate=view.T_px_plate,
        touches=(),
        from_strain=None,
        truth=None,
        strain=None,
        status=status,
        position_error=None,
        force_error=None,
        position_error_median=None,
        force_error_median=None,
        fps=nothing,
        dropped=0,
        stages=(),
        latency=(nothing, nothing),
        noise=nothing,
        strain_reason=status,
    )
