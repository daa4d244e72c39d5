"""How a plate looks to a camera that stands, looks and bends rays a little otherwise than said."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

import synthetic
from models.arrays import F64
from models.forward.image_motion import ImageMotions, InPlane, at_middles, plate_motions

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

# Of derivatives by difference: the error of second order is 1e-4 of them, rounding less.
_STEPS = np.array([1e-3, 1e-3, 1e-3, 0.2, 0.2, 0.2, 1e-3, 3e-3, 3e-3])


class Seen(NamedTuple):
    """Amplitudes of K measured fields, as the camera described would see them, by all of the plate.

    Attributes
    ----------
    matrix : (K, A) float64
    derivatives : (9, K, A) float64
        By each number of the camera.
    """

    matrix: F64
    derivatives: F64


@dataclass(frozen=True, eq=False)
class CameraChange:
    """A camera as it is described, and what it sees of a plate where it is otherwise.

    Attributes
    ----------
    motions : ImageMotions
        Of the measured fields, through the camera described.
    fields : InPlane
        All A of the plate, the measured ones first.
    camera : synthetic.AnyCamera
    height : float, mm
        Height of the seen face over the plate's middle plane.
    """

    motions: ImageMotions
    fields: InPlane
    camera: synthetic.AnyCamera
    height: float

    def at(self, values: F64) -> Seen:
        """Amplitudes seen by a camera whose numbers are `values` (9,), and their derivatives.

        The motion of the tiles by each field is resolved into the motions described, those of the
        camera with them: what resembles a shift of the camera is taken for one. Only a pinhole has
        such numbers.
        """
        inverse = self._inverse
        if not isinstance(self.camera, synthetic.Camera):
            matrix = inverse @ self._motion(self.camera)
            return Seen(matrix, np.zeros((len(_STEPS), *matrix.shape)))
        matrix = inverse @ self._motion(self._varied(self.camera, values))
        derivatives: list[F64] = []
        for k, step in enumerate(_STEPS):
            change = np.zeros(len(_STEPS))
            change[k] = step
            ahead, behind = (
                self._motion(self._varied(self.camera, values + sign * change))
                for sign in (1.0, -1.0)
            )
            derivatives.append(inverse @ (ahead - behind) / (2.0 * step))
        return Seen(matrix, np.stack(derivatives))

    def _varied(self, camera: synthetic.Camera, values: F64) -> synthetic.Camera:
        return varied(camera, self._middle, values)

    @cached_property
    def _inverse(self) -> F64:
        known = self.motions.fields
        camera = self.motions.tile_basis().reshape(-1, self.motions.basis.shape[1])[:, known:]
        basis = np.concatenate([self._motion(self.camera)[:, :known], camera], axis=1)
        return np.asarray(np.linalg.pinv(basis)[:known], dtype=np.float64)

    def _motion(self, camera: synthetic.AnyCamera) -> F64:
        """Motion of the middles of tiles by each field, smooth, (2T, A) px."""
        tiles, fields, spread = self.motions.tiles, self.fields, self.motions.spread
        seen = plate_motions(fields, camera, self.height, tiles, fields, at_middles)
        smooth = spread.over_tiles(spread.fit(seen.reshape(len(seen), -1)))
        return smooth.reshape(-1, seen.shape[2])

    @property
    def _middle(self) -> tuple[float, float, float]:
        a, b = self.fields.plate.size
        return 0.5 * a, 0.5 * b, 0.0


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
