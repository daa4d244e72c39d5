"""Touches on a plate that is bent and twisted, with bend and twist of its base, from one image."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import Enum

import numpy as np

import fe
from dic import lay_tiles, prepare_tiles, tile_sums
from models.arrays import F64, AnyArray
from models.deformable.seen_shape import SeenShape
from models.deformable.shape_fit import ShapeFit, Watched
from models.deformable.shape_motions import beside_plate, shape_motions
from models.estimate import Estimate, Result
from models.forward.tile_pattern import TilePattern, prepare_pattern
from models.inverse.estimator import Estimator

FIELDS = 150
# Steps of base and camera on one response, and responses that are prepared anew.
_PASSES, _RESPONSES = 3, 3
# mm and degrees that a base may move on the tangent before the response is prepared anew.
_NEAR = np.array([0.03, 0.1])
# Ratio of one order of the response to the one before, beyond which the next ones count: the
# error is about its cube.
_SERIES = 0.3
# Least eigenvalue, in parts of that at rest, at which a small touch or step moves the plate far.
_LIMIT = 0.1
# Noise of an image that a shape explains, over that which the camera is known to have.
_FITS = 1.3


class Surface(Enum):
    """What an image says of a deformable plate; the value is the sentence to show."""

    SEEN = "base and touches found"
    NEAR_LIMIT = (
        "the base is near a limit point, where a small touch moves the plate far: place and force"
        " cannot be told; bend it more or twist it less"
    )
    TOO_SOFT = (
        "the touch bends this base by more than its tangent is good for: place and force cannot be"
        " told; press less"
    )
    NO_FIT = (
        "no bend and twist explain the image: the base may be outside of the range, may have"
        " snapped, or something lies before it"
    )


@dataclass(frozen=True, eq=False)
class SurfaceEstimate:
    """A base and the touches on it.

    Attributes
    ----------
    estimate : Estimate
        Touches; UNRESOLVABLE where `surface` says that they cannot be told.
    fit : ShapeFit
        Shape of the base, and the camera.
    covariance : (2, 2) float64
        Of bend and twist, mm and degrees.
    surface : Surface
    """

    estimate: Estimate
    fit: ShapeFit
    covariance: F64
    surface: Surface

    @property
    def base(self) -> fe.Base:
        """Bend and twist."""
        return self.fit.state.base


def estimate_on_shape(
    watched: Watched, frame: AnyArray, fit: ShapeFit, noise: float, max_touches: int = 1
) -> SurfaceEstimate:
    """Find touches on a shape, and what they and the base share.

    Parameters
    ----------
    watched : Watched
    frame : (H, W) uint8, uint16 or float, grey levels
    fit : ShapeFit
        Of the same frame, touches left out.
    noise : float, grey levels
        Of a frame of the camera.
    max_touches : int
    """
    if not fit.converged or not fit.state.stability.converged:
        return _unknown(fit, Surface.NO_FIT)
    found = _estimated(watched, frame, fit, max_touches)
    for _ in range(_RESPONSES - 1):
        step = np.abs(np.array(_numbers(found.base)) - _numbers(fit.state.base))
        if (step <= _NEAR).all() or not found.fit.state.stability.converged:
            break
        fit = found.fit
        found = _estimated(watched, frame, fit, max_touches)
    return _judged(found, noise)


def _estimated(
    watched: Watched, frame: AnyArray, fit: ShapeFit, max_touches: int
) -> SurfaceEstimate:
    """Fit touches, camera and base on the response of a shape."""
    state, seen = fit.state, SeenShape(fit.state, watched.camera)
    response = fe.shell_response(state, FIELDS)
    shown = prepare_tiles(seen.image(watched.reference), watched.tile)
    motions = shape_motions(seen, lay_tiles(shown.image.shape, watched.tile), response)
    pattern = prepare_pattern(motions, shown).hiding(beside_plate(seen, shown.tiles))
    noise = float(np.sqrt(fit.misfit))
    estimator = Estimator(pattern.forward(noise), max_touches=max_touches)
    moved = np.concatenate([np.zeros(response.count), fit.camera, np.zeros(2)])
    touches = np.empty((0, 3))
    for _ in range(_PASSES):
        sums = tile_sums(shown, frame, motions.flow(moved))
        right = pattern.gradient(sums, moved)
        estimate = estimator.fit_whitened(pattern.whiten(right, noise), touches)
        touches = np.column_stack([estimate.xy, estimate.force])
        moved = pattern.amplitudes(estimate, right)
    sums = tile_sums(shown, frame, motions.flow(moved))
    misfit = float(np.median(sums.ee[~pattern.hidden])) / watched.tile**2
    base = fe.Base(max(state.base.bend + moved[-2], 0.0), state.base.twist + moved[-1])
    found = ShapeFit(state.shell.moved(state, base), moved[-6:-2], misfit, True)
    covariance = base_covariance(pattern, response, touches, float(np.sqrt(misfit)))
    surface = Surface.SEEN
    if len(touches) and response.nonlinearity(touches[:, :2], touches[:, 2]).max() > _SERIES:
        surface = Surface.TOO_SOFT
    return SurfaceEstimate(estimate, found, covariance, surface)


def base_covariance(
    pattern: TilePattern, response: fe.ShellResponse, touches: F64, noise: float
) -> F64:
    """Covariance (2, 2) of bend and twist beside touches (n, 3), camera and light."""
    count = response.count
    jacobian = np.empty((count, 0))
    if len(touches):
        gradient = response.gradient(touches[:, :2], touches[:, 2])
        jacobian = gradient.transpose(1, 0, 2).reshape(count, -1)
    others = np.eye(len(pattern.normal) - count)
    wide = np.block(
        [
            [jacobian, np.zeros((count, len(others)))],
            [np.zeros((len(others), jacobian.shape[1])), others],
        ]
    )
    fisher = wide.T @ pattern.normal @ wide / noise**2
    scale = 1.0 / np.sqrt(np.diag(fisher))
    inverse = np.linalg.pinv(scale[:, None] * fisher * scale) * np.outer(scale, scale)
    first = jacobian.shape[1] + 4
    return np.asarray(inverse[first : first + 2, first : first + 2], dtype=np.float64)


def _judged(found: SurfaceEstimate, noise: float) -> SurfaceEstimate:
    """Say what the image can tell; touches that it cannot are unresolvable."""
    stability, surface = found.fit.state.stability, found.surface
    if not stability.converged or found.fit.misfit > _FITS * noise**2:
        surface = Surface.NO_FIT
    elif stability.eigenvalue < _LIMIT:
        surface = Surface.NEAR_LIMIT
    if surface is Surface.SEEN:
        return found
    estimate = replace(found.estimate, result=Result.UNRESOLVABLE)
    return replace(found, estimate=estimate, surface=surface)


def _unknown(fit: ShapeFit, surface: Surface) -> SurfaceEstimate:
    none = np.empty((0, 2)), np.empty(0), np.empty((0, 0))
    estimate = Estimate(*none, np.nan, 1, 0.0, Result.UNRESOLVABLE)
    return SurfaceEstimate(estimate, fit, np.full((2, 2), np.nan), surface)


def _numbers(base: fe.Base) -> tuple[float, float]:
    return base.bend, base.twist
