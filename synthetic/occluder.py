"""A hand before the camera: a polygon with a soft border that hides a part of the image."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from synthetic.arrays import F64
from synthetic.light import soft_step
from synthetic.points import checked


@dataclass(frozen=True, eq=False)
class Occluder:
    """Something that hides a part of the image.

    Attributes
    ----------
    outline : (V, 2) float64, px, corners of a polygon in order; it may leave the image.
    shade : light that comes from it, 0 to 1 as that of the plate.
    border : width over which it gives way to the plate, px.

    Raises
    ------
    ValueError
        Fewer than three corners, a border that is not positive or a shade below 0.
    """

    outline: F64
    shade: float = 0.4
    border: float = 4.0

    def __post_init__(self):
        outline = checked(self.outline, 2, "outline of the hand", "px").copy()
        if len(outline) < 3:
            raise ValueError(f"outline of the hand needs 3 corners or more, got {len(outline)}")
        if not 0 < self.border < np.inf:
            raise ValueError(f"border of the hand must be positive, got {self.border} px")
        if not 0 <= self.shade < np.inf:
            raise ValueError(f"shade of the hand must be at least 0, got {self.shade}")
        outline.flags.writeable = False
        object.__setattr__(self, "outline", outline)

    def coverage(self, shape: tuple[int, int]) -> F64:
        """Fraction of each pixel of an image (H, W) that is hidden, 0 to 1: (H, W) float64."""
        hidden = np.zeros(shape)
        low = np.maximum(np.floor(self.outline.min(axis=0) - self.border).astype(int), 0)
        high = np.maximum(np.ceil(self.outline.max(axis=0) + self.border).astype(int) + 1, 0)
        box = np.s_[low[1] : high[1], low[0] : high[0]]
        y, x = (part[box] for part in np.indices(shape, dtype=np.float64))
        hidden[box] = soft_step(_depth(x, y, self.outline) / self.border)
        return hidden

    def cover(self, light: F64) -> F64:
        """Put the hand before an image (H, W)."""
        hidden = self.coverage(light.shape)
        return light + hidden * (self.shade - light)


def _depth(x: F64, y: F64, outline: F64) -> F64:
    """Distance of points from the sides of a polygon, positive inside."""
    nearest, inside = np.full(x.shape, np.inf), np.zeros(x.shape, dtype=bool)
    for (ax, ay), (bx, by) in pairwise(np.vstack([outline, outline[:1]])):
        dx, dy = bx - ax, by - ay
        square = max(dx * dx + dy * dy, 1e-12)
        along = np.clip(((x - ax) * dx + (y - ay) * dy) / square, 0, 1)
        nearest = np.minimum(nearest, np.hypot(x - ax - along * dx, y - ay - along * dy))
        if dy != 0:  # a ray to the right crosses the side
            inside ^= ((ay > y) != (by > y)) & (x < ax + (y - ay) * dx / dy)
    return np.where(inside, nearest, -nearest)
