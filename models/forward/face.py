"""How the seen face of a plate moves where a camera looks at it, and where one near by would."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

import fe
import synthetic
from models.arrays import F32, F64, Mask
from models.forward.fields import Deflections, LargeFields

Float = TypeVar("Float", np.float32, np.float64)

_BESIDE = 1e-4  # mm; between places whose motions give a gradient


class LocalView(NamedTuple):
    """Places (n, 2) mm that a camera looks at, and its pixels by a motion there, (n, 2, 3)."""

    places: F64
    jacobian: F64


@dataclass(frozen=True, eq=False)
class Face:
    """The seen face of a plate, where it moves by A fields: K of the deflection, U in the plane.

    Attributes
    ----------
    fields : Deflections
    large : LargeFields or None
        What knows the motion in the plane; without it there is none.
    height : float, mm
        Over the middle plane.
    on : (N,) bool
        Pixels that look at the face, or not far beside it; the n of them. Nothing moves elsewhere.
    view : LocalView
        Of those, at the nearest points of the face.
    thicker : (n,) float64
        By which factor the plate is thicker there than described.
    """

    fields: Deflections
    large: LargeFields | None
    height: float
    on: Mask
    view: LocalView
    thicker: F64

    def motion(self, places: F64) -> F64:
        """Displacement by a unit of each field, where n pixels look or near there, (n, 3, A) mm."""
        count, drifts = self.fields.count, 0 if self.large is None else self.large.drifts
        moved = np.zeros((len(places), 3, count + drifts))
        # The face lies higher where the plate is thicker.
        lever = self.height * self.thicker[:, None, None]
        moved[:, :2, :count] = (-lever * self.fields.slope(places)).transpose(0, 2, 1)
        moved[:, 2, :count] = self.fields.value(places)
        if self.large is not None:
            moved[:, :2, count:] = self.large.drift(places)
        return moved

    def with_gradient(self, motion: F64) -> F32:
        """Motion (n, 3, A) and, after it, how it grows along x and y, (n, 9, A)."""
        places, middle = self.view.places, 0.5 * np.asarray(self.fields.plate.size)
        grown = np.empty((len(motion), 9, motion.shape[2]), dtype=np.float32)
        grown[:, :3] = motion
        for axis, rows in enumerate((np.s_[3:6], np.s_[6:9])):
            step = np.zeros_like(places)
            step[:, axis] = np.where(places[:, axis] > middle[axis], -_BESIDE, _BESIDE)
            grown[:, rows] = (self.motion(places + step) - motion) / step[:, axis, None, None]
        return grown

    def among(self, rows: F64) -> F64:
        """Take what linear forms of the motion of all pixels, (R, 2N), have of these, (R, 2n)."""
        by_pixel = rows.T.reshape(len(self.on), -1)[self.on]
        return by_pixel.reshape(-1, len(rows)).T

    def seen(self, motion: F64) -> F64:
        """Motion of these pixels by that of the face (n, 3, A), (2n, A) px."""
        return _flat(self.view.jacobian @ motion)

    def changed(self, other: LocalView, grown: F32) -> F32:
        """Motion that a camera near by sees more, of one with its gradient, (2n, A) px.

        To first order: it looks at other places, and in another way.
        """
        own = self.view.jacobian
        apart = (other.places - self.view.places)[:, :, None, None]
        weights = [other.jacobian - own, own * apart[:, 0], own * apart[:, 1]]
        return _flat(np.concatenate(weights, axis=2).astype(np.float32) @ grown)

    def raised(self, motion: F64) -> F64:
        """Motion that is seen more, by ln of how much longer the lever of slopes is, (2n, A) px."""
        bent = motion[:, :2].copy()
        bent[:, :, self.fields.count :] = 0.0
        return _flat(self.view.jacobian[:, :, :2] @ bent)


def _flat(seen: NDArray[Float]) -> NDArray[Float]:
    return seen.reshape(-1, seen.shape[2])


def seen_face(
    fields: Deflections,
    large: LargeFields | None,
    camera: synthetic.AnyCamera,
    height: float,
    px: F64,
    skirt: float,
) -> Face:
    """Find what pixels (N, 2) see of a face, or up to `skirt` px beside it."""
    on, places = near_plate(fields.plate, camera, height, px, skirt)
    thicker = fields.plate.material(places)[0] / fields.plate.thickness
    return Face(fields, large, height, on, _looked(camera, places, height), thicker)


def near_plate(
    plate: fe.Plate, camera: synthetic.AnyCamera, height: float, px: F64, skirt: float
) -> tuple[Mask, F64]:
    """Which pixels (N,) are within `skirt` px of the plate, and its points nearest to them, mm."""
    nearest = _nearest(plate, camera, height, px)
    near = np.abs(camera.project(_raised(nearest, height)) - px).max(axis=1) <= skirt
    return near, nearest[near]


def local_view(camera: synthetic.AnyCamera, plate: fe.Plate, height: float, px: F64) -> LocalView:
    """Where pixels (n, 2) look at a face."""
    return _looked(camera, _nearest(plate, camera, height, px), height)


def _looked(camera: synthetic.AnyCamera, places: F64, height: float) -> LocalView:
    return LocalView(places, camera.jacobian(_raised(places, height)))


def _nearest(plate: fe.Plate, camera: synthetic.AnyCamera, height: float, px: F64) -> F64:
    return np.clip(camera.on_plate(px, height), 0.0, np.asarray(plate.size))


def _raised(places: F64, height: float) -> F64:
    return np.column_stack([places, np.full(len(places), height)])
