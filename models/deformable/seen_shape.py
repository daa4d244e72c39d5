"""What a camera sees of a plate that is bent far."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.interpolate import RectBivariateSpline
from scipy.ndimage import map_coordinates

import fe
import synthetic
from models.arrays import F32, F64, AnyArray, Mask

# Lines of the grid on which the shape is read, a side: cubic splines between them are off by less
# than 1e-4 of an element's bend.
_LINES = 97
# Pixels between those whose material points are found; the map between them is a spline.
_STEP = 8
_STEPS = 12
# mm by which the last step may still move a point, and by which a pixel that sees the plate may
# miss its material point.
_EXACT, _FOUND_MM = 1e-6, 1e-3
# Of the spline through the reference.
_DEGREE = 5


@dataclass(frozen=True, eq=False)
class SeenShape:
    """A shape of a plate before a camera.

    Attributes
    ----------
    state : fe.ShellState
    camera : synthetic.AnyCamera
    """

    state: fe.ShellState
    camera: synthetic.AnyCamera

    @property
    def height(self) -> float:
        """Height of the seen face over the middle plane, mm."""
        return self.camera.face_height(self.state.plate.thickness)

    def places(self, xy: F64) -> F64:
        """Where points (N, 2) mm of the seen face are, (N, 3) mm."""
        return self.at_rest(xy) + self.state.displacement(xy, self.camera.face)

    def at_rest(self, xy: F64) -> F64:
        """Where they are on the flat plate, (N, 3) mm."""
        return np.column_stack([xy, np.full(len(xy), self.height)])

    def material(self, px: F64) -> tuple[F64, Mask]:
        """Find the points of the plate (N, 2) mm that pixels (N, 2) see, and which do see it.

        A pixel beside the plate has the nearest point that Newton's method came to.
        """
        xy, beyond = self._newton(px)
        return xy, np.abs(beyond).max(axis=1) < _FOUND_MM

    def _newton(self, px: F64) -> tuple[F64, F64]:
        """Points on the plate (N, 2) mm, and how far beyond them pixels see by its slopes, mm."""
        across, down = self._map
        size = np.asarray(self.state.plate.size)
        xy = np.clip(self.camera.on_plate(px, self.height), 0.0, size)
        step = 0
        while True:
            x, y = xy.T
            off = px - np.column_stack([across.ev(x, y), down.ev(x, y)])
            slopes = np.empty((len(px), 2, 2))
            for row, spline in enumerate((across, down)):
                slopes[:, row, 0], slopes[:, row, 1] = spline.ev(x, y, 1, 0), spline.ev(x, y, 0, 1)
            beyond = np.asarray(np.linalg.solve(slopes, off[:, :, None])[:, :, 0], np.float64)
            if step == _STEPS or np.abs(np.clip(xy + beyond, 0.0, size) - xy).max() < _EXACT:
                return xy, beyond
            xy, step = np.clip(xy + beyond, 0.0, size), step + 1

    def image(self, reference: AnyArray) -> F32:
        """Move an image (H, W) of the flat plate to where this shape shows it."""
        height, width = (int(side) for side in reference.shape)
        down, across = (np.arange(0.0, side + _STEP, _STEP) for side in (height, width))
        columns, rows = np.meshgrid(across, down)
        px = np.column_stack([columns.ravel(), rows.ravel()])
        # Beside the plate the map goes on straight: a kink at the edge would spread into it.
        came_from = self.camera.project(self.at_rest(np.add(*self._newton(px)))) - px
        y, x = np.arange(float(height)), np.arange(float(width))
        motion = [
            RectBivariateSpline(down, across, came_from[:, axis].reshape(columns.shape))(y, x)
            for axis in (0, 1)
        ]
        source = [y[:, None] + motion[1], x[None] + motion[0]]
        found = map_coordinates(
            np.asarray(reference, dtype=np.float64), source, order=_DEGREE, mode="nearest"
        )
        return np.asarray(found, dtype=np.float32)

    @cached_property
    def _map(self) -> tuple[RectBivariateSpline, RectBivariateSpline]:
        """Column and row at which each point of the plate is seen."""
        a, b = self.state.plate.size
        x, y = np.linspace(0.0, a, _LINES), np.linspace(0.0, b, _LINES)
        xy = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2)
        seen = self.camera.project(self.places(xy)).T.reshape(2, _LINES, _LINES)
        return RectBivariateSpline(x, y, seen[0]), RectBivariateSpline(x, y, seen[1])
