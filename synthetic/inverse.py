"""Which material point a pixel sees: the inverse of displacement and camera together."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from itertools import product

import numpy as np

from synthetic.arrays import F64, I32, Mask
from synthetic.compiled import njit
from synthetic.points import at_height
from synthetic.telecentric import AnyCamera

Displacement = Callable[[F64], F64]

# A material point is found when it is seen this close to its pixel.
TOLERANCE_PX = 1e-4
# Points that are not found in so many steps have a displacement that jumps.
MAX_STEPS = 30
# The search starts from cells of the plate of about this size in the image, so many at most.
_CELL_PX = 4
_MAX_CELLS = 1024
# Cells beyond each edge of the plate: a pixel whose middle is past the edge may see a bit of it.
_RIM = 2


@dataclass(frozen=True, eq=False)
class Inverse:
    """A displaced plate before a camera, ready to say what a pixel sees.

    Attributes
    ----------
    camera, displacement, z : as in `render`.
    size : (a, b) of the plate, mm.
    nodes : (R, C, 2) float64, mm, corners of the cells of the plate and of a rim around it.
    seen : (R, C, 2) float64, px, where the displaced nodes are seen.
    corner : (H, W) int32, for each pixel the first node of the cell seen there, as an index into
        R·C; −1 where neither plate nor rim is.
    border : pixels that `corner` goes beyond the image on each side.
    """

    camera: AnyCamera
    displacement: Displacement
    z: float
    size: tuple[float, float]
    nodes: F64 = field(repr=False)
    seen: F64 = field(repr=False)
    corner: I32 = field(repr=False)
    border: int

    def covers(self, pixels: F64) -> Mask:
        """Say which pixels (K, 2), whole numbers, see the plate or its rim: (K,)."""
        return self._corner(pixels) >= 0

    def follow(self, pixels: F64, offsets: F64) -> Iterator[F64]:
        """Find the material points that are seen near pixels, for one offset after the other.

        Parameters
        ----------
        pixels : (K, 2) float64, px, whole numbers that are covered.
        offsets : (S, 2) float64, px, from those pixels.

        Yields
        ------
        (K, 2) float64, mm, S times. Each point is seen within 1e-4 px of pixel + offset.

        Raises
        ------
        ValueError
            A point is not found, as where the displacement jumps.
        """
        points, slopes = self._start(pixels)
        before = np.zeros(2)
        for offset in offsets:
            points = points + _times(slopes, (offset - before)[None])
            before = offset
            self._refine(points, slopes, pixels + offset)
            yield points

    def _corner(self, pixels: F64) -> I32:
        column, row = pixels.astype(np.int64).T + self.border
        return self.corner[row, column]

    def _start(self, pixels: F64) -> tuple[F64, F64]:
        """Points by the affine map of their cell, and its slopes, (K, 2, 2) mm per px."""
        across, corner = self.nodes.shape[1], self._corner(pixels)
        X, p = self.nodes.reshape(-1, 2), self.seen.reshape(-1, 2)
        sides = [corner + 1, corner + across]
        dX, dp = (np.stack([t[s] - t[corner] for s in sides], axis=-1) for t in (X, p))
        slopes = dX @ np.linalg.inv(dp)
        return X[corner] + _times(slopes, pixels - p[corner]), slopes

    def _refine(self, points: F64, slopes: F64, px: F64) -> None:
        """Move points to where they are seen at px, in place; steps that missed correct the slopes.

        Broyden's method (1965): a step corrects the slopes along its own direction. A point is
        done when the place that its last step started from was near enough.
        """
        here = self._project(points) - px
        step = -_times(slopes, here)
        points += step
        lost = np.flatnonzero(_far(here))
        step, here = step[lost], here[lost]
        for _ in range(MAX_STEPS):
            if len(lost) == 0:
                return
            off = self._project(points[lost]) - px[lost]
            slopes[lost] = _corrected(slopes[lost], step, off - here)
            step, here = -_times(slopes[lost], off), off
            points[lost] += step
            far = _far(off)
            lost, step, here = lost[far], step[far], here[far]
        raise ValueError(
            f"plate points must be found to {TOLERANCE_PX:g} px, got {len(lost)} pixels without "
            f"one after {MAX_STEPS} steps, the first at {px[lost[0]].round(1).tolist()} px; use a "
            "displacement that does not jump"
        )

    def _project(self, points: F64) -> F64:
        moved = _continued(self.displacement, points, self.size)
        return self.camera.project(at_height(points, self.z) + moved)


def invert(
    camera: AnyCamera,
    displacement: Displacement,
    size: tuple[float, float],
    z: float,
    border: int = 0,
) -> Inverse:
    """Prepare the inverse of a displacement.

    Parameters
    ----------
    camera, displacement, z : as in `render`.
    size : (a, b) of the plate, mm.
    border : pixels around the image that are asked for as well.

    Raises
    ------
    ValueError
        The displacement is of wrong shape or not finite, the displaced plate is not before the
        camera, or it hides a part of itself.
    """
    nodes = _nodes(camera, size, z)
    points = nodes.reshape(-1, 2)
    rest = at_height(points, z)
    seen = camera.project(rest + _continued(displacement, points, size)).reshape(nodes.shape)
    _check_unfolded(camera.project(rest).reshape(nodes.shape), seen)
    width, height = (length + 2 * border for length in camera.size)
    corner = np.full((height, width), -1, np.int32)
    hidden = _cover(seen, border, corner)
    if hidden:
        raise ValueError(
            f"the displacement folds the plate over itself in {hidden} pixels of the image; "
            "use a smaller displacement"
        )
    return Inverse(camera, displacement, z, size, nodes, seen, corner, border)


def _nodes(camera: AnyCamera, size: tuple[float, float], z: float) -> F64:
    corners = at_height(np.array(list(product((0.0, size[0]), (0.0, size[1])))), z)
    px = camera.project(corners).reshape(2, 2, 2)
    lines: list[F64] = []
    for axis, length in enumerate(size):
        longest = np.linalg.norm(np.diff(px, axis=axis), axis=-1).max()
        count = int(np.clip(longest / _CELL_PX, 8, _MAX_CELLS))
        lines.append(np.arange(-_RIM, count + _RIM + 1, dtype=np.float64) * (length / count))
    return np.stack(np.meshgrid(*lines), axis=-1)


def _check_unfolded(rest: F64, seen: F64) -> None:
    """Raise ValueError when a part of the displaced face turns its back to the camera."""
    plate = np.s_[_RIM:-_RIM, _RIM:-_RIM]
    turned = _areas(rest[plate]) * _areas(seen[plate]) <= 0
    if turned.any():
        raise ValueError(
            f"the displacement folds the image in {turned.mean():.2%} of the plate; "
            "use a smaller displacement"
        )


def _areas(px: F64) -> F64:
    """Signed areas of the cells of a grid of points (R, C, 2), px²."""
    (ux, uy), (vx, vy) = (px[1:, 1:] - px[:-1, :-1]).T, (px[1:, :-1] - px[:-1, 1:]).T
    return (ux * vy - uy * vx) / 2


def _continued(displacement: Displacement, points: F64, size: tuple[float, float]) -> F64:
    """Displacement, mm, at points that may lie past the edge: there as its point reflection.

    Value and slope go on across the edge, and the displacement is asked for the plate alone.
    """
    edge = np.clip(points, 0, size)
    moved = _displaced(displacement, edge)
    past = np.flatnonzero((edge[:, 0] != points[:, 0]) | (edge[:, 1] != points[:, 1]))
    if len(past):
        mirrored = np.clip(2 * edge[past] - points[past], 0, size)
        moved = moved.copy()
        moved[past] = 2 * moved[past] - _displaced(displacement, mirrored)
    return moved


def _displaced(displacement: Displacement, points: F64) -> F64:
    moved = np.asarray(displacement(points), dtype=np.float64)
    if moved.shape != (len(points), 3):
        raise ValueError(
            f"displacement must return ({len(points)}, 3) mm for ({len(points)}, 2) mm points, "
            f"got {moved.shape}"
        )
    if not np.isfinite(moved).all():
        raise ValueError("displacement must be finite, got NaN or infinite values in mm")
    return moved


def _corrected(slopes: F64, step: F64, gained: F64) -> F64:
    """Slopes (K, 2, 2) mm per px by which a gain (K, 2) px was due to a step (K, 2) mm."""
    predicted = _times(slopes, gained)
    along = (step * predicted).sum(axis=1)
    sound = np.abs(along) > 0.1 * (step * step).sum(axis=1)
    row = (step[:, None, :] @ slopes)[:, 0] / np.where(sound, along, np.inf)[:, None]
    return slopes + (step - predicted)[:, :, None] * row[:, None, :]


def _far(off: F64) -> Mask:
    return np.maximum(np.abs(off[:, 0]), np.abs(off[:, 1])) > TOLERANCE_PX


def _times(matrices: F64, vectors: F64) -> F64:
    x, y = vectors.T
    (a, b), (c, d) = matrices.transpose(1, 2, 0)
    return np.column_stack([a * x + b * y, c * x + d * y])


@njit(cache=True, nogil=True)
def _cover(seen: F64, border: int, corner: I32) -> int:
    """Write into each pixel the cell that is seen there; count those that two parts share."""
    rows, columns = seen.shape[0] - 1, seen.shape[1] - 1
    hidden = 0
    for r in range(rows):
        for c in range(columns):
            quad = seen[r : r + 2, c : c + 2] + border
            rim = min(r, c, rows - 1 - r, columns - 1 - c) < _RIM
            left, right = int(np.ceil(quad[..., 0].min())), int(quad[..., 0].max())
            top, bottom = int(np.ceil(quad[..., 1].min())), int(quad[..., 1].max())
            for y in range(max(top, 0), min(bottom + 1, corner.shape[0])):
                for x in range(max(left, 0), min(right + 1, corner.shape[1])):
                    if not _inside(quad, x, y):
                        continue
                    before = corner[y, x]
                    if before >= 0:
                        r0, c0 = before // (columns + 1), before % (columns + 1)
                        there = min(r0, c0, rows - 1 - r0, columns - 1 - c0) < _RIM
                        # Neighbours share the pixels of their common side.
                        if not (rim or there) and max(abs(r - r0), abs(c - c0)) > 1:
                            hidden += 1
                    if before < 0 or not rim:
                        corner[y, x] = r * (columns + 1) + c
    return hidden


@njit(cache=True, nogil=True)
def _inside(quad: F64, x: int, y: int) -> bool:
    """Whether a point lies in either half of a quadrilateral, its sides included."""
    a, b, c, d = quad[0, 0], quad[0, 1], quad[1, 1], quad[1, 0]
    return _in_triangle(a, b, c, x, y) or _in_triangle(a, c, d, x, y)


@njit(cache=True, nogil=True)
def _in_triangle(a: F64, b: F64, c: F64, x: int, y: int) -> bool:
    u = (b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0])
    v = (c[0] - b[0]) * (y - b[1]) - (c[1] - b[1]) * (x - b[0])
    w = (a[0] - c[0]) * (y - c[1]) - (a[1] - c[1]) * (x - c[0])
    return (u >= 0 and v >= 0 and w >= 0) or (u <= 0 and v <= 0 and w <= 0)
