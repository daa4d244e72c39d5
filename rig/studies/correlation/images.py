"""Images whose motion is known: spots, moved and stretched in closed form."""

from collections.abc import Sequence
from typing import cast

import numpy as np
from numpy.typing import NDArray
from scipy.special import erf

from rig.system.arrays import F64

SPOT = 4.2 / np.sqrt(8 * np.log(2))  # px, standard deviation of a spot 4.2 px wide at half height
CONTRAST = 56.0  # grey levels, standard deviation of the image
DENSITY = 1 / 12  # spots per px²
Pair = tuple[float, float] | Sequence[float] | NDArray[np.float64]


def speckle(
    side: int,
    shift: Pair = (0.0, 0.0),
    stretch: Pair = (1.0, 1.0),
    seed: int = 0,
    contrast: float = CONTRAST,
) -> NDArray[np.float64]:
    """Draw spots that move by u = shift + (stretch - 1)(x - middle): exact, (side, side) float64.

    A spot is a Gaussian, integrated over each pixel by erf.
    """
    rng = np.random.default_rng(seed)
    scale, middle, margin = np.asarray(stretch), (side - 1) / 2, 20 + 0.1 * side
    count = int((side + 2 * margin) ** 2 * DENSITY)
    centres = rng.uniform(-margin, side + margin, (count, 2))
    centres = middle + np.asarray(shift) + scale * (centres - middle)
    heights = rng.choice([-1.0, 1.0], count) * contrast / np.sqrt(np.pi * SPOT**2 * DENSITY)
    edges, wide = cast(F64, np.arange(side + 1) - 0.5), SPOT * scale
    image = np.full((side, side), 128.0)
    for some in np.array_split(np.argsort(centres[:, 1]), side // 3):
        below = int(edges.searchsorted(float(centres[some, 1].min() - 5 * wide[1]))) - 1
        above = int(edges.searchsorted(float(centres[some, 1].max() + 5 * wide[1]))) + 1
        rows = slice(max(below, 0), max(min(above, side), 0))
        along, down = (
            _over_pixels((edges[:, None] - centres[some, a]) / (np.sqrt(2) * wide[a]))
            for a in (0, 1)
        )
        image[rows] += (down[rows] * heights[some]) @ along.T * (np.pi / 2 * wide.prod())
    return image


def _over_pixels(edges: F64) -> F64:
    return np.diff(erf(edges), axis=0)


def eight_bit(
    image: NDArray[np.float64], noise: float = 0.0, rng: np.random.Generator | None = None
) -> NDArray[np.uint8]:
    """Add noise, round and clip as a camera of 8 bit does."""
    seen = image if rng is None else image + rng.normal(0, noise, image.shape)
    return np.clip(np.rint(seen), 0, 255).astype(np.uint8)


def displacement(
    side: int, xy: NDArray[np.float64], shift: Pair = (0.0, 0.0), stretch: Pair = (1.0, 1.0)
) -> NDArray[np.float64]:
    """Truth (N, 2) px at points of the reference."""
    return np.asarray(shift) + (np.asarray(stretch) - 1) * (xy - (side - 1) / 2)
