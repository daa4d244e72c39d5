"""The speckle pattern of a plate as a smooth function of the plate point."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from synthetic.arrays import F64, I64
from synthetic.compiled import njit
from synthetic.points import checked

# Spots differ in radius by this fraction either way, so that no ring of the spectrum is empty.
SPREAD = 0.2


@dataclass(frozen=True)
class Speckle:
    """What to sprinkle on a plate: dark round spots on a light ground.

    Attributes
    ----------
    size : (a, b) of the plate, mm.
    diameter : mean diameter of a spot, mm. Four to five pixels of the camera serve DIC best.
    density : fraction of the plate that spots cover.
    contrast : light that a spot takes away, 0 to 1.
    softness : width of the edge of a spot, from full to none, over its diameter. It stands for
        paint and lens; an edge of two pixels has the steepness of a sharp lens, and below one
        pixel an image needs more samples than `render` takes by default.
    seed : seed of the places and radii.

    Raises
    ------
    ValueError
        A diameter that is not positive, a fraction out of range, spots that are all edge or that do
        not fit on the plate.
    """

    size: tuple[float, float] = (254.0, 254.0)
    diameter: float = 1.25
    density: float = 0.5
    contrast: float = 1.0
    softness: float = 0.4
    seed: int = 0

    def __post_init__(self):
        if not 0 < self.diameter < np.inf:
            raise ValueError(f"spot diameter must be positive, got {self.diameter} mm")
        if not 0 < self.density < 1:
            raise ValueError(f"spot density must lie in 0 < density < 1, got {self.density}")
        if not 0 <= self.contrast <= 1:
            raise ValueError(f"contrast must lie in 0 ≤ contrast ≤ 1, got {self.contrast}")
        if not 0 < self.softness <= 1 - SPREAD:
            raise ValueError(
                f"spot softness must lie in 0 < softness ≤ {1 - SPREAD:g} of the diameter, "
                f"got {self.softness}"
            )
        min_side = 2 * self.reach + self.pitch
        if not all(min_side <= length < np.inf for length in self.size):
            raise ValueError(
                f"plate must be at least {min_side:g} mm wide for spots of {self.diameter} mm, "
                f"got {self.size} mm"
            )

    @property
    def pitch(self) -> float:
        """Mean distance of neighbouring spots, mm."""
        # Area A of the spots over area of the plate. Independent spots cover 1 − exp(−A); those
        # of a jittered grid overlap less, measured 1 − exp(−A (1 + 0.42 A)) within 1 % up to 0.9.
        exponent = -np.log1p(-self.density)
        area = (np.sqrt(1 + 4 * 0.42 * exponent) - 1) / (2 * 0.42)
        return float(self.diameter * np.sqrt(np.pi / 4 / area))

    @property
    def edge(self) -> float:
        """Width of the edge of a spot, mm."""
        return self.softness * self.diameter

    @property
    def reach(self) -> float:
        """Largest distance from its centre at which a spot takes light away, mm."""
        return (self.diameter * (1 + SPREAD) + self.edge) / 2

    def draw(self) -> "Pattern":
        """Draw the spots, one at random in each square of a grid, all of them whole on the plate.

        A jittered grid leaves no large hole and no heap, as a good spray does. The image is
        smooth across the edge of the plate because no spot is cut.
        """
        rng = np.random.default_rng(self.seed)
        room = np.array(self.size) - 2 * self.reach
        columns, rows = (max(round(float(side)), 1) for side in room / self.pitch)
        squares = np.stack(np.meshgrid(np.arange(columns), np.arange(rows)), axis=-1)
        jitter = rng.random((rows, columns, 2))
        centres = self.reach + ((squares + jitter) * (room / (columns, rows))).reshape(-1, 2)
        radii = self.diameter / 2 * rng.uniform(1 - SPREAD, 1 + SPREAD, len(centres))
        across, down = np.ceil(np.array(self.size) / self.reach).astype(int).tolist()
        order, first = _sort_into_cells(centres, self.reach, (across, down))
        return Pattern(self, centres[order], radii[order], first)


@dataclass(frozen=True, eq=False)
class Pattern:
    """A drawn speckle pattern: light reflected by each plate point.

    Attributes
    ----------
    speckle : the description it was drawn from.
    centres : (S, 2) float64, mm, plate frame, sorted by cell.
    radii : (S,) float64, mm, where the edge has half its depth.
    first : (rows, columns + 1) int64, the spots of cell (r, c) are first[r, c]:first[r, c + 1].
        A cell is `speckle.reach` wide, so that a point meets spots of its 3 × 3 cells alone.
    """

    speckle: Speckle
    centres: F64
    radii: F64
    first: I64

    def intensity(self, points: ArrayLike) -> F64:
        """Light at plate points: Π (1 − contrast s(r)) over the spots, 1 on the bare ground.

        The edge s falls from 1 to 0 by the quintic that has two continuous derivatives.

        Parameters
        ----------
        points : (K, 2) float64, mm, plate frame; the ground goes on outside the plate.

        Returns
        -------
        (K,) float64, 0 to 1.
        """
        points = np.ascontiguousarray(checked(points, 2, "plate points", "mm"))
        speckle, light = self.speckle, np.empty(len(points))
        shape = np.array([speckle.reach, speckle.edge, speckle.contrast])
        _intensity(points, self.centres, self.radii, self.first, shape, light)
        return light


def speckle(size: tuple[float, float] = (254.0, 254.0), **spots: Any) -> Pattern:
    """Draw the pattern of a plate of that size, mm; `spots` are further parts of `Speckle`."""
    return Speckle(size, **spots).draw()


def _sort_into_cells(centres: F64, width: float, cells: tuple[int, int]) -> tuple[I64, I64]:
    """Order of the spots by cell, and the first spot of each cell, shape (rows, columns + 1)."""
    columns, rows = cells
    cell = (centres // width).astype(np.int64)
    number = cell[:, 1] * columns + cell[:, 0]
    order = np.argsort(number, kind="stable")
    ends: I64 = np.add.outer(columns * np.arange(rows), np.arange(columns + 1))
    return order, np.searchsorted(number[order], ends)


@njit(cache=True, nogil=True, fastmath=True)
def _intensity(points: F64, centres: F64, radii: F64, first: I64, shape: F64, light: F64) -> None:
    reach, width, contrast = shape
    rows, columns = first.shape[0], first.shape[1] - 1
    for k in range(len(points)):
        x, y = points[k, 0], points[k, 1]
        column, row = int(np.floor(x / reach)), int(np.floor(y / reach))
        left, right = max(column - 1, 0), min(column + 2, columns)
        product = 1.0
        if left < right:
            for r in range(max(row - 1, 0), min(row + 2, rows)):
                for j in range(first[r, left], first[r, right]):
                    dx, dy = x - centres[j, 0], y - centres[j, 1]
                    far = dx * dx + dy * dy
                    outer = radii[j] + width / 2
                    if far < outer * outer:
                        t = min((outer - np.sqrt(far)) / width, 1.0)
                        edge = t * t * t * (10 + t * (6 * t - 15))
                        product *= 1 - contrast * edge
        light[k] = product
