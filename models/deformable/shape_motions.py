"""How the image of a bent plate moves with touches on it, with its base and with the camera."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

import fe
import synthetic
from dic import Tiles
from models.arrays import F64, Mask
from models.deformable.seen_shape import SeenShape
from models.forward.image_motion import ImageMotions, tile_mean
from models.forward.linear import Forward
from models.forward.tile_spline import spread_over

BASE = ("bend", "twist")
"""Numbers of a base, mm and degrees: the last of the motions that are no fields of a touch."""

# Series of the response are wrong by up to so much of what is measured where they are trusted.
MODEL_ERROR = 0.01


@dataclass(frozen=True, eq=False)
class ShapeFields:
    """Fields of touches on a bent plate, as a pattern reads them.

    Attributes
    ----------
    of_touches : fe.ShellResponse
    """

    of_touches: fe.ShellResponse

    @property
    def plate(self) -> fe.Plate:
        """The plate."""
        return self.of_touches.plate

    @property
    def count(self) -> int:
        """How many fields there are."""
        return self.of_touches.count

    @property
    def drifts(self) -> int:
        """No fields beside these."""
        return 0

    def value(self, xy: F64) -> F64:
        """Motion of the middle along z by a unit of each field, (N, K)."""
        return self.of_touches.motion(xy, "middle")[:, 2]

    def slope(self, xy: F64) -> F64:
        """Leave out: slopes enter the motion of the face (N, 3, K) itself."""
        return np.zeros((len(xy), self.count, 2))

    def response(self, xy: F64) -> F64:
        """Amplitudes per N under a light touch at each place, (n, 2) mm → (n, K)."""
        return light_response(self.of_touches, xy)

    def drift(self, places: F64) -> F64:
        """Have no motion beside the fields, (N, 2, 0)."""
        return np.zeros((len(places), 2, 0))

    def amplitudes(self, xy: F64, force: F64) -> F64:
        """Amplitudes of the fields under touches (n, 2) mm and (n,) N, (K,)."""
        return self.of_touches.amplitudes(xy, force).sum(axis=0)

    def forward(self, factor: F64) -> Forward:
        """Forward model of amplitudes whitened by a factor (K, m)."""
        return ShapeForward(self.of_touches, factor)


@dataclass(frozen=True, eq=False)
class ShapeForward:
    """A measurement of touches on a bent plate, to third order in each force.

    Touches add up: that one stiffens or softens the plate for another is left out.

    Attributes
    ----------
    of_touches : fe.ShellResponse
    factor : (K, m) float64
        From amplitudes to the measurement in units of its noise.
    """

    of_touches: fe.ShellResponse
    factor: F64

    @property
    def plate(self) -> fe.Plate:
        """The plate that is touched."""
        return self.of_touches.plate

    @property
    def freedom(self) -> int:
        """Numbers that were measured."""
        return self.factor.shape[1]

    @property
    def model_error(self) -> float:
        """See `Forward.model_error`."""
        return MODEL_ERROR

    def own_error(self, touches: F64) -> float:
        """None: see `Forward.own_error`."""
        return 0.0

    def whiten(self, measured: ArrayLike) -> F64:
        """Return a measurement that is in units of its noise already, (m,)."""
        return np.asarray(measured, dtype=np.float64)

    def response(self, xy: F64) -> F64:
        """Measurement per N under a light touch at each place, (n, 2) mm → (n, m)."""
        return light_response(self.of_touches, xy) @ self.factor

    def read(self, touches: F64) -> tuple[F64, F64]:
        """Measurement (m,) under touches x, y, F, (n, 3), and its exact derivatives (3n, m)."""
        if not len(touches):
            return np.zeros(self.freedom), np.empty((0, self.freedom))
        xy, force = touches[:, :2], touches[:, 2]
        jacobian = self.of_touches.gradient(xy, force).swapaxes(1, 2) @ self.factor
        amplitudes = self.of_touches.amplitudes(xy, force).sum(axis=0)
        return amplitudes @ self.factor, jacobian.reshape(-1, self.freedom)


def light_response(of_touches: fe.ShellResponse, xy: F64) -> F64:
    """Amplitudes per N under a light touch at each place, (n, 2) mm → (n, K)."""
    return of_touches.gradient(xy, np.zeros(len(xy)))[:, :, 2]


def shape_motions(seen: SeenShape, tiles: Tiles, response: fe.ShellResponse) -> ImageMotions:
    """See the motions of a bent plate on every tile, as means over the tile.

    Of touches, then of the camera (shift, turn, scale), then of `BASE`.
    """
    tangent = fe.base_tangent(response.state)
    motions = tile_mean(tiles, lambda px: _seen(seen, response.state, tangent, response, px))
    spread = spread_over(tiles.shape)
    coefficients = spread.fit(motions.reshape(len(motions), -1))
    basis = coefficients.reshape(-1, motions.shape[2]).astype(np.float32)
    fields = ShapeFields(response)
    nearer = np.zeros((len(basis) // 2, motions.shape[2]), dtype=np.float32)
    every = np.ones(len(tiles.xy), dtype=np.bool_)  # who prepares a pattern hides those beside it
    return ImageMotions(fields, fields, tiles, spread, basis, nearer, every)


def rigid_and_base(seen: SeenShape, tiles: Tiles) -> F64:
    """Motion of the middle of every tile by the camera and by `BASE`, (T, 2, 6) px."""
    return _seen(seen, seen.state, fe.base_tangent(seen.state), None, tiles.xy)


def _seen(
    seen: SeenShape,
    state: fe.ShellState,
    tangent: F64,
    response: fe.ShellResponse | None,
    px: F64,
) -> F64:
    xy, _ = seen.material(px)
    face = seen.camera.face
    along = seen.camera.jacobian(seen.places(xy))
    base = fe.face_motion(state, tangent, xy, face)
    parts = [synthetic.rigid_motion_basis(seen.camera, px), along @ base]
    if response is not None:
        parts.insert(0, along @ response.motion(xy, face))
    return np.concatenate(parts, axis=2)


def beside_plate(seen: SeenShape, tiles: Tiles) -> Mask:
    """Which tiles (T,) see more than the plate: their corners, a pixel further, are beside it."""
    half = tiles.size / 2 + 1.0
    beside = np.zeros(len(tiles.xy), dtype=np.bool_)
    for corner in ((-half, -half), (half, -half), (-half, half), (half, half)):
        beside |= ~seen.material(tiles.xy + corner)[1]
    return beside
