"""The bend and twist of a base by which a plate looks as it does, from the whole pattern."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter

import fe
import synthetic
from dic import lay_tiles, prepare_tiles, tile_sums
from models.arrays import F64, AnyArray
from models.deformable.seen_shape import SeenShape
from models.deformable.shape_motions import beside_plate, rigid_and_base
from models.forward.tile_pattern import normal_matrix

# Blur of both images, px, and steps at most: a step finds what lies within the blur.
_BLURS = ((6.0, 6), (2.5, 6), (0.0, 8))
# mm and degrees that a step may go.
_REACH = np.array([1.0, 3.0])
# mm and degrees below which a step is the last one.
_SETTLED = np.array([2e-3, 5e-3])
# Prior of the camera's motion since the reference: shift in px, turn in rad, scale.
_CAMERA = np.array([3.0, 3.0, 0.01, 0.01])
# Tiles that differ by so many times the median are left out: a touch, or what lies before them.
_STRANGE = 9.0


@dataclass(frozen=True, eq=False)
class Watched:
    """A deformable plate and the camera before it.

    Attributes
    ----------
    camera : synthetic.AnyCamera
    reference : (H, W) float, grey levels
        Image of the flat plate.
    shell : fe.Shell
        The plate on the elements on which its image is made: of 20 a side the shape is right for
        touches and 0.005 px off, which is much to a light touch.
    tile : int, px
    """

    camera: synthetic.AnyCamera
    reference: AnyArray
    shell: fe.Shell
    tile: int = 16


@dataclass(frozen=True, eq=False)
class ShapeFit:
    """A shape that was fitted to an image.

    Attributes
    ----------
    state : fe.ShellState
    camera : (4,) float64, px and rad
        Motion of the camera since the reference: shift, turn, scale.
    misfit : float, grey levels²
        Mean square of what the shape leaves of the image, of the median tile.
    converged : bool
        Whether the last step was small.
    """

    state: fe.ShellState
    camera: F64
    misfit: float
    converged: bool


def fit_shape(watched: Watched, frame: AnyArray, start: fe.ShellState) -> ShapeFit:
    """Bend and twist a shape on until it looks as a frame does, from coarse to fine.

    Gauss-Newton on tile sums, with the reference moved to where the shape shows it, camera and
    light free. A touch is no part of it and moves bend and twist by what it looks like of them.
    """
    fit = ShapeFit(start, np.zeros(4), np.inf, False)
    for blur, steps in _BLURS:
        fit = _at_blur(watched, frame, fit, blur, steps)
    return fit


def misfit_of(watched: Watched, frame: AnyArray, start: fe.ShellState) -> ShapeFit:
    """Fit a shape to blurred images alone: enough to tell one branch from another."""
    return _at_blur(watched, frame, ShapeFit(start, np.zeros(4), np.inf, False), *_BLURS[0])


def _at_blur(watched: Watched, frame: AnyArray, fit: ShapeFit, blur: float, steps: int) -> ShapeFit:
    reference = gaussian_filter(np.asarray(watched.reference, dtype=np.float64), blur)
    image = gaussian_filter(np.asarray(frame, dtype=np.float64), blur)
    for _ in range(steps):
        moved, step = _step(watched, reference, image, fit)
        fit = moved
        if not fit.state.stability.converged or (np.abs(step) < _SETTLED).all():
            break
    return fit


def _step(
    watched: Watched, reference: AnyArray, image: AnyArray, fit: ShapeFit
) -> tuple[ShapeFit, F64]:
    """Give the fit after a step, and the step in mm and degrees."""
    state, seen = fit.state, SeenShape(fit.state, watched.camera)
    tiles = lay_tiles((image.shape[0], image.shape[1]), watched.tile)
    basis = rigid_and_base(seen, tiles)
    shown = prepare_tiles(seen.image(reference), watched.tile)
    flow = basis[:, :, :4] @ fit.camera
    sums = tile_sums(shown, image, flow)
    kept = ~beside_plate(seen, tiles)
    typical = float(np.median(sums.ee[kept])) if kept.any() else np.inf
    kept &= sums.ee <= _STRANGE * typical
    normal = normal_matrix(shown.hessian[kept], shown.light[kept], basis[kept], tiles.size)
    right = np.concatenate(
        [
            -np.einsum("ti,tik->k", sums.gradient[kept], basis[kept]),
            [sums.ef[kept].sum(), sums.e[kept].sum()],
        ]
    )
    misfit = typical / tiles.size**2
    prior = np.concatenate([misfit / _CAMERA**2, np.zeros(4)])
    right[:4] -= prior[:4] * fit.camera
    found = np.linalg.solve(normal + np.diag(prior), right)
    step: F64 = np.asarray(np.clip(found[4:6], -_REACH, _REACH), dtype=np.float64)
    base = fe.Base(max(state.base.bend + step[0], 0.0), state.base.twist + step[1])
    ahead = state.shell.moved(state, base)
    settled = bool((np.abs(step) < _SETTLED).all())
    return ShapeFit(ahead, fit.camera + found[:4], misfit, settled), step
