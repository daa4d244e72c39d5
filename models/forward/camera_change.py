"""How a plate looks to a camera that stands, looks and bends rays a little otherwise than said."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property, partial
from math import exp
from typing import NamedTuple, Protocol

import numpy as np

import synthetic
from models.arrays import F64
from models.forward.face import Face, local_view, seen_face
from models.forward.fields import InPlane
from models.forward.image_motion import SKIRT, plate_motions, with_tilts
from models.forward.tile_pattern import TilePattern

CAMERA = (
    ("turn_x", "rad"),
    ("turn_y", "rad"),
    ("turn_z", "rad"),
    ("shift_x", "mm"),
    ("shift_y", "mm"),
    ("shift_z", "mm"),
    ("focal", "1"),
    ("k1", "1"),
    ("k2", "1"),
)
"""Numbers of a camera and their units: the plate's turn and shift under it about the middle of the
plate, ln of the focal length, distortion beside that of the description."""

# Of derivatives by difference: what is left out is 1e-4 of them, rounding less.
_STEPS = np.array([1e-4, 1e-4, 1e-4, 0.02, 0.02, 0.02, 1e-4, 3e-4, 3e-4])
_THICKER = 1e-3
_POSE = 6  # of the numbers: turns and shifts
_LOOKS = 9  # places along each side of an image


class Seen(NamedTuple):
    """Amplitudes of K measured fields, as the camera described would see them, by all of the plate.

    Attributes
    ----------
    matrix : (K, A) float64
        What of a field looks like a motion of the camera has `uneven` taken off, as an image has.
    derivatives : (9, K, A) float64
        By each number of the camera, `uneven` as it is.
    by_thickness : (K, A) float64
        By ln thickness: the seen face moves by the slope times half of it.
    uneven : (K, R) float64 or None
        What a unit of each motion of the camera leaves, since one that stands otherwise moves the
        image otherwise than the one described; see `moving`. None where nothing moves so.
    """

    matrix: F64
    derivatives: F64
    by_thickness: F64
    uneven: F64 | None = None


class Look(Protocol):
    """What is measured of a plate's fields by what watches it, a camera or gauges."""

    def at(self, values: F64, thicker: float = 0.0, near: Seen | None = None) -> Seen:
        """Measure by a camera whose numbers are `values` (9,), of a plate thicker by e^thicker.

        Derivatives are those of `near`, where a camera near by was looked through before.
        """
        ...


@dataclass(frozen=True, eq=False)
class CameraChange:
    """A camera as it is described, and what it sees of a plate where it is otherwise.

    Attributes
    ----------
    pattern : TilePattern
        What is measured, through the camera described.
    fields : InPlane
        All A of the plate, the measured ones first.
    camera : synthetic.AnyCamera
    height : float, mm
        Height of the seen face over the plate's middle plane.
    """

    pattern: TilePattern
    fields: InPlane
    camera: synthetic.AnyCamera
    height: float

    def at(self, values: F64, thicker: float = 0.0, near: Seen | None = None) -> Seen:
        """Amplitudes seen by a camera whose numbers are `values` (9,), and their derivatives.

        The plate is thicker by a factor, of which `thicker` is the logarithm. The motion of the
        tiles by each field is resolved as that of an image is, see `TilePattern.resolving`: what
        resembles a shift of the camera is taken for one. Only a pinhole has such numbers.
        Derivatives take four times as long as what is seen, and are those of `near` where it is
        given.
        """
        camera, height = self.camera, self.height * exp(thicker)
        if isinstance(camera, synthetic.Camera):
            camera = varied(camera, self._middle, values)
        uneven = self._uneven(values, height)
        face = self._face(camera, height)
        motion = face.motion(face.view.places)
        every = face.among(self._resolving) @ face.seen(motion) + self._over_tiles
        matrix = self._even(every, uneven)
        if near is not None:
            return near._replace(matrix=matrix, uneven=uneven)
        return Seen(matrix, *self._derivatives(values, camera, face, motion, uneven), uneven)

    def _derivatives(
        self, values: F64, camera: synthetic.AnyCamera, face: Face, motion: F64, uneven: F64
    ) -> tuple[F64, F64]:
        """Differentiate the amplitudes by the numbers of a pinhole, (9, K, A), and by thickness."""
        px, plate, height = self.pattern.motions.tiles.xy[face.on], face.fields.plate, face.height
        grown, exact = face.with_gradient(motion), face.among(self._resolving)
        resolving = exact.astype(np.float32)

        def by(other: synthetic.AnyCamera, height: float, step: float) -> F64:
            changed = resolving @ face.changed(local_view(other, plate, height, px), grown)
            return self._even(changed.astype(np.float64), uneven) / step

        derivatives = np.zeros((len(_STEPS), self.pattern.count, motion.shape[2]))
        if isinstance(self.camera, synthetic.Camera):
            for k, step in enumerate(np.diag(_STEPS)):
                beside = varied(self.camera, self._middle, values + step)
                derivatives[k] = by(beside, height, _STEPS[k])
        by_thickness = by(camera, height * exp(_THICKER), _THICKER)
        by_thickness += self._even(exact @ face.raised(motion), uneven)
        return derivatives, by_thickness

    def _uneven(self, values: F64, height: float) -> F64:
        """Amplitudes (K, R) that motions of a camera leave whose numbers are `values` (9,)."""
        moves = moving(values, self._middle, height)
        seen = moves(self.camera, self.pattern.motions.tiles.xy)
        return self._resolving[: self.pattern.count] @ seen.reshape(-1, seen.shape[2])

    def _even(self, every: F64, uneven: F64) -> F64:
        """Amplitudes (K, A) of those seen with the motions of a camera, (K + R, A).

        Through a camera at a slant some of the plate's motion looks like one of the camera. What
        that leaves is taken off an image, so it is taken off here.
        """
        count = self.pattern.count
        return every[:count] - uneven @ every[count:]

    def _face(self, camera: synthetic.AnyCamera, height: float) -> Face:
        tiles = self.pattern.motions.tiles
        skirt = float(SKIRT * tiles.size)
        return seen_face(self.fields, self.fields, camera, height, tiles.xy, skirt)

    @cached_property
    def _over_tiles(self) -> F64:
        """What means over tiles add to their middles, through the camera described, (K + R, A)."""
        tiles, fields = self.pattern.motions.tiles, self.fields
        face = self._face(self.camera, self.height)
        mean = plate_motions(fields, self.camera, self.height, tiles, fields)
        middle = face.seen(face.motion(face.view.places))
        mean = self._resolving @ mean.reshape(-1, mean.shape[2])
        return mean - face.among(self._resolving) @ middle

    @cached_property
    def _resolving(self) -> F64:
        """Amplitudes and rigid motions by motion that is not yet smooth, (K + R, 2T)."""
        pattern = self.pattern
        rows = np.concatenate([pattern.resolving, pattern.resolving_camera])
        tiles = rows.T.reshape(len(pattern.reference.hessian), -1)
        return pattern.motions.spread.smooth_adjoint(tiles).reshape(-1, len(rows)).T

    @property
    def _middle(self) -> tuple[float, float, float]:
        a, b = self.fields.plate.size
        return 0.5 * a, 0.5 * b, 0.0


