"""Exact speckle: a sum of Gaussian spots, moved in closed form and integrated over each pixel."""

from dataclasses import dataclass

import numpy as np
import pytest
from numba import njit

DIAMETER = 4.5  # px, full width of a spot at half its height
CONTRAST = 50.0  # grey levels
NODES, WEIGHTS = np.polynomial.legendre.leggauss(4)


@njit  # not cached: a test module has no lasting name
def _add_spots(image, centres, heights, metric, reach, nodes, weights):
    for n in range(len(centres)):
        cx, cy = centres[n]
        for y in range(max(0, int(cy - reach)), min(image.shape[0], int(cy + reach) + 2)):
            for x in range(max(0, int(cx - reach)), min(image.shape[1], int(cx + reach) + 2)):
                total = 0.0
                for i in range(4):
                    dy = y + nodes[i] / 2 - cy
                    for j in range(4):
                        dx = x + nodes[j] / 2 - cx
                        power = metric[0, 0] * dx * dx + 2 * metric[0, 1] * dx * dy
                        power += metric[1, 1] * dy * dy
                        total += weights[i] * weights[j] * np.exp(-power)
                image[y, x] += heights[n] * total / 4


@dataclass(frozen=True)
class Speckle:
    """Spots scattered around an image (H, W), with a margin from which they may move in."""

    shape: tuple[int, int]
    seed: int = 0
    margin: int = 48

    @property
    def middle(self):
        return (np.array(self.shape[::-1]) - 1) / 2

    def draw(self, shift=(0.0, 0.0), gradient=((0.0, 0.0), (0.0, 0.0))):
        """Image moved by U(X) = shift + gradient (X - middle), (H, W) float64, grey levels."""
        rng = np.random.default_rng(self.seed)
        size = np.array(self.shape[::-1]) + 2 * self.margin
        count = int(size.prod() / 12)
        centres = rng.uniform(0, 1, (count, 2)) * size - self.margin
        heights = rng.choice([-1.0, 1.0], count)
        spread = DIAMETER / np.sqrt(8 * np.log(2))
        # Variance of shot noise: density · ∫ spot².
        heights *= CONTRAST / np.sqrt(np.pi * spread**2 / 12)
        stretch = np.eye(2) + np.asarray(gradient)
        moved = self.middle + np.asarray(shift) + (centres - self.middle) @ stretch.T
        metric = np.linalg.inv(stretch @ stretch.T) / (2 * spread**2)
        image = np.full(self.shape, 128.0)
        _add_spots(image, moved, heights, metric, 5.5 * spread, NODES, WEIGHTS)
        return image

    def displacement(self, xy, shift=(0.0, 0.0), gradient=((0.0, 0.0), (0.0, 0.0))):
        """Truth (N, 2) px at points of the reference."""
        return np.asarray(shift) + (xy - self.middle) @ np.asarray(gradient).T


@pytest.fixture(scope="session")
def speckle():
    """Maker of speckles: speckle((H, W), seed)."""
    return Speckle


@pytest.fixture(scope="session")
def pattern():
    """Make the speckle that most tests share, 150x190 px."""
    return Speckle((150, 190), seed=3)


@pytest.fixture(scope="session")
def reference(pattern):
    """Its image."""
    return pattern.draw()
