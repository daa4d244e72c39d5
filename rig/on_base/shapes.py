"""What takes seconds and is done in the background: find a shape, follow it, list all that rest."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

import fe
import models
from rig.live.snapshot import StableShape
from rig.live.view import View
from rig.on_base.base_bench import BaseBench
from rig.system.arrays import F64, AnyArray

# Points a side between which the image of a bent plate is followed.
_LINES = 21
# Of two shapes, in parts of the largest displacement: elements of another list differ by less.
_SAME = 0.05


@dataclass(frozen=True, eq=False)
class ReadyShape:
    """A shape whose response to touches is ready.

    Attributes
    ----------
    shape : models.PreparedShape
    camera : (4,) float64, px and rad
        Motion of the camera since the reference: shift, turn, scale.
    view : View
        Where its edges are seen, and the homography that comes nearest to the face.
    """

    shape: models.PreparedShape
    camera: F64
    view: View


@dataclass(frozen=True, eq=False)
class ListedShapes:
    """The stable shapes of a base.

    Attributes
    ----------
    base : fe.Base
    shapes : tuple of fe.BaseShape
        By energy.
    all_sought : bool
        Whether they are all that are found, or one and its half turns.
    """

    base: fe.Base
    shapes: tuple[fe.BaseShape, ...]
    all_sought: bool = True

    def marked(self, state: fe.ShellState) -> tuple[StableShape, ...]:
        """List them with the one that an image shows, which may be none of them."""
        off = [float(np.abs(each.state.values - state.values).max()) for each in self.shapes]
        largest = max(float(np.abs(state.values).max()), state.plate.thickness)
        nearest = int(np.argmin(off)) if off and min(off) < _SAME * largest else None
        listed = [
            _stable_shape(each, shown=number == nearest) for number, each in enumerate(self.shapes)
        ]
        if nearest is None:
            other = fe.BaseShape(state, state.energy, fe.shape_name(state))
            listed.append(_stable_shape(other, shown=True))
        return tuple(listed)


def _stable_shape(shape: fe.BaseShape, *, shown: bool) -> StableShape:
    verdict = models.shape_verdict(shape.state.stability)
    return StableShape(shape.name, shape.energy, verdict.name, shown)


def find_shape(
    bench: BaseBench, watched: models.Watched, frame: AnyArray, noise: float
) -> ReadyShape | None:
    """Identify the shape in an image of which nothing is known; None where no base explains it."""
    return _ready(bench, watched, models.identify_shape(watched, frame, bench.known), noise)


def find_again(
    bench: BaseBench,
    watched: models.Watched,
    frame: AnyArray,
    last: models.PreparedShape,
    noise: float,
) -> ReadyShape | None:
    """Identify the shape in an image from the one before, or else as if that were not known."""
    fit = models.fit_shape(watched, frame, last.state)
    found = _ready(bench, watched, fit, noise)
    if found is not None and found.shape.explains(fit.misfit):
        return found
    return find_shape(bench, watched, frame, noise)


def follow_shape(
    bench: BaseBench, watched: models.Watched, last: ReadyShape, base: fe.Base, camera: F64
) -> ReadyShape | None:
    """Move a shape on to another base near by and prepare it there; None where it ends."""
    shape = last.shape
    state = shape.state.shell.moved(shape.state, base)
    found = models.ShapeFit(state, camera, np.inf, state.stability.converged)
    return _ready(bench, watched, found, shape.noise)


def turns_of(state: fe.ShellState) -> ListedShapes:
    """List a shape and its half turns, which rest on the same base with the same energy."""
    turned = models.turned_shapes(state)
    shapes = (fe.BaseShape(each, each.energy, fe.shape_name(each)) for each in turned)
    return ListedShapes(state.base, tuple(shapes), all_sought=False)


def list_shapes(bench: BaseBench, base: fe.Base) -> ListedShapes:
    """Seek all shapes that a base leaves the plate to rest in."""
    return ListedShapes(base, fe.base_shapes(bench.plate, base, bench.shell.mesh))


def _ready(
    bench: BaseBench, watched: models.Watched, fit: models.ShapeFit, noise: float
) -> ReadyShape | None:
    if not (fit.converged and fit.state.stability.converged):
        return None
    shape = models.prepare_shape(watched, fit.state, noise, bench.max_touches, bench.friction)
    return ReadyShape(shape, fit.camera, _view(models.SeenShape(fit.state, watched.camera)))


def _view(seen: models.SeenShape) -> View:
    """Return where a camera sees the edges of a bent plate, and its face as a homography."""
    a, b = seen.state.plate.size
    along, still = np.linspace(0.0, 1.0, _LINES)[:-1], np.zeros(_LINES - 1)
    sides = [(along, still), (still + 1, along), (1 - along, still + 1), (still, 1 - along)]
    edge = np.concatenate([np.column_stack(side) for side in sides]) * (a, b)
    lines = [np.linspace(0.0, side, _LINES) for side in (a, b)]
    face = np.stack(np.meshgrid(*lines), axis=-1).reshape(-1, 2)
    outline, px = (seen.camera.project(seen.places(xy)) for xy in (edge, face))
    T, _ = cv2.findHomography(face, px)
    return View(outline, np.asarray(T, dtype=np.float64))