def moving(
    values: F64, middle: tuple[float, float, float], height: float
) -> Callable[[synthetic.AnyCamera, F64], F64]:
    """Return how the image moves with a camera that stands otherwise than described.

    Where a pinhole looks at a slant, or its lens distorts, a camera that drifts moves the image
    unevenly: at 1° and k1 = -0.03, the shift of 1 px is another one by 5 mpx at its borders.

    Parameters
    ----------
    values : (9,) float64
        Numbers of the camera, see `CAMERA`.
    middle : tuple of float, mm
        Point of the plate about which it turns.
    height : float, mm
        Of the seen face over the plate's middle plane.

    Returns
    -------
    callable
        From a camera described and pixels (N, 2) to (N, 2, R) px by a unit of each of the motions
        of `with_tilts`, as near to these as those of this camera come.
    """

    def moves(camera: synthetic.AnyCamera, px: F64) -> F64:
        if not isinstance(camera, synthetic.Camera):
            return with_tilts(camera, px)
        pose = partial(_by_pose, camera, values, middle, height)
        width, rows = camera.size
        looks = np.stack(np.meshgrid(*(np.linspace(0, n - 1, _LOOKS) for n in (width, rows))), -1)
        looks = looks.reshape(-1, 2)
        own, wanted = pose(looks), with_tilts(camera, looks)
        own, wanted = (part.reshape(2 * len(looks), -1) for part in (own, wanted))
        return pose(px) @ np.linalg.lstsq(own, wanted, rcond=None)[0]

    return moves


def _by_pose(
    camera: synthetic.Camera,
    values: F64,
    middle: tuple[float, float, float],
    height: float,
    px: F64,
) -> F64:
    """Differentiate pixels (N, 2) by turns, rad, and shifts, mm, of the plate, (N, 2, 6) px."""
    points = varied(camera, middle, values).on_plate(px, height)
    points = np.column_stack([points, np.full(len(points), height)])
    columns: list[F64] = []
    for step in np.diag(_STEPS)[:_POSE]:
        ends = [varied(camera, middle, values + sign * step).project(points) for sign in (1, -1)]
        columns.append((ends[0] - ends[1]) / (2.0 * step.sum()))
    return np.stack(columns, axis=2)


def varied(
    camera: synthetic.Camera, middle: tuple[float, float, float], values: F64
) -> synthetic.Camera:
    """Return a camera whose numbers differ by `values` (9,), see `CAMERA`.

    Parameters
    ----------
    camera : synthetic.Camera
    middle : tuple of float, mm
        Point of the plate about which it turns.
    values : (9,) float64
    """
    pose = synthetic.rotated(camera.T_cam_plate, values[:3], middle).copy()
    pose[:3, 3] += pose[:3, :3] @ values[3:6]
    lens = camera.distortion or synthetic.Distortion()
    bent = replace(lens, k1=lens.k1 + float(values[7]), k2=lens.k2 + float(values[8]))
    return replace(
        camera, focal=camera.focal * float(np.exp(values[6])), T_cam_plate=pose, distortion=bent
    )
