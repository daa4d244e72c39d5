"""Touches on a plate that is bent and twisted, with bend and twist of its base, from one image."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

import fe
from dic import TileReference, prepare_tiles, tile_sums
from models.arrays import F64, AnyArray
from models.deformable.pressed_table import PressedTable, pressed_table
from models.deformable.seen_shape import SeenShape
from models.deformable.shape_fit import ShapeFit, Watched
from models.deformable.shape_motions import MODEL_ERROR, beside_plate, shape_motions
from models.deformable.surface import SOFT, Surface, SurfaceEstimate
from models.estimate import Estimate, Result
from models.forward.tile_pattern import TilePattern, prepare_pattern
from models.inverse.estimator import Estimator

FIELDS = 150
# Steps of base and camera on one response, and responses that are prepared anew.
_PASSES, _RESPONSES = 4, 4
# Largest motion of a tile, px, at which a pass is the last one.
_SETTLED = 0.01
# mm and degrees that a base may move on the tangent before the response is prepared anew: at most,
# and at least, which is what noise moves it by. Between them, what changes the least stiffness of
# the shape by so much of it: a touch bends it by as much more or less.
_FAR, _NEAR, _ALIKE = np.array([0.03, 0.1]), np.array([0.0006, 0.002]), 0.02
# Ratio of one order of the response to the one before, beyond which the next ones count: the
# error is about its cube.
_SERIES = 0.3
# χ² in parts of what noise and the errors of the model leave, beyond which other starts are tried,
# and beyond which no touch is stated: 1.0 to 1.8 where one was right.
_UNUSUAL, _STRANGE = 1.7, 4.0
# Ratio of the orders of the response, up to which touches are starts.
_TABLE_SERIES = 0.5
# Mean square that a shape which is right may leave of an image: of the noise, and of the contrast,
# for a pixel sees a smaller or larger piece of a steep plate than of the flat one.
_FITS, _IMAGING = 1.3, 0.02


_NOTHING = Estimate(
    np.empty((0, 2)), np.empty(0), np.empty((0, 0)), np.nan, 1, 0.0, Result.UNRESOLVABLE
)


# Order at which shapes converge with their elements: measured between 3 and 4.
_ORDER = 3


@dataclass(frozen=True, eq=False)
class PreparedShape:
    """A shape whose response to touches is ready: frame after frame costs what a flat plate does.

    Attributes
    ----------
    state : fe.ShellState
        Untouched.
    response : fe.ShellResponse
    shown : TileReference
        The flat reference, moved to where the shape shows it.
    pattern : TilePattern
    estimator : Estimator
    noise : float, grey levels
        Of a frame of the camera.
    mesh_error : (m,) float64
        What the elements of the shape may be off by, in units of the noise of the forward model.
    reach : (2,) float64, mm and degrees
        How far the base may bend and twist on before the response is another one.
    """

    state: fe.ShellState
    response: fe.ShellResponse
    shown: TileReference
    pattern: TilePattern
    estimator: Estimator
    noise: float
    mesh_error: F64
    reach: F64

    def still(self, camera: F64) -> F64:
        """Amplitudes (K + 6,) of an untouched shape whose camera moved by (4,)."""
        return np.concatenate([np.zeros(self.response.count), camera, np.zeros(2)])

    def travelled(self, motion: F64) -> float:
        """How far the base has moved, in parts of what the response is good for."""
        return float((np.abs(motion[-2:]) / self.reach).max())

    def explains(self, misfit: float) -> bool:
        """Whether noise and imaging explain what the shape leaves of an image, grey levels²."""
        contrast = float(self.shown.image.std())
        return misfit <= _FITS * self.noise**2 + (_IMAGING * contrast) ** 2

    def carried(self, rest: F64, before: PreparedShape) -> F64:
        """Take over what another shape near by showed at rest: amplitudes (K,) of its response."""
        camera = np.zeros(len(before.pattern.still()) - len(rest))
        flow = before.pattern.motions.flow(np.concatenate([rest, camera]))
        flow = np.where(self.pattern.hidden[:, None], 0.0, flow)
        return np.asarray(self.pattern.resolving @ flow.ravel(), dtype=np.float64)

    def read(
        self, frame: AnyArray, motion: F64, touches: F64, rest: F64 | None = None
    ) -> SurfaceEstimate:
        """Find touches, camera and base in a frame, from those of the frame before.

        Parameters
        ----------
        frame : (H, W) uint8, uint16 or float, grey levels
        motion : (K + 6,) float64
            Of the frame before, or `still`.
        touches : (n, 3) float64, mm, mm, N
            Of the frame before.
        rest : (K,) float64, optional
            Amplitudes of the response that frames without a touch showed, which the elements of the
            shape leave. Without it they count in σ.
        """
        estimate, pattern, count = _NOTHING, self.pattern, self.response.count
        left, measured = np.zeros(count) if rest is None else rest, np.empty(0)
        for _ in range(_PASSES):
            sums = tile_sums(self.shown, frame, *pattern.motions.flow_and_gradient(motion))
            right = pattern.gradient(sums, motion) - pattern.normal[:, :count] @ left
            before, measured = motion, pattern.whiten(right, self.noise)
            estimate = self._fitted(measured, touches)
            touches = np.column_stack([estimate.xy, estimate.force])
            motion = pattern.amplitudes(estimate, right)
            motion[:count] += left
            if pattern.motions.max_motion(motion - before) < _SETTLED:
                break
        sums = tile_sums(self.shown, frame, *pattern.motions.flow_and_gradient(motion))
        misfit = float(np.median(sums.ee[~pattern.hidden])) / self.shown.tiles.size**2
        return self._judged(estimate, motion, misfit, measured, resting=rest is not None)

    def _fitted(self, measured: F64, touches: F64) -> Estimate:
        """Find touches; from those of other forces where light ones lead to none that fits."""
        estimate = self.estimator.fit_whitened(measured, touches)
        if unexplained(estimate, measured) <= _UNUSUAL:
            return estimate
        for start in self._table.nearest(measured):
            other = self.estimator.fit_whitened(measured, start[None])
            if other.chi2 < estimate.chi2:
                estimate = other
            if unexplained(estimate, measured) <= _UNUSUAL:
                break
        return estimate

    @cached_property
    def _table(self) -> PressedTable:
        return pressed_table(self.response, self.pattern.factor / self.noise, _TABLE_SERIES)

    def _judged(
        self, estimate: Estimate, motion: F64, misfit: float, measured: F64, *, resting: bool
    ) -> SurfaceEstimate:
        """Say what the image can show; touches that it cannot are unresolvable."""
        at, touches = self.state.base, np.column_stack([estimate.xy, estimate.force])
        base = fe.Base(
            max(at.bend + motion[-2], 0.0), float(np.clip(at.twist + motion[-1], -89, 89))
        )
        surface = self._surface(motion, misfit, touches)
        if surface is Surface.SEEN and unexplained(estimate, measured) > _STRANGE:
            surface = Surface.STRANGE
        if surface is not Surface.SEEN:
            estimate = replace(estimate, result=Result.UNRESOLVABLE)
        # What the noise of the camera does not explain scatters as well.
        spread = max(1.0, misfit / self.noise**2)
        scatter = spread * estimate.covariance
        if not resting:
            scatter = scatter + self._off_by_mesh(touches)
        estimate = replace(estimate, covariance=scatter)
        covariance = spread * base_covariance(self.pattern, self.response, touches, self.noise)
        return SurfaceEstimate(estimate, base, covariance, surface, misfit, motion, measured)

    def _off_by_mesh(self, touches: F64) -> F64:
        """Add to the covariance of touches (n, 3) what the elements may be off by, (3n, 3n)."""
        jacobian = self.estimator.forward.read(touches)[1]
        off = np.linalg.lstsq(jacobian.T, self.mesh_error, rcond=None)[0]
        return np.asarray(np.outer(off, off), dtype=np.float64)

    def _surface(self, motion: F64, misfit: float, touches: F64) -> Surface:
        if (np.abs(motion[-2:]) > _FAR).any():
            return Surface.MOVED_ON
        if not self.explains(misfit):
            return Surface.NO_FIT
        if self.state.stability.eigenvalue < SOFT:
            return Surface.NEAR_LIMIT
        if len(touches):
            series = self.response.nonlinearity(touches[:, :2], touches[:, 2]).max()
            if series > _SERIES:
                return Surface.TOO_SOFT
        return Surface.MOVED_ON if self.travelled(motion) > 1.0 else Surface.SEEN


def prepare_shape(
    watched: Watched,
    state: fe.ShellState,
    noise: float,
    max_touches: int = 1,
    friction: float = 0.0,
) -> PreparedShape:
    """Prepare a shape for frames in which its base hardly moves.

    Parameters
    ----------
    watched : Watched
    state : fe.ShellState
        Untouched, stable.
    noise : float, grey levels
        Of a frame of the camera.
    max_touches : int
    friction : float
        Of touches, see `Estimator`.

    Raises
    ------
    ValueError
        The state is not a stable equilibrium, or too little of it is in view to tell its fields
        apart.
    """
    response = fe.shell_response(state, FIELDS)
    finer = watched.shell.taken_over(state)
    seen = SeenShape(finer if finer.stability.converged else state, watched.camera)
    shown = prepare_tiles(seen.image(watched.reference), watched.tile)
    motions = shape_motions(seen, shown.tiles, response)
    pattern = prepare_pattern(motions, shown).hiding(beside_plate(seen, shown.tiles))
    forward = pattern.forward(noise)
    estimator = Estimator(forward, max_touches=max_touches, friction=friction)
    off = _mesh_error(pattern, seen, SeenShape(state, watched.camera)) / noise
    return PreparedShape(state, response, shown, pattern, estimator, noise, off, _reach(state))


def _reach(state: fe.ShellState) -> F64:
    """How far a base may move before its shape is stiffer or softer, (2,) mm and degrees."""
    base, (bend, twist) = state.base, _FAR.tolist()
    back = base.twist - float(np.copysign(twist, base.twist))  # a base has no twist beyond 90°
    changes: list[float] = []
    for there in (fe.Base(base.bend + bend, base.twist), fe.Base(base.bend, back)):
        moved = state.shell.moved(state, there).stability
        change = abs(moved.eigenvalue / state.stability.eigenvalue - 1.0)
        changes.append(change if np.isfinite(change) else np.inf)
    return np.maximum(_FAR * (_ALIKE / np.maximum(changes, _ALIKE)), _NEAR)


def unexplained(estimate: Estimate, measured: F64) -> float:
    """Return χ² of touches in parts of what noise and the errors of the model leave."""
    off = MODEL_ERROR**2 * float(measured @ measured)
    return estimate.chi2 / (estimate.dof + off)


def _mesh_error(pattern: TilePattern, fine: SeenShape, coarse: SeenShape) -> F64:
    """Estimate what elements of a shape are off by from coarser ones, at a noise of 1, (m,)."""
    xy, _ = fine.material(pattern.motions.tiles.xy)
    ratio = fine.state.mesh.units[0] / coarse.state.mesh.units[0]
    part = ratio**_ORDER / (1.0 - ratio**_ORDER) if ratio < 1.0 else 1.0
    camera = fine.camera
    off = camera.project(fine.places(xy)) - camera.project(coarse.places(xy))
    off[pattern.hidden] = 0.0
    amplitudes = pattern.resolving @ off.ravel()
    return np.asarray(part * (pattern.factor.T @ amplitudes), dtype=np.float64)


def estimate_on_shape(
    watched: Watched, frame: AnyArray, fit: ShapeFit, noise: float, max_touches: int = 1
) -> SurfaceEstimate:
    """Find base and touches in a single frame.

    Where touches had moved the shape that was fitted without them, it is moved on and its response
    prepared again.

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
    state, camera, found = fit.state, fit.camera, _unknown(fit)
    for _ in range(_RESPONSES):
        if not fit.converged or not state.stability.converged:
            return replace(found, estimate=_NOTHING, surface=Surface.NO_FIT)
        prepared = prepare_shape(watched, state, noise, max_touches)
        found = prepared.read(frame, prepared.still(camera), np.empty((0, 3)))
        if found.surface is not Surface.MOVED_ON:
            return found
        state, camera = state.shell.moved(state, found.base), found.motion[-6:-2]
    return replace(found, surface=Surface.NO_FIT)


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


def _unknown(fit: ShapeFit) -> SurfaceEstimate:
    unknown, base = np.full((2, 2), np.nan), fit.state.base
    none = np.empty(0)
    return SurfaceEstimate(_NOTHING, base, unknown, Surface.NO_FIT, fit.misfit, none, none)
