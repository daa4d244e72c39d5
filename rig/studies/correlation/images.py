"""Pictures whose motion is known: spots, moved and stretched in closed form."""

import numpy as np
from scipy.special import erf

SPOT = 4.2 / np.sqrt(8 * np.log(2))  # px, standard deviation of a spot 4.2 px wide at half height
CONTRAST = 56.0  # grey levels, standard deviation of the picture
DENSITY = 1 / 12  # spots per px²


def speckle(side, shift=(0.0, 0.0), stretch=(1.0, 1.0), seed=0, contrast=CONTRAST):
    """Draw spots that move by u = shift + (stretch - 1)(x - middle): exact, (side, side) float64.

    A spot is a Gaussian, integrated over each pixel by erf.
    """
    rng = np.random.default_rng(seed)
    stretch, middle, margin = np.asarray(stretch), (side - 1) / 2, 20 + 0.1 * side
    count = int((side + 2 * margin) ** 2 * DENSITY)
    centres = rng.uniform(-margin, side + margin, (count, 2))
    centres = middle + np.asarray(shift) + stretch * (centres - middle)
    heights = rng.choice([-1.0, 1.0], count) * contrast / np.sqrt(np.pi * SPOT**2 * DENSITY)
    edges, wide = np.arange(side + 1) - 0.5, SPOT * stretch
    image = np.full((side, side), 128.0)
    for some in np.array_split(np.argsort(centres[:, 1]), side // 3):
        below = np.searchsorted(edges, centres[some, 1].min() - 5 * wide[1]) - 1
        above = np.searchsorted(edges, centres[some, 1].max() + 5 * wide[1]) + 1
        rows = slice(max(below, 0), max(min(above, side), 0))
        along, down = (
            np.diff(erf((edges[:, None] - centres[some, a]) / (np.sqrt(2) * wide[a])), axis=0)
            for a in (0, 1)
        )
        image[rows] += (down[rows] * heights[some]) @ along.T * (np.pi / 2 * wide.prod())
    return image


def eight_bit(image, noise=0.0, rng=None):
    """Add noise, round and clip as a camera of 8 bit does."""
    seen = image if rng is None else image + rng.normal(0, noise, image.shape)
    return np.clip(np.rint(seen), 0, 255).astype(np.uint8)


def displacement(side, xy, shift=(0.0, 0.0), stretch=(1.0, 1.0)):
    """Truth (N, 2) px at points of the reference."""
    return np.asarray(shift) + (np.asarray(stretch) - 1) * (xy - (side - 1) / 2)
