"""Where the plate lies before the camera: from its corners, or from boards on it."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

import synthetic
from rig.calibration.board import BoardView
from rig.calibration.lens import Lens
from rig.system.arrays import F64

MIN_SIGMA = 0.05  # px; corners are not found better, however few there are to say so


@dataclass(frozen=True, eq=False)
class Pose:
    """Plate to camera.

    Attributes
    ----------
    camera : synthetic.Camera
        The lens at this pose.
    covariance : (6, 6) float64
        Of a small turn about the axes of the camera, rad, and of the shift, mm.
    residual : float, px
        RMS distance of the points from where the model has them.
    error : float, mm
        Standard deviation of a place on the plate, RMS over the given points: what they say of it
        together.
    """

    camera: synthetic.Camera
    covariance: F64
    residual: float
    error: float


def find_pose(lens: Lens, points: BoardView, sigma: float | None = None) -> Pose:
    """Find the pose of a plate from points on it.

    Parameters
    ----------
    lens : Lens
    points : BoardView
        Points in the plate frame (N, 3) mm, four or more not on a line, and their px.
    sigma : float, px, optional
        Standard deviation of a point; from the residuals where it is left out, which four corners
        leave hardly any of.

    Raises
    ------
    ValueError
        If there are too few points, no pose fits them, or they are seen from the other side of the
        plate than that whose face they lie on.
    """
    if len(points.mm) < 4:
        raise ValueError(f"a pose needs 4 points or more, got {len(points.mm)}; mark all corners")
    matrix, bent = lens.matrix, lens.coefficients
    try:
        known = points.mm, points.px, matrix, bent
        found, turn, shift = cv2.solvePnP(*known, flags=cv2.SOLVEPNP_IPPE)
        turn, shift = cv2.solvePnPRefineLM(*known, turn, shift)
    except cv2.error as error:
        raise ValueError("no pose of the plate fits these points; mark them again") from error
    if not found:
        raise ValueError("no pose of the plate fits these points; mark them again")
    T = np.eye(4)
    rotation = cv2.Rodrigues(turn)[0]
    u, _, v = np.linalg.svd(rotation)
    T[:3, :3], T[:3, 3] = u @ v, np.ravel(shift)
    camera = lens.camera(T)
    _check_side(camera, points.mm)
    left = camera.project(points.mm) - points.px
    freedom = max(left.size - 6, 1)
    if sigma is None:
        sigma = max(float(np.sqrt(np.square(left).sum() / freedom)), MIN_SIGMA)
    towards = _by_pose(camera, points.mm)
    normal: F64 = np.einsum("nij,nik->jk", towards, towards)
    covariance = np.asarray(sigma**2 * np.linalg.inv(normal), dtype=np.float64)
    # px of a point by the pose, and the place on the plate by px
    by_place = np.linalg.inv(camera.jacobian(points.mm)[:, :, :2])
    moved = by_place @ towards
    spread = np.einsum("nij,jk,nik->n", moved, covariance, moved)
    return Pose(
        camera=camera,
        covariance=covariance,
        residual=float(np.sqrt(np.square(left).sum(axis=1).mean())),
        error=float(np.sqrt(spread.mean())),
    )


def _check_side(camera: synthetic.Camera, points: F64) -> None:
    """Refuse a camera on one side of the plate that sees points of the other: they are mirrored."""
    height = float(points[:, 2].mean())
    if height * camera.position[2] < 0:
        here, there = ("above", "below") if camera.position[2] > 0 else ("below", "above")
        raise ValueError(
            f"these points are seen from {here}, and the scene has its camera {there}; give the"
            f' corners in their order, or set camera.side to "{here}"'
        )


def _by_pose(camera: synthetic.Camera, points: F64) -> F64:
    """Motion of the image of points by a small turn and shift in the camera frame, (N, 2, 6)."""
    R = camera.T_cam_plate[:3, :3]
    local = points @ R.T + camera.T_cam_plate[:3, 3]
    by_local = camera.jacobian(points) @ R.T  # px per mm along the axes of the camera
    x, y, z = local.T
    nil = np.zeros_like(x)
    cross = np.stack([[nil, z, -y], [-z, nil, x], [y, -x, nil]]).transpose(2, 0, 1)
    return np.concatenate([by_local @ cross, by_local], axis=2)
