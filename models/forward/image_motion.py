"""How the image moves with the plate and with the camera, whatever pattern is on the plate."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

import fe
import synthetic
from dic import Tiles
from models.arrays import F32, F64, Mask
from models.forward.face import near_plate, seen_face
from models.forward.fields import Deflections, LargeFields
from models.forward.tile_spline import TileSpline, spread_over

SKIRT = 8
"""Tiles beside the plate up to which its motion goes on as that of its nearest point.

A free edge moves, and splines bend where a motion ends: three tiles on that left 3 % of a touch
unexplained, eight tiles on nothing that images resolve.
"""
_REACHED = 0.5  # tiles beside the plate, up to which the middle of one may lie that sees some of it


Field = Callable[[F64], F64]
"""What k fields do to pixels: (N, 2) px → (N, 2, k)."""


@dataclass(frozen=True, eq=False)
class ImageMotions:
    """How the image of every tile moves with the plate and the camera, whatever is on it.

    Attributes
    ----------
    modes : Deflections
        Modes of the plate.
    large : LargeFields or None
        Where touches are large: what knows their K amplitudes, of modes and of motion in the plane.
        Without it these are amplitudes of modes, linear in the force.
    tiles : Tiles
    spread : TileSpline
        From the coefficients of a motion to the motion of every tile.
    basis : (2C, K + R) float32, px
        Coefficients of the motion to first order, x then y of each, by a unit of every field of the
        plate and rigid motion of the camera.
    nearer : (C, K + R) float32
        Coefficients of how much nearer to the camera the plate comes, a fraction of its distance.
    on_plate : (T,) bool
        Tiles that see some of the plate; what lies beside it does not move with it.
    """

    modes: Deflections
    large: LargeFields | None
    tiles: Tiles
    spread: TileSpline
    basis: F32
    nearer: F32
    on_plate: Mask

    @property
    def plate_modes(self) -> fe.Modes:
        """The modes, for what is linear in the force.

        Raises
        ------
        ValueError
            The plate stands on a bench whose numbers are not those described.
        """
        if not isinstance(self.modes, fe.Modes):
            raise ValueError(
                "these motions are those of a bench that differs from its description, and modes of"
                " the plate are asked for; set estimator.bench to 'exact'"
            )
        return self.modes

    @property
    def fields(self) -> int:
        """Number K of fields of the plate."""
        return self.modes.count + (0 if self.large is None else self.large.drifts)

    def modal_amplitudes(self, xy: F64, force: F64) -> F64:
        """Amplitudes of the fields of the plate under touches (n, 2) mm and (n,) N, (K,)."""
        if not len(force):
            return np.zeros(self.fields)
        if self.large is not None:
            return self.large.amplitudes(xy, force)
        return force @ self.modes.response(xy)

    def flow(self, amplitudes: F64) -> F64:
        """Motion of what each tile sees for given amplitudes (K + R,), (T, 2) px."""
        return self.flow_and_gradient(amplitudes)[0]

    def flow_and_gradient(self, amplitudes: F64) -> tuple[F64, F64]:
        """Motion of what each tile sees for given amplitudes (K + R,), and its gradient.

        The field u is that of material points where they were; a tile at x sees the point that
        came from x - d, so it reads d(x) = u(x - d) ≈ u - ∇u·u. Without the second term a camera
        that shifts takes every touch along with it, twice as far as it moved itself. A plate that
        comes nearer by a fraction c of its distance is seen to move 1 / (1 - c) times as far.

        Returns
        -------
        (T, 2) float64, px
        (T, 2, 2) float64, px a px
            ∂u/∂x, ∂u/∂y; ∂v/∂x, ∂v/∂y.
        """
        coefficients = self._coefficients(amplitudes).reshape(-1, 2)
        coefficients = coefficients / (1.0 - self.nearer @ amplitudes.astype(np.float32))[:, None]
        u = self.spread.over_tiles(coefficients)
        gradient = np.stack(self.spread.slopes(coefficients), axis=2) / self.tiles.size
        return u - gradient[:, :, 0] * u[:, :1] - gradient[:, :, 1] * u[:, 1:], gradient

    @cached_property
    def on_tiles(self) -> F32:
        """What `tile_basis` returns, kept, at half the size: for a partly hidden pattern."""
        return self.tile_basis().astype(np.float32)

    @cached_property
    def energy(self) -> F64:
        """Products of the motions summed over all tiles, (K + R, K + R) px²."""
        wide = self.tile_basis().reshape(-1, self.basis.shape[1])
        return wide.T @ wide

    def max_motion(self, amplitudes: F64) -> float:
        """Bound of the motion of any tile for given amplitudes, px: the largest coefficient."""
        return float(np.abs(self._coefficients(amplitudes)).max())

    def project(self, gradient: F64, flow: F64) -> F32:
        """Sum over the tiles what each says of each amplitude, at a flow: (T, 2) → (K + R,).

        The adjoint of a small change of `flow`, but for the turn of u by its own gradient (1e-3).
        """
        fraction = flow / self.tiles.size
        along_x, along_y = gradient * fraction[:, :1], gradient * fraction[:, 1:]
        total = self.spread.project(gradient) - self.spread.project_slopes(along_x, along_y)
        return total.ravel().astype(np.float32) @ self.basis

    def tile_basis(self) -> F64:
        """Motion of every tile by a unit of every mode and rigid motion, (T, 2, K + R) px."""
        count = self.basis.shape[1]
        wide = self.basis.astype(np.float64).reshape(-1, 2 * count)
        return self.spread.over_tiles(wide).reshape(-1, 2, count)

    def _coefficients(self, amplitudes: F64) -> F32:
        return self.basis @ amplitudes.astype(np.float32)


def prepare_motions(
    modes: Deflections,
    camera: synthetic.AnyCamera,
    height: float,
    tiles: Tiles,
    large: LargeFields | None = None,
    moves: Callable[[synthetic.AnyCamera, F64], F64] = synthetic.rigid_motion_basis,
) -> ImageMotions:
    """See motions of the plate and of the camera on every tile, as means over the tile.

    Parameters
    ----------
    modes : Deflections
        Enough of them carry a touch's field: 200 to 0.2 %.
    camera : synthetic.AnyCamera
    height : float, mm
        Height of the seen face over the plate's middle plane.
    tiles : Tiles
    large : LargeFields, optional
        For touches that are large; its modes must be the ones given.
    moves : callable
        ImageMotions of the camera: from camera and pixels (N, 2) to (N, 2, R) px a unit of each;
        `with_tilts` where it may tilt as well.
    """
    spread, skirt = spread_over(tiles.shape), float(SKIRT * tiles.size)
    seen = plate_motions(modes, camera, height, tiles, large)
    motions = np.concatenate([seen, tile_mean(tiles, lambda px: moves(camera, px))], axis=2)
    coefficients = spread.fit(motions.reshape(len(motions), -1))
    basis = coefficients.reshape(-1, motions.shape[2]).astype(np.float32)
    nearer = np.zeros((len(basis) // 2, motions.shape[2]), dtype=np.float32)
    nearer[:, : modes.count] = spread.fit(_nearer(modes, camera, height, tiles.xy, skirt))
    on_plate, _ = near_plate(modes.plate, camera, height, tiles.xy, _REACHED * tiles.size)
    return ImageMotions(modes, large, tiles, spread, basis, nearer, on_plate)


def plate_motions(
    modes: Deflections,
    camera: synthetic.AnyCamera,
    height: float,
    tiles: Tiles,
    large: LargeFields | None,
) -> F64:
    """Mean motion of every tile by a unit of every field of the plate, (T, 2, K + U) px."""
    skirt = float(SKIRT * tiles.size)
    return tile_mean(tiles, lambda px: _seen(modes, large, camera, height, px, skirt))


def with_tilts(camera: synthetic.AnyCamera, px: F64) -> F64:
    """Image motion by shift, turn and scale, and by the two tilts of a pinhole, (N, 2, R) px.

    A camera that tilts by θ sees a ray (x, y) move by f θ (x², x y), beside a shift; so does a
    plate that tilts under it, by its change of distance. To leave them free makes places 1 to 2 %
    and forces 0 to 8 % less sure (512², PVC of 1 and 2 mm).
    """
    rigid = synthetic.rigid_motion_basis(camera, px)
    if not isinstance(camera, synthetic.Camera):
        return rigid
    x, y = ((px - camera.centre) / camera.focal).T
    tilts = np.stack([np.stack([x * x, x * y], 1), np.stack([x * y, y * y], 1)], axis=2)
    return np.concatenate([rigid, camera.focal * tilts], axis=2)


def _seen(
    modes: Deflections,
    large: LargeFields | None,
    camera: synthetic.AnyCamera,
    height: float,
    px: F64,
    skirt: float,
) -> F64:
    """Motion of every field in the image, (N, 2, K + U) px; none beyond the skirt of the plate."""
    face = seen_face(modes, large, camera, height, px, skirt)
    motion = face.motion(face.view.places)
    seen = np.zeros((len(px), 2, motion.shape[2]))
    seen[face.on] = face.seen(motion).reshape(-1, *seen.shape[1:])
    return seen


def _nearer(
    modes: Deflections, camera: synthetic.AnyCamera, height: float, px: F64, skirt: float
) -> F64:
    """Fraction of its distance by which every mode brings the plate nearer at pixels, (N, K)."""
    nearer = np.zeros((len(px), modes.count))
    if isinstance(camera, synthetic.Camera):
        inside, places = near_plate(modes.plate, camera, height, px, skirt)
        pose = camera.T_cam_plate
        depth = places @ pose[2, :2] + pose[2, 2] * height + pose[2, 3]
        nearer[inside] = -pose[2, 2] * modes.value(places) / depth[:, None]
    return nearer


def tile_mean(tiles: Tiles, field: Field) -> F64:
    """Mean of a field over each tile by 2 x 2 Gauss points, (T, 2, k)."""
    step = 0.5 * tiles.size / np.sqrt(3.0)
    corners = [(-step, -step), (step, -step), (-step, step), (step, step)]
    total = field(tiles.xy + corners[0])
    for corner in corners[1:]:
        total += field(tiles.xy + corner)
    return total / len(corners)
