"""What boards leave open of a camera, in the numbers of a bench."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np

import models
import synthetic
from rig.system.arrays import F64

LENS = ("focal", "centre_x", "centre_y", "k1", "k2", "p1", "p2", "k3")
"""Numbers of a lens: ln of its focal length, its middle, px, and its distortion."""

# What corners do not show. A board lies where a ruler has it and is as long as a ruler says, paper
# bulges, and how thick it is with what it is glued to is not stated.
_LAID, _BULGE, _THICK = 0.3, 0.2, 1.0  # mm
_FOCAL = 1e-3  # of the focal length: corners of rendered boards leave as much beyond their scatter

_ALONG = 7  # places along each side
_DEEP = 0.1  # of the longer side, beside the face: what is out of it tells tilts from shifts
_POSE_STEPS = np.array([1e-4, 1e-4, 1e-4, 0.02, 0.02, 0.02])
_LENS_STEPS = np.array([1e-4, 0.05, 0.05, 3e-4, 3e-4, 1e-5, 1e-5, 3e-4])


def camera_covariance(
    camera: synthetic.Camera,
    pose: F64,
    lens: F64,
    size: tuple[float, float],
    thickness: float,
) -> F64:
    """Compute what boards leave open of a camera, in the numbers of `models.CAMERA`.

    A lens that is a little wrong is made up for by the pose that was found through it, as boards on
    the plate were seen where they were. What of a lens is no number of a bench, its middle and the
    rest of its distortion, counts as the numbers that make the image look most alike.

    Parameters
    ----------
    camera : synthetic.Camera
        As calibrated.
    pose : (6, 6) float64
        Of a turn about the axes of the camera, rad, and of the shift, mm, for a lens that is exact.
    lens : (8, 8) float64
        Of the numbers of `LENS`.
    size : (float, float), mm
        Sides of the plate.
    thickness : float, mm
        Of the plate.

    Returns
    -------
    (9, 9) float64
    """
    middle = 0.5 * size[0], 0.5 * size[1], 0.0
    face, deep = _places(size, camera.face_height(thickness))
    at_pose = partial(_at_pose, camera, middle)
    through = partial(_through, camera)
    made_up = -np.linalg.pinv(_by(at_pose, _POSE_STEPS, face)) @ _by(through, _LENS_STEPS, face)
    bench = np.column_stack([_by(at_pose, _POSE_STEPS, deep), _by(through, _LENS_STEPS, deep)])
    own = [
        *range(len(_POSE_STEPS)),
        *(len(_POSE_STEPS) + LENS.index(n) for n in ("focal", "k1", "k2")),
    ]
    by_lens = np.linalg.pinv(bench[:, own]) @ bench[:, len(_POSE_STEPS) :]
    by_lens[: len(_POSE_STEPS)] += made_up
    turned = _to_plate(camera, middle)
    known = by_lens @ (lens + np.diag([_FOCAL**2, *[0.0] * (len(LENS) - 1)])) @ by_lens.T
    known[: len(_POSE_STEPS), : len(_POSE_STEPS)] += turned @ pose @ turned.T + _as_laid(
        camera, size
    )
    return 0.5 * (known + known.T)


def _as_laid(camera: synthetic.Camera, size: tuple[float, float]) -> F64:
    """Covariance of turns and shifts by how boards are laid, and what they are made of, (6, 6)."""
    half = 0.5 * min(size)
    distance = abs(float(camera.position[2]))
    farther = np.hypot(_THICK, _LAID * distance / min(size))
    sigma = np.array([_BULGE / half, _BULGE / half, _LAID / half, _LAID, _LAID, farther])
    return np.diag(sigma**2)


def _to_plate(camera: synthetic.Camera, middle: tuple[float, float, float]) -> F64:
    """Return turns and shifts of the plate by those about the axes of the camera, (6, 6).

    Turned by ω and shifted by t before the camera, its middle c moves by ω × c + t.
    """
    R, shift = camera.T_cam_plate[:3, :3], camera.T_cam_plate[:3, 3]
    x, y, z = R @ middle + shift
    cross = np.array([[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]])
    return np.block([[R.T, np.zeros((3, 3))], [R.T @ cross, R.T]])


def _places(size: tuple[float, float], height: float) -> tuple[F64, F64]:
    """Places on the seen face, (N, 3) mm, and those on both sides of it."""
    sides = (np.linspace(0.0, side, _ALONG) for side in size)
    grid = np.stack(np.meshgrid(*sides), axis=-1).reshape(-1, 2)
    beside = _DEEP * max(size)
    on, low, high = (
        np.column_stack([grid, np.full(len(grid), height + away)])
        for away in (0.0, -beside, beside)
    )
    return on, np.concatenate([low, on, high])


def _at_pose(
    camera: synthetic.Camera, middle: tuple[float, float, float], numbers: F64
) -> synthetic.Camera:
    rest = np.zeros(len(models.CAMERA) - len(numbers))
    return models.varied(camera, middle, np.concatenate([numbers, rest]))


def _through(camera: synthetic.Camera, numbers: F64) -> synthetic.Camera:
    """Return the camera whose lens differs by numbers (8,), see `LENS`."""
    bent = camera.distortion or synthetic.Distortion()
    x, y = camera.centre
    focal, by_x, by_y, k1, k2, p1, p2, k3 = numbers.tolist()
    changed = synthetic.Distortion(
        bent.k1 + k1, bent.k2 + k2, bent.p1 + p1, bent.p2 + p2, bent.k3 + k3
    )
    longer = camera.focal * float(np.exp(focal))
    return replace(camera, focal=longer, centre=(x + by_x, y + by_y), distortion=changed)


def _by(camera_of: Callable[[F64], synthetic.Camera], steps: F64, points: F64) -> F64:
    """Differentiate the image of points (N, 3) by numbers of a camera, (2N, n) px."""
    columns: list[F64] = []
    for number, step in enumerate(np.diag(steps)):
        ahead, behind = (camera_of(sign * step).project(points) for sign in (1.0, -1.0))
        columns.append((ahead - behind).ravel() / (2.0 * steps[number]))
    return np.column_stack(columns)
