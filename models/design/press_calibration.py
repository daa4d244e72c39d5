"""Known presses correct the forward model: where the camera is, its lens, how soft the plate is.

The image of a plate pressed at a known place with a known force is known as well. What it differs
by is small and smooth: Gauss-Newton on the tile sums of all images at once, for seven numbers of
the camera and the softness of the plate. Free beside them for every press: the motion of the camera
since the reference, the light of every tile, and by how much finger and scale were off.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation
from scipy.special import chdtrc

import synthetic
from dic import TileReference, prepare_blocks, tile_gradient, tile_sums
from models.arrays import F64, AnyArray, Mask
from models.design.shared_reference import SharedReference
from models.forward.image_motion import ImageMotions

SHARED = 8  # turn (3), shift (3), focal length, softness
OWN = 3  # x, y, F of each press, before the motions of the camera
STEPS = (1e-3, 1e-3, 1e-3, 0.5, 0.5, 1.0, 1e-3, 1e-2)  # rad, mm and fractions: of differences
NUDGES = (0.2, 0.2, 1e-2)  # mm, mm, fraction
ROUNDS = 3  # of Newton's method with derivatives from the start: each leaves a few percent


@dataclass(frozen=True)
class PriorSigma:
    """Standard deviations of what is known beforehand.

    Attributes
    ----------
    turn : float, rad
        Of the plate before the camera, about each axis.
    shift : float
        Along each axis, a fraction of its distance.
    focal, softness : float
        Fractions.
    place : float, mm
        Of a press, along x and y each.
    force : float
        Of a press, a fraction.
    """

    turn: float = 0.02
    shift: float = 0.02
    focal: float = 0.03
    softness: float = 0.3
    place: float = 0.3
    force: float = 0.02


@dataclass(frozen=True, eq=False)
class PressCorrection:
    """A forward model that known presses have corrected.

    Attributes
    ----------
    camera : synthetic.Camera
    softness : float
        Deflection of the real plate over that of the model.
    covariance : (8, 8) float64
        Of the turn (rad) and shift (mm) of the plate before the camera, about where the camera's
        axis meets the plate, and of the logarithms of focal length and softness.
    p_value : float
        Probability that a model that is right would be corrected by so much.
    """

    camera: synthetic.Camera
    softness: float
    covariance: F64
    p_value: float

    @property
    def pose_covariance(self) -> F64:
        """Of a turn about the camera's axes and of the shift of the plate's origin, (6, 6)."""
        arm = self.camera.T_cam_plate[:3, 3] - _pivot(self.camera)
        towards = np.eye(6)
        towards[3:, :3] = np.cross(np.eye(3), arm).T  # turn × arm
        return towards @ self.covariance[:6, :6] @ towards.T


def correct_by_presses(
    camera: synthetic.Camera,
    look: Callable[[synthetic.Camera], ImageMotions],
    reference: TileReference,
    images: Sequence[AnyArray] | AnyArray,
    touches: F64,
    noise: tuple[float, float],
    hidden: Mask | None = None,
    prior_sigma: PriorSigma | None = None,
) -> PressCorrection:
    """Correct camera and softness by images of known presses.

    Parameters
    ----------
    camera : synthetic.Camera
        As it is thought to be.
    look : callable
        ImageMotions of plate and camera on the tiles of the reference, as a camera sees them.
    reference : TileReference
    images : (P, H, W) array, or as many (H, W) arrays, grey levels
        One of each press, or the mean of several.
    touches : (P, 3) float64
        x, y (mm) and F (N) of the presses.
    noise : (float, float), grey levels
        Of an image, and of the reference, whose errors all presses share.
    hidden : (P, T) bool, optional
        Tiles of each image that a hand hides; see `models.hidden_tiles`.
    prior_sigma : PriorSigma, optional

    Raises
    ------
    ValueError
        If there is not one image a press.
    """
    if len(images) != len(touches) or not len(touches):
        raise ValueError(
            f"{len(touches)} known presses need an image each, got {len(images)}; give one each"
        )
    prior_sigma, blocks = prior_sigma or PriorSigma(), prepare_blocks(reference, 1)
    prior = _prior(camera, prior_sigma)
    nothing = np.zeros((len(touches), len(blocks.hessian)), dtype=np.bool_)
    visible = ~(nothing if hidden is None else hidden)
    system = SharedReference(_bases(camera, look, touches), SHARED, visible, noise)
    normal = system.normal(blocks.hessian) + np.diag(_known(prior, prior_sigma, system))
    numbers, still = np.zeros(SHARED), np.zeros((len(touches), system.own - OWN))
    for _ in range(ROUNDS):
        motions = look(_moved(camera, numbers))
        shown = np.empty((len(touches), *blocks.hessian.shape[:2]))
        for index, (touch, image) in enumerate(zip(touches, images, strict=True)):
            flow = _flow(motions, touch, numbers[-1], still[index])
            shown[index] = tile_gradient(blocks, tile_sums(reference, image, flow))
        right = system.right(shown)
        right[:SHARED] -= prior * numbers
        step = np.linalg.solve(normal, right)
        numbers = numbers + step[:SHARED]
        still += step[SHARED:].reshape(len(touches), -1)[:, OWN:]
    covariance = np.asarray(np.linalg.inv(normal)[:SHARED, :SHARED], dtype=np.float64)
    proof = float(numbers @ (np.linalg.inv(covariance) - np.diag(prior)) @ numbers)
    return PressCorrection(
        camera=_moved(camera, numbers),
        softness=float(np.exp(numbers[-1])),
        covariance=covariance,
        p_value=float(chdtrc(SHARED, max(proof, 0.0))),
    )


def _prior(camera: synthetic.Camera, prior_sigma: PriorSigma) -> F64:
    """Precision of the shared numbers, (8,)."""
    along = prior_sigma.shift * float(np.linalg.norm(camera.T_cam_plate[:3, 3]))
    spread = [prior_sigma.turn] * 3 + [along] * 3 + [prior_sigma.focal, prior_sigma.softness]
    return np.array(spread) ** -2.0


def _known(prior: F64, prior_sigma: PriorSigma, system: SharedReference) -> F64:
    """Precision of all numbers of a system beforehand, (M,)."""
    touch = np.array([prior_sigma.place, prior_sigma.place, prior_sigma.force]) ** -2.0
    alone = np.concatenate([touch, np.zeros(system.own - OWN)])
    return np.concatenate([prior, np.tile(alone, len(system.bases))])


def _moved(camera: synthetic.Camera, numbers: F64) -> synthetic.Camera:
    """Turn and shift the plate before a camera, about where its axis meets the plate."""
    turn = Rotation.from_rotvec(numbers[:3]).as_matrix()
    pivot = _pivot(camera)
    pose = camera.T_cam_plate.copy()
    pose[:3, :3] = turn @ pose[:3, :3]
    pose[:3, 3] = turn @ (pose[:3, 3] - pivot) + pivot + numbers[3:6]
    return replace(camera, T_cam_plate=pose, focal=camera.focal * float(np.exp(numbers[6])))


def _pivot(camera: synthetic.Camera) -> F64:
    """Where the camera's axis meets the plate, in the camera frame, mm."""
    return np.array([0.0, 0.0, camera.scale * camera.focal])


