"""Patterns as a printer makes them, moved by exact fields: dots and noise, hard and soft edges.

Each pixel is the mean of many samples of the ink, and each sample is taken where the material
lay before it moved: no image is ever warped or interpolated.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np

from dic.compiled import njit
from rig.system.arrays import F32, F64

SAMPLES = 6  # along each side of a pixel
DARK, BRIGHT = 40.0, 215.0  # grey levels of ink and paper
COVER = 0.5  # fraction of the paper under dots
DIAMETERS = (1.5, 2.2, 3.5, 6.0)  # px
EDGES = {"hard": 0.02, "soft": 0.25}  # width of an edge over the diameter of a spot
_NEAR = 3.5  # widths of an edge, or of a spot of noise, from which nothing is left

Field: TypeAlias = tuple[float, float, float, float]
"""Shear; height of a bump, px; its half width and height, px."""

STILL: Field = (0.0, 0.0, 1.0, 1.0)


@dataclass(frozen=True)
class Print:
    """A printed pattern.

    Attributes
    ----------
    kind : {"dots", "noise"}
        Discs laid at random, or a random field cut at one level.
    diameter : float, px
        Of a disc; of noise the width at which it is half correlated.
    edge : float, px
        Standard deviation of the blur of an edge.
    """

    kind: Literal["dots", "noise"]
    diameter: float
    edge: float
    seed: int = 0

    @property
    def name(self) -> str:
        """Kind, size and edge in words."""
        hard = self.edge < 0.1 * self.diameter
        return f"{self.kind} of {self.diameter:g} px, {'hard' if hard else 'soft'}"


def prints() -> Iterator[Print]:
    """List the sixteen patterns of the study."""
    for kind in ("dots", "noise"):
        for diameter in DIAMETERS:
            for width in EDGES.values():
                yield Print(kind, diameter, width * diameter)


def draw(pattern: Print, shape: tuple[int, int], field: Field = STILL) -> F64:
    """Draw a pattern that a field has moved, (H, W) float64, grey levels.

    Parameters
    ----------
    shape : (H, W), px
    field : tuple
        As `motion` takes it.
    """
    centres, heights = _spots(pattern, shape)
    ink = np.empty(shape)
    rows = max(1, 2**22 // (shape[1] * SAMPLES**2))
    for top in range(0, shape[0], rows):
        band = np.zeros((min(rows, shape[0] - top) * SAMPLES, shape[1] * SAMPLES), np.float32)
        middle = (shape[1] - 1) / 2, (shape[0] - 1) / 2
        if pattern.kind == "dots":
            _lay_dots(centres, pattern.diameter / 2, pattern.edge, top, middle, field, band)
        else:
            _add_noise(centres, heights, pattern.diameter / 2, top, middle, field, band)
            _cut(band, pattern.edge / (pattern.diameter / 2) * math.sqrt(2))
        cells = band.reshape(-1, SAMPLES, shape[1], SAMPLES)
        ink[top : top + len(cells)] = cells.mean(axis=(1, 3), dtype=np.float64)
    return BRIGHT + (DARK - BRIGHT) * ink


def motion(shape: tuple[int, int], xy: F64, field: Field) -> F64:
    """Displacement (N, 2) px of points of the reference: shear, and a bump as a camera sees it.

    u = γ y + x b, v = y b with b = B ((1 - (x/a)²)(1 - (y/c)²))² inside the clamped edges, x and y
    from the middle: what a pinhole sees of a clamped plate that is pressed.
    """
    middle = np.array(shape[::-1]) / 2 - 0.5
    return np.array([_move(x, y, field) for x, y in xy - middle])


def _spots(pattern: Print, shape: tuple[int, int]) -> tuple[F64, F64]:
    """Centres (N, 2) px from the middle of the image, and heights (N,) of noise."""
    rng = np.random.default_rng(pattern.seed)
    size = np.array(shape[::-1]) * 1.1 + 60
    radius = pattern.diameter / 2
    if pattern.kind == "dots":
        density = -math.log(1 - COVER) / (math.pi * radius**2)
    else:
        density = 3 / radius**2
    count = int(density * size.prod())
    heights = rng.choice([-1.0, 1.0], count) / math.sqrt(density * math.pi * radius**2)
    return rng.uniform(-0.5, 0.5, (count, 2)) * size, heights


@njit(cache=True, nogil=True)
def _move(x: float, y: float, field: Field) -> tuple[float, float]:
    shear, height, half_x, half_y = field
    p, q = 1 - (x / half_x) ** 2, 1 - (y / half_y) ** 2
    bump = height * (p * q) ** 2 if p > 0 and q > 0 else 0.0
    return shear * y + x * bump, y * bump


@njit(cache=True, nogil=True)
def _before(x: float, y: float, field: Field) -> tuple[float, float]:
    """Place from which the material at (x, y) came."""
    u, v = 0.0, 0.0
    for _ in range(5):  # each leaves a hundredth of the error of the one before
        u, v = _move(x - u, y - v, field)
    return x - u, y - v


@njit(cache=True, nogil=True)
def _span(middle: float, reach: float, count: int) -> tuple[int, int]:
    """First sample of a line, and that behind its last, within `reach` px of a place."""
    first = math.ceil((middle - reach + 0.5) * SAMPLES - 0.5)
    last = math.floor((middle + reach + 0.5) * SAMPLES - 0.5)
    return max(first, 0), min(last + 1, count)


@njit(cache=True, nogil=True)
def _lay_dots(
    centres: F64,
    radius: float,
    edge: float,
    top: int,
    middle: tuple[float, float],
    field: Field,
    band: F32,
) -> None:
    """Lay discs over one another: the ink of a sample is that of the darkest one."""
    reach = radius + _NEAR * edge
    for n in range(centres.shape[0]):
        x, y = centres[n]
        u, v = _move(x, y, field)
        left, right = _span(x + u + middle[0], 1.05 * reach + 0.1, band.shape[1])
        first, last = _span(y + v + middle[1] - top, 1.05 * reach + 0.1, band.shape[0])
        for j in range(first, last):
            there_y = (j + 0.5) / SAMPLES - 0.5 + top - middle[1]
            for i in range(left, right):
                there_x = (i + 0.5) / SAMPLES - 0.5 - middle[0]
                here_x, here_y = _before(there_x, there_y, field)
                away = math.sqrt((here_x - x) ** 2 + (here_y - y) ** 2) - radius
                if away < _NEAR * edge:
                    band[j, i] = max(band[j, i], 0.5 * math.erfc(away / (math.sqrt(2) * edge)))


@njit(cache=True, nogil=True)
def _add_noise(
    centres: F64,
    heights: F64,
    width: float,
    top: int,
    middle: tuple[float, float],
    field: Field,
    band: F32,
) -> None:
    """Add Gaussian spots to a random field of variance 1/2."""
    reach = _NEAR * width
    for n in range(centres.shape[0]):
        x, y = centres[n]
        u, v = _move(x, y, field)
        left, right = _span(x + u + middle[0], 1.05 * reach + 0.1, band.shape[1])
        first, last = _span(y + v + middle[1] - top, 1.05 * reach + 0.1, band.shape[0])
        for j in range(first, last):
            there_y = (j + 0.5) / SAMPLES - 0.5 + top - middle[1]
            for i in range(left, right):
                there_x = (i + 0.5) / SAMPLES - 0.5 - middle[0]
                here_x, here_y = _before(there_x, there_y, field)
                away = ((here_x - x) ** 2 + (here_y - y) ** 2) / width**2
                if away < _NEAR**2:
                    band[j, i] += heights[n] * math.exp(-away)


@njit(cache=True, nogil=True)
def _cut(band: F32, softness: float) -> None:
    """Turn a random field into ink: at one level, over `softness` of its values."""
    for j in range(band.shape[0]):
        for i in range(band.shape[1]):
            band[j, i] = 0.5 * math.erfc(-band[j, i] / softness)
