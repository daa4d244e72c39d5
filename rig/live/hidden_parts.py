"""What hides the pattern, named: something in the way, or a place that is worn in every frame."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy import ndimage

import synthetic
from dic import Tiles
from rig.system.arrays import F64, Mask

FRAMES = 30  # of a run that must be seen before a place is called worn
MEMORY = 1000  # frames over which it is looked at how frequently a place is hidden
ALWAYS = 0.9  # of them, in which a worn place is hidden


@dataclass(frozen=True, eq=False)
class HiddenParts:
    """Which tiles have been hidden, in what part of the frames of late.

    Attributes
    ----------
    corners : (T, 2, 2) float64, mm
        Lowest and highest x, y of what each tile sees of the plate.
    shape : (int, int)
        Rows and columns of the tiles.
    frames : int
        Seen so far.
    fraction : (T,) float64
        Of the frames in which each was hidden, those long ago counting less.
    enough : int
        Frames that must be seen before a place is called worn.
    """

    corners: F64
    shape: tuple[int, int]
    frames: int
    fraction: F64
    enough: int = FRAMES

    @classmethod
    def of(cls, tiles: Tiles, camera: synthetic.AnyCamera, height: float) -> HiddenParts:
        """Build those of tiles before any frame; the seen face lies `height` mm up."""
        half = 0.5 * tiles.size
        ends = [camera.on_plate(tiles.xy + side, height) for side in (-half, half)]
        corners = np.stack([np.minimum(*ends), np.maximum(*ends)], axis=1)
        return cls(corners, tiles.shape, 0, np.zeros(len(corners)))

    def followed(self, hidden: Mask) -> HiddenParts:
        """Count a frame in which tiles (T,) are hidden."""
        frames = self.frames + 1
        fraction = self.fraction + (hidden - self.fraction) / min(frames, MEMORY)
        return replace(self, frames=frames, fraction=fraction)

    def sentence(self, hidden: Mask) -> str:
        """Name what hides tiles (T,) of a frame, by size and place; empty where nothing does."""
        worn = hidden & self.worn
        passing = hidden & ~worn
        said = list[str]()
        if passing.any():
            size, place = self._largest(passing)
            said.append(f"something of {size} mm is in the way about {place} mm")
        if worn.any():
            size, place = self._largest(worn)
            said.append(
                f"the pattern is worn, or something lies on it, over {size} mm about {place} mm"
            )
        return " and ".join(said)

    @property
    def worn(self) -> Mask:
        """Tiles that were hidden in nearly every frame, (T,)."""
        if self.frames < self.enough:
            return np.zeros(len(self.fraction), dtype=bool)
        return self.fraction >= ALWAYS

    def _largest(self, hidden: Mask) -> tuple[str, str]:
        """Size and middle of the largest part that hangs together, mm."""
        labels, count = ndimage.label(hidden.reshape(self.shape), np.ones((3, 3)))
        sizes = np.bincount(labels.ravel(), minlength=count + 1)
        part = labels.ravel() == 1 + int(np.argmax(sizes[1:]))
        low, high = self.corners[part, 0].min(axis=0), self.corners[part, 1].max(axis=0)
        (along_x, along_y), (x, y) = high - low, 0.5 * (low + high)
        return f"{along_x:.0f} × {along_y:.0f}", f"({x:.0f}, {y:.0f})"