def _flow(motions: ImageMotions, touch: F64, soft: float, still: F64) -> F64:
    """Motion (T, 2) px of the tiles by a touch x, y, F on a plate softer by a factor exp(soft)."""
    fields = motions.modal_amplitudes(touch[None, :2], touch[2:] * np.exp(soft))
    return motions.flow(np.concatenate([fields, still]))


def _bases(
    camera: synthetic.Camera, look: Callable[[synthetic.Camera], ImageMotions], touches: F64
) -> F64:
    """How the tiles of each press move by what is unknown of it, (P, T, 2, 8 + k).

    First the 8 shared numbers, then the k of the press: its touch and R motions of the camera.
    """
    here, *nudged = (look(_moved(camera, nudge)) for nudge in np.diag((0.0, *STEPS))[:-1, 1:])
    rigid = here.tile_basis()[:, :, here.fields :]
    still = np.zeros(rigid.shape[2])
    found: list[F64] = []
    for touch in touches:
        flow = _flow(here, touch, 0.0, still)
        moved = [_flow(motions, touch, 0.0, still) for motions in nudged]
        moved.append(_flow(here, touch, STEPS[-1], still))
        aside = touch + np.diag(NUDGES) * (1.0, 1.0, touch[2])
        moved += [_flow(here, one, 0.0, still) for one in aside]
        slopes = (np.stack(moved, axis=2) - flow[:, :, None]) / (*STEPS, *NUDGES)
        found.append(np.concatenate([slopes, rigid], axis=2))
    return np.array(found)
